"""Transflower and its deterministic baseline (docs/valleperez2021.md): plain, out of torch.nn modules,
and as fast as we can make it on a CPU.

W windows; L tokens; D numbers of motion, A of audio. A batch is a dictionary of tensors by the names of
an exported batch, rows window by window: motion [W motion_context, D], audio [W (past + future), A],
target [W N, D].
"""

import math
from dataclasses import dataclass

import torch
from torch import nn
from torch.nn import functional

import flow

GIVEN = ["motion", "audio", "target"]
BUCKETS = 32
THRESHOLDS = (8, 12, 16, 23, 32, 46, 64, 91)


@dataclass(frozen=True)
class Sizes:
    width: int
    heads: int
    feed_forward: int
    layers: int


@dataclass(frozen=True)
class Setting:
    """What a config and its data say; the defaults are the paper's, D that of generated dances."""

    motion: int = 70
    audio: int = 85
    head: str = "flow"
    width: int = 800
    heads: int = 10
    feed_forward: int = 800
    layers: tuple = (2, 2, 12)  # motion, audio, cross
    motion_context: int = 120
    audio_frames: int = 140
    predicted_frames: int = 3
    hears: bool = True
    positions: str = "t5"
    cross_positions: str = "index"
    blocks: int = 16
    coupling: Sizes = Sizes(512, 8, 512, 2)
    norm: str = "batch"

    def encoder(self, layers):
        return Sizes(self.width, self.heads, self.feed_forward, layers)


def bucket(delta):
    """T5's bucket of a key's time less a query's."""
    distance = abs(delta)
    near = distance if distance < 8 else 7 + sum(distance >= it for it in THRESHOLDS)
    return near + BUCKETS // 2 * (delta > 0)


class RelativeBias(nn.Module):
    """What is added to the scores of tokens at `places`, pairs (time, modality): [heads or 1, L, L]."""

    def __init__(self, positions, places, heads):
        super().__init__()
        self.positions = positions
        tokens, kinds = len(places), 1 + max(modality for _, modality in places)
        if positions == "table":
            self.table = nn.Parameter(torch.zeros(tokens, tokens))
            return
        self.weight = nn.Parameter(torch.zeros(BUCKETS * kinds**2, heads))
        buckets = [
            [BUCKETS * (kinds * of + to) + bucket(there - here) for there, to in places]
            for here, of in places
        ]
        self.register_buffer("buckets", torch.tensor(buckets), persistent=False)

    def forward(self, queries):
        """Of the first tokens as queries, [heads or 1, queries, L]."""
        if self.positions == "table":
            return self.table[None, :queries]
        return self.weight[self.buckets[:queries]].permute(2, 0, 1)


class Transformer(nn.Module):
    """Linear, post-norm layers, linear."""

    layer = nn.TransformerEncoderLayer

    def __init__(self, inputs, outputs, sizes, positions, places):
        super().__init__()
        self.input = nn.Linear(inputs, sizes.width)
        self.layers = nn.ModuleList(
            self.layer(sizes.width, sizes.heads, sizes.feed_forward, dropout=0.0, batch_first=True)
            for _ in range(sizes.layers)
        )
        if positions != "none":
            self.relative_bias = RelativeBias(positions, places, sizes.heads)
        self.output = nn.Linear(sizes.width, outputs)
        nn.init.uniform_(self.output.weight, -0.1, 0.1)
        nn.init.zeros_(self.output.bias)

    def bias(self, queries):
        return self.relative_bias(queries) if hasattr(self, "relative_bias") else None

    def forward(self, x, asking):
        """x [W, L, inputs] -> what the first `asking` tokens become, [W, asking, outputs]."""
        windows, tokens = x.shape[:2]
        x = self.input(x)
        mask = self.bias(tokens)
        for layer in self.layers:
            heads = layer.self_attn.num_heads
            own = None
            if mask is not None:
                own = mask.expand(windows, heads, tokens, tokens).flatten(0, 1)
            x = layer(x, src_mask=own)
        return self.output(x[:, :asking])


class FastLayer(nn.TransformerEncoderLayer):
    """The same numbers, for tokens of which only the first `queries` ask; the bias is not copied."""

    def forward(self, x, queries, bias):
        own, width = self.self_attn, x.shape[-1]
        asking = x[:, :queries]
        if queries == x.shape[1]:
            projected = functional.linear(x, own.in_proj_weight, own.in_proj_bias).chunk(3, -1)
        else:
            weights, biases = own.in_proj_weight, own.in_proj_bias
            of_asking = functional.linear(asking, weights[:width], biases[:width])
            of_all = functional.linear(x, weights[width:], biases[width:])
            projected = (of_asking, *of_all.chunk(2, -1))
        q, k, v = (it.unflatten(-1, (own.num_heads, -1)).transpose(1, 2) for it in projected)
        if bias is None:
            mixed = functional.scaled_dot_product_attention(q, k, v)
        else:
            # The fused kernel has no gradient for what is added to the scores.
            scores = (q * q.shape[-1] ** -0.5) @ k.transpose(-1, -2) + bias
            mixed = scores.softmax(-1) @ v
        mixed = own.out_proj(mixed.transpose(1, 2).flatten(2))
        x = self.norm1(asking + mixed)
        return self.norm2(x + self.linear2(self.linear1(x).relu()))


