"""The numbers of a frame, the skeleton and the velocity factors, as docs/pan2021.md states them."""

from dataclasses import dataclass

import torch

FEATURES = 154  # p^b, p^r, o^r, c, v^b, v^r, f
OUTPUTS = 149  # what the network predicts: all but f
BODY_POSITIONS = slice(0, 69)  # p^b
ROOT_POSITION = slice(69, 72)  # p^r
FACING = slice(72, 73)  # o^r
CONTACTS = slice(73, 77)  # c
BODY_VELOCITIES = slice(77, 146)  # v^b
ROOT_VELOCITY = slice(146, 149)  # v^r
VELOCITY_FACTORS = slice(149, 154)  # f

STATE = slice(0, 77)  # p^b, p^r, o^r, c
POSITIONS = slice(0, 72)  # p^b, p^r
VELOCITIES = slice(77, 149)  # v^b, v^r
TARGET = slice(0, 73)  # p^b, p^r, o^r of the keyframe k2

SEGMENT = 7  # u, frames of a controller's segment
BEFORE = 3  # frames of a segment before its centre
WIDTH = 256  # of every code, LSTM and Transformer
HEADS = 8

JOINTS = 24
PARENTS = [-1, 0, 1, 2, 3, 0, 5, 6, 7, 0, 9, 10, 11, 12, 13, 14, 15, 16, 13, 18, 19, 20, 13, 22]
FOOT_JOINTS = [3, 4, 7, 8]  # left foot, left toe base, right foot, right toe base

# Weights of eq. 1, part by part: joint -> weight.
PARTS = [
    {0: 1, 9: 1, 10: 1, 11: 1, 12: 1, 13: 1, 22: 1, 23: 2},  # trunk
    {1: 1, 2: 2, 3: 3, 4: 4},  # left leg
    {5: 1, 6: 2, 7: 3, 8: 4},  # right leg
    {14: 1, 15: 2, 16: 3, 17: 4},  # right arm
    {18: 1, 19: 2, 20: 3, 21: 4},  # left arm
]

NORM_EPSILON = 1e-8


@dataclass
class Statistics:
    """What the features were standardised with; cm, cm/frame and rad."""

    mean: torch.Tensor  # [154]
    std: torch.Tensor  # [154]
    position_scale: torch.Tensor  # scalar, s_p
    velocity_scale: torch.Tensor  # scalar, s_v

    def to(self, dtype):
        return Statistics(
            self.mean.to(dtype),
            self.std.to(dtype),
            self.position_scale.to(dtype),
            self.velocity_scale.to(dtype),
        )

    def raw(self, z, part):
        """De-standardised `part` (a slice of the frame's numbers), given its standardised values."""
        return z * self.std[part] + self.mean[part]

    def standardised(self, x, part):
        return (x - self.mean[part]) / self.std[part]


def part_weights(dtype):
    """[24, 5]: the weight of each joint in each part over the part's sum of weights."""
    weights = torch.zeros(JOINTS, len(PARTS), dtype=dtype)
    for part, joints in enumerate(PARTS):
        for joint, weight in joints.items():
            weights[joint, part] = weight / sum(joints.values())
    return weights


def norm(x):
    """Norm over the last axis, smooth at 0."""
    return (x.square().sum(-1) + NORM_EPSILON).sqrt()


def velocity_factors(velocities):
    """Eq. 1. velocities [..., 72] (23 joints, then the root) in cm/frame -> [..., 5]."""
    speed = norm(velocities.unflatten(-1, (JOINTS, 3)))  # [..., 24], the root last
    speed = torch.cat([speed[..., -1:], speed[..., :-1]], -1)  # the root first
    return speed @ part_weights(velocities.dtype)


def standardised_factors(z_velocities, statistics):
    """z(f) [..., 5] of standardised velocities [..., 72]."""
    factors = velocity_factors(statistics.raw(z_velocities, VELOCITIES))
    return statistics.standardised(factors, VELOCITY_FACTORS)
