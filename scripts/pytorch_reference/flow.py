"""What the flows of docs/valleperez2021.md share: norms, the linear layer and the density.

D channels stand last; a log-determinant (nats) is that of a single frame where nothing else is said.
"""

import math
from dataclasses import dataclass

import torch
from torch import nn

EPSILON = 1e-5  # beside a running deviation
MOMENTUM = 0.1  # share of the new statistics
PARTS = ["prior", "norm", "linear", "coupling"]


@dataclass
class Flowed:
    """What a flow makes of W windows of N frames."""

    z: torch.Tensor  # [W, N, D]
    norm: torch.Tensor  # log-determinants: of all norms, scalar
    linear: torch.Tensor  # of all linear layers, scalar
    coupling: torch.Tensor  # of all couplings, of whole windows, [W]


class BatchNorm(nn.Module):
    """y = (x - mu) e^g / (sqrt(v) + 1e-5) - beta by running statistics, which are constants.

    In training they take up the batch first.
    """

    def __init__(self, channels):
        super().__init__()
        self.beta = nn.Parameter(torch.zeros(channels))
        self.log_gamma = nn.Parameter(torch.zeros(channels))
        self.register_buffer("running_mean", torch.zeros(channels))
        self.register_buffer("running_var", torch.ones(channels))

    def forward(self, x):
        if self.training:
            with torch.no_grad():
                var, mean = torch.var_mean(x.flatten(0, -2), 0, correction=0)
                self.running_mean.lerp_(mean, MOMENTUM)
                self.running_var.lerp_(var, MOMENTUM)
        deviation = self.running_var.sqrt() + EPSILON
        y = (x - self.running_mean) * (self.log_gamma.exp() / deviation) - self.beta
        return y, (self.log_gamma - deviation.log()).sum()

    def inverse(self, y):
        deviation = self.running_var.sqrt() + EPSILON
        return (y + self.beta) * deviation / self.log_gamma.exp() + self.running_mean


class ActNorm(nn.Module):
    """y = (x + b) e^s."""

    def __init__(self, channels):
        super().__init__()
        self.bias = nn.Parameter(torch.zeros(channels))
        self.log_scale = nn.Parameter(torch.zeros(channels))

    def forward(self, x):
        return (x + self.bias) * self.log_scale.exp(), self.log_scale.sum()

    def inverse(self, y):
        return y / self.log_scale.exp() - self.bias


NORMS = {"batch": BatchNorm, "act": ActNorm}


class PluLinear(nn.Module):
    """y = W x in every frame, W = P L U; at first an orthogonal matrix."""

    def __init__(self, channels):
        super().__init__()
        orthogonal = torch.linalg.qr(torch.randn(channels, channels, dtype=torch.float64))[0]
        p, lower, upper = torch.linalg.lu(orthogonal)
        like = torch.get_default_dtype()
        self.l = nn.Parameter(lower.tril(-1).to(like))
        self.u = nn.Parameter(upper.triu(1).to(like))
        self.log_s = nn.Parameter(upper.diagonal().abs().log().to(like))
        self.register_buffer("p", p.to(like))
        self.register_buffer("sign_s", upper.diagonal().sign().to(like))

    def factors(self):
        lower = self.l.tril(-1) + torch.eye(len(self.l), dtype=self.l.dtype)
        return lower, self.u.triu(1) + torch.diag(self.sign_s * self.log_s.exp())

    def forward(self, x):
        lower, upper = self.factors()
        return nn.functional.linear(x, self.p @ lower @ upper), self.log_s.sum()

    def inverse(self, y):
        lower, upper = self.factors()
        columns = (y.flatten(0, -2) @ self.p).T
        columns = torch.linalg.solve_triangular(lower, columns, upper=False, unitriangular=True)
        return torch.linalg.solve_triangular(upper, columns, upper=True).T.reshape(y.shape)


def log_density_parts(flowed):
    """The parts of log p, by name, in nats for all frames of a window together, [W] each."""
    windows, frames, _ = flowed.z.shape
    return {
        "prior": -(flowed.z.square() + math.log(2 * math.pi)).sum((1, 2)) / 2,
        "norm": (frames * flowed.norm).expand(windows),
        "linear": (frames * flowed.linear).expand(windows),
        "coupling": flowed.coupling,
    }


def losses(flowed):
    """-log2 p, a frame, and its parts, each a scalar by its name."""
    unit = 1 / (flowed.z.shape[1] * math.log(2))
    terms = {name: -unit * part.mean() for name, part in log_density_parts(flowed).items()}
    return terms | {"total": sum(terms.values())}
