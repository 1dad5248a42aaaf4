"""The model of docs/pu2022.md, out of torch.nn modules.

W windows of T frames of which T' are the seed; rows of a batch stand window by window. A batch is a
dictionary of tensors by the names of an exported batch: seed [W T', 6 J + 3], music [W T, numbers],
key_poses [W T, 6 J], is_key [W T, 1], local_positions [W T, d], weights [W (T - T'), 1],
truth [W (T - T'), 6 J + 3]. Dropout is off.
"""

from dataclasses import dataclass

import torch
from torch import nn

TERMS = ["total", "weighted", "plain"]
GIVEN = ["seed", "music", "key_poses", "is_key", "local_positions", "weights", "truth"]


@dataclass(frozen=True)
class Setting:
    """What a config and its data say; the defaults are the paper's light model."""

    joints: int = 24
    music_numbers: int = 15
    width: int = 256
    heads: int = 4
    layers: tuple = (4, 4, 8)  # motion, music, cross
    feed_forward: int = 1024
    pre_norm: bool = False
    whole_music: bool = False
    local_positions: bool = True
    key_pose_embedding: bool = True
    ordinary_positions: bool = True
    music: bool = True
    seed: int = 60
    length: int = 240


def positions(count, width, like):
    """P [count, width]: sines in even, cosines in odd columns."""
    place = torch.arange(count, dtype=torch.float64)[:, None]
    wave = place / 10000 ** (torch.arange(0, width, 2, dtype=torch.float64) / width)
    return torch.stack([wave.sin(), wave.cos()], -1).reshape(count, width).to(like)


def encoder(setting, layers):
    layer = nn.TransformerEncoderLayer(
        setting.width,
        setting.heads,
        setting.feed_forward,
        dropout=0.0,
        batch_first=True,
        norm_first=setting.pre_norm,
    )
    norm = nn.LayerNorm(setting.width) if setting.pre_norm else None
    return nn.TransformerEncoder(layer, layers, norm, enable_nested_tensor=False)


class Pu2022(nn.Module):
    """The weights have the names of a run's."""

    def __init__(self, setting):
        super().__init__()
        self.setting = setting
        numbers, d = 6 * setting.joints + 3, setting.width
        self.motion_linear = nn.Linear(numbers, d)
        self.music_linear = nn.Linear(setting.music_numbers, d)
        self.key_linear = nn.Linear(6 * setting.joints, d)
        motion, music, cross = setting.layers
        self.motion_encoder = encoder(setting, motion)
        self.music_encoder = encoder(setting, music)
        self.cross = encoder(setting, cross)
        self.output = nn.Linear(d, numbers)

    def forward(self, batch, windows):
        """y' of the generated frames, [W (T - T'), 6 J + 3]."""
        s = self.setting
        by_window = {name: batch[name].unflatten(0, (windows, -1)) for name in GIVEN}
        motion = self.motion_linear(by_window["seed"])
        motion = self.motion_encoder(motion + positions(s.seed, s.width, motion))
        heard = by_window["music"]
        music = self.music_linear(heard if s.music else torch.zeros_like(heard))
        music = self.music_encoder(music + positions(s.length, s.width, music))
        terms = torch.zeros_like(music)
        if s.key_pose_embedding:
            terms = terms + self.key_linear(by_window["key_poses"]) * by_window["is_key"]
        if s.local_positions:
            terms = terms + by_window["local_positions"]
        if s.ordinary_positions:
            terms = terms + positions(s.length, s.width, terms)
        if s.whole_music:
            if s.ordinary_positions:
                motion = motion + positions(s.seed, s.width, motion)
            tokens = torch.cat([motion, music + terms], 1)
        else:
            tokens = torch.cat([motion, music[:, s.seed :]], 1) + terms
        crossed = self.cross(tokens)[:, s.seed - s.length :]
        return self.output(crossed).flatten(0, 1)


def losses(said, batch, windows, root_weight=1.0, velocity_weight=0.0):
    """Eq. 14, the same without weights and, where it has a weight, the term of velocities, each a
    scalar by its name."""
    difference = batch["truth"] - said

    def of_frames(x):
        squares = x.square()
        if root_weight != 1:
            squares = torch.cat([squares[:, :-3], root_weight * squares[:, -3:]], 1)
        return squares.sum(-1)

    frames = len(difference)
    weighted = (batch["weights"][:, 0] * of_frames(difference)).sum() / frames
    terms = {"weighted": weighted, "plain": difference.square().sum() / frames, "total": weighted}
    if velocity_weight > 0:
        of_windows = difference.reshape(windows, frames // windows, -1)
        changes = of_windows.diff(dim=1, prepend=torch.zeros_like(of_windows[:, :1]))
        terms["velocity"] = of_frames(changes.flatten(0, 1)).sum() / frames
        terms["total"] = weighted + velocity_weight * terms["velocity"]
    return terms