class FastTransformer(Transformer):
    """The same numbers: in the last layer only those that ask are computed."""

    layer = FastLayer

    def forward(self, x, asking):
        tokens = x.shape[1]
        x = self.input(x)
        bias = self.bias(tokens)
        for number, layer in enumerate(self.layers):
            queries = asking if number + 1 == len(self.layers) else tokens
            x = layer(x, queries, None if bias is None else bias[:, :queries])
        return self.output(x[:, :asking])


class Coupling(nn.Module):
    """(s, t) = net([b, h]); [(a + t) scale, b], scale = sigmoid(rho tanh(s) + 2) + 1 - sigmoid(2)."""

    def __init__(self, setting, transformer):
        super().__init__()
        self.changed = (setting.motion + 1) // 2
        inputs = setting.motion - self.changed + setting.width
        places = [(time, 0) for time in range(setting.predicted_frames)]
        self.net = transformer(
            inputs, 2 * self.changed, setting.coupling, setting.positions, places
        )
        self.rescale = nn.Parameter(torch.ones(self.changed))

    def scale_and_shift(self, b, h):
        s, t = self.net(torch.cat([b, h], -1), b.shape[1]).split(self.changed, -1)
        least = 1 - 1 / (1 + math.exp(-2.0))
        return torch.sigmoid(self.rescale * s.tanh() + 2) + least, t

    def forward(self, x, h):
        """y [W, N, D] and the log-determinant of whole windows, [W]."""
        a, b = x[..., : self.changed], x[..., self.changed :]
        scale, t = self.scale_and_shift(b, h)
        return torch.cat([(a + t) * scale, b], -1), scale.log().sum((1, 2))

    def inverse(self, y, h):
        out, b = y[..., : self.changed], y[..., self.changed :]
        scale, t = self.scale_and_shift(b, h)
        return torch.cat([out / scale - t, b], -1)


class Block(nn.Module):
    def __init__(self, setting, transformer):
        super().__init__()
        self.norm = flow.NORMS[setting.norm](setting.motion)
        self.linear = flow.PluLinear(setting.motion)
        self.coupling = Coupling(setting, transformer)

    def forward(self, x, h):
        """y [W, N, D] and the log-determinants of norm, linear layer and coupling."""
        x, norm = self.norm(x)
        x, linear = self.linear(x)
        x, coupling = self.coupling(x, h)
        return x, norm, linear, coupling

    def inverse(self, y, h):
        return self.norm.inverse(self.linear.inverse(self.coupling.inverse(y, h)))


class Flow(nn.Module):
    def __init__(self, setting, transformer):
        super().__init__()
        self.blocks = nn.ModuleList(Block(setting, transformer) for _ in range(setting.blocks))

    def forward(self, x, h):
        """x [W, N, D] and the latent h [W, N, width]."""
        norms, linears, couplings = 0, 0, 0
        for block in self.blocks:
            x, norm, linear, coupling = block(x, h)
            norms, linears, couplings = norms + norm, linears + linear, couplings + coupling
        return flow.Flowed(x, norms, linears, couplings)

    def inverse(self, z, h):
        for block in reversed(self.blocks):
            z = block.inverse(z, h)
        return z


def cross_places(setting):
    """Of motion, then audio: indices, or frames with a bias for each pair of modalities."""
    motion, audio = setting.motion_context, setting.audio_frames
    if setting.cross_positions == "index":
        return [(time, 0) for time in range(motion + audio)]
    return [(time, 0) for time in range(motion)] + [(time, 1) for time in range(audio)]


class Valleperez2021(nn.Module):
    """The weights have the names of a run's."""

    def __init__(self, setting, transformer=Transformer):
        super().__init__()
        self.setting = s = setting
        motion, audio, cross = (s.encoder(layers) for layers in s.layers)
        places = [(time, 0) for time in range(max(s.motion_context, s.audio_frames))]
        self.motion_encoder = transformer(
            s.motion, s.width, motion, s.positions, places[: s.motion_context]
        )
        self.audio_encoder = transformer(
            s.audio, s.width, audio, s.positions, places[: s.audio_frames]
        )
        is_flow = s.head == "flow"
        # The authors' table is not across modalities.
        across = "none" if s.positions == "table" else s.positions
        outputs = s.width if is_flow else s.motion
        self.cross_encoder = transformer(s.width, outputs, cross, across, cross_places(s))
        if is_flow:
            self.flow = Flow(s, transformer)

    def latent(self, batch):
        """h [W, N, width]; of the deterministic baseline the prediction [W, N, D]."""
        s = self.setting
        motion = batch["motion"].unflatten(0, (-1, s.motion_context))
        audio = batch["audio"].unflatten(0, (-1, s.audio_frames))
        audio = audio if s.hears else torch.zeros_like(audio)
        motion = self.motion_encoder(motion, s.motion_context)
        audio = self.audio_encoder(audio, s.audio_frames)
        return self.cross_encoder(torch.cat([motion, audio], 1), s.predicted_frames)

    def target(self, batch):
        return batch["target"].unflatten(0, (-1, self.setting.predicted_frames))

    def forward(self, batch):
        """The losses, each a scalar by its name."""
        h, target = self.latent(batch), self.target(batch)
        if self.setting.head == "flow":
            return flow.losses(self.flow(target, h))
        error = (target - h).square().mean()
        return {"squared_error": error, "total": error}
