"""MoGlow as Transflower's authors compare with it (docs/valleperez2021.md): plain, out of torch.nn
modules, and as fast as we can make it on a CPU.

S sequences of F frames, row f S + s. A batch is a dictionary of tensors by the names of an exported
batch: condition [F S, numbers], target [F S, D], sequences [1].
"""

from dataclasses import dataclass

import torch
from torch import nn
from torch.nn import functional

import flow

GIVEN = ["condition", "target"]


@dataclass(frozen=True)
class Setting:
    """What a config and its data say; the defaults are the paper's, D that of generated dances."""

    motion: int = 70
    condition: int = 40 * 70 + 50 * 85
    blocks: int = 16
    hidden: int = 512
    lstm_layers: int = 2


class Coupling(nn.Module):
    """[a, (b + shift) scale], scale = sigmoid(logit + 2) + 1e-6; shift and logit alternate in net([a, c])."""

    def __init__(self, setting):
        super().__init__()
        self.kept = setting.motion // 2
        inputs = self.kept + setting.condition
        self.lstm = nn.LSTM(inputs, setting.hidden, setting.lstm_layers)
        self.output = nn.Linear(setting.hidden, 2 * (setting.motion - self.kept))
        nn.init.zeros_(self.output.weight)
        nn.init.zeros_(self.output.bias)

    def scale_and_shift(self, a, condition, state=None):
        """Of frames one after another, [F, S, ceil(D / 2)] each, and the state behind them."""
        x, state = self.lstm(torch.cat([a, condition], -1), state)
        return *scale_and_shift(self.output(x)), state

    def of_sequences(self, a, condition):
        """Scale and shift of whole sequences."""
        return self.scale_and_shift(a, condition)[:2]

    def forward(self, x, condition):
        """y [F, S, D] and the log-determinant of whole sequences, [S]."""
        a, b = x[..., : self.kept], x[..., self.kept :]
        scale, shift = self.of_sequences(a, condition)
        return torch.cat([a, (b + shift) * scale], -1), scale.log().sum((0, 2))

    def inverse(self, y, condition, state):
        a, out = y[..., : self.kept], y[..., self.kept :]
        scale, shift, state = self.scale_and_shift(a, condition, state)
        return torch.cat([a, out / scale - shift], -1), state


def scale_and_shift(said):
    shift, logit = said.unflatten(-1, (-1, 2)).unbind(-1)
    return torch.sigmoid(logit + 2) + 1e-6, shift


class FastCoupling(Coupling):
    """The same numbers: the first layer's product with the condition is not one with a copy of it, and
    a layer's steps are one function for a compiler."""

    run_layer = staticmethod(lambda gates, recurrent: lstm_layer(gates, recurrent))

    def of_sequences(self, a, condition):
        p = dict(self.lstm.named_parameters())
        for k in range(self.lstm.num_layers):
            weight, bias = p[f"weight_ih_l{k}"], p[f"bias_ih_l{k}"] + p[f"bias_hh_l{k}"]
            if k == 0:
                gates = functional.linear(condition, weight[:, self.kept :], bias)
                gates = gates + functional.linear(a, weight[:, : self.kept])
            else:
                gates = functional.linear(x, weight, bias)
            x = self.run_layer(gates, p[f"weight_hh_l{k}"])
        return scale_and_shift(self.output(x))


def lstm_layer(gates, recurrent):
    """Outputs [F, S, H] of what inputs and biases give the gates, [F, S, 4 H]; the state is 0 at first."""
    outputs = []
    for number, own in enumerate(gates.unbind()):
        if number > 0:
            own = own + functional.linear(outputs[-1], recurrent)
        i, f, g, o = own.chunk(4, -1)
        fresh = i.sigmoid() * g.tanh()
        cell = fresh if number == 0 else f.sigmoid() * cell + fresh
        outputs.append(o.sigmoid() * cell.tanh())
    return torch.stack(outputs)


class Block(nn.Module):
    def __init__(self, setting, coupling):
        super().__init__()
        self.norm = flow.ActNorm(setting.motion)
        self.linear = flow.PluLinear(setting.motion)
        self.coupling = coupling(setting)


class Flow(nn.Module):
    def __init__(self, setting, coupling):
        super().__init__()
        self.blocks = nn.ModuleList(Block(setting, coupling) for _ in range(setting.blocks))

    def forward(self, x, condition):
        norms, linears, couplings = 0, 0, 0
        for block in self.blocks:
            x, norm = block.norm(x)
            x, linear = block.linear(x)
            x, coupling = block.coupling(x, condition)
            norms, linears, couplings = norms + norm, linears + linear, couplings + coupling
        return flow.Flowed(x.transpose(0, 1), norms, linears, couplings)

    def inverse(self, z, condition):
        """x [F, S, D] of noise, frame by frame as a dance is made."""
        states, frames = [None] * len(self.blocks), []
        for x, known in zip(z.split(1), condition.split(1)):
            for k, block in reversed(list(enumerate(self.blocks))):
                x, states[k] = block.coupling.inverse(x, known, states[k])
                x = block.norm.inverse(block.linear.inverse(x))
            frames.append(x)
        return torch.cat(frames)


class Moglow2020(nn.Module):
    """The weights have the names of a run's."""

    def __init__(self, setting, coupling=Coupling):
        super().__init__()
        self.flow = Flow(setting, coupling)

    def flowed(self, batch, sequences):
        condition, target = (batch[name].unflatten(0, (-1, sequences)) for name in GIVEN)
        return self.flow(target, condition)

    def forward(self, batch, sequences):
        """The losses, each a scalar by its name."""
        return flow.losses(self.flowed(batch, sequences))
