"""The loss terms, eq. 3-11, from standardised predictions.

N frames predicted, B windows: outputs [N, B, 149], window [N + 1, B, 154] (frame 0 is k1).
"""

import torch

from layout import (
    BODY_POSITIONS,
    BODY_VELOCITIES,
    CONTACTS,
    FOOT_JOINTS,
    OUTPUTS,
    PARENTS,
    POSITIONS,
    VELOCITIES,
    VELOCITY_FACTORS,
    norm,
    standardised_factors,
)

KEY_FRAMES = 5  # m of eq. 10
TERMS = ["total", "rec", "bone", "contact", "velocity", "root", "key", "vfac"]


def bone_lengths(body):
    """body [..., 69], cm, relative to the root -> lengths of the 23 bones [..., 23], cm."""
    joints = body.unflatten(-1, (23, 3))
    joints = torch.cat([torch.zeros_like(joints[..., :1, :]), joints], -2)  # [..., 24, 3]
    return norm(joints[..., 1:, :] - joints[..., PARENTS[1:], :])


def key_weights(frames, like):
    """Eq. 10: weights [N, 1] of the N frames for k1 and for k2, the division in front included."""
    t = torch.arange(1, frames + 1, dtype=like.dtype)[:, None]
    if frames > 2 * KEY_FRAMES:
        first = (t <= KEY_FRAMES).to(like.dtype) / (2 * KEY_FRAMES)
        last = (t > frames - KEY_FRAMES).to(like.dtype) / (2 * KEY_FRAMES)
    else:
        first = (1 - t / frames) / frames
        last = (t / frames) / frames
    return first, last


def losses(outputs, window, statistics):
    """All terms of eq. 3 by name, each a scalar."""
    frames = outputs.shape[0]
    truth = window[1:, :, :OUTPUTS]
    before = torch.cat([window[:1, :, :OUTPUTS], outputs[:-1]])  # the frame before each, k1 true

    def square_sum(x):
        return x.square().sum(-1)  # over the numbers of a frame: [N, B]

    terms = {"rec": square_sum(outputs - truth).mean()}

    length = bone_lengths(statistics.raw(outputs[..., BODY_POSITIONS], BODY_POSITIONS))
    true_length = bone_lengths(statistics.raw(window[0, :, BODY_POSITIONS], BODY_POSITIONS))
    terms["bone"] = square_sum((length - true_length) / statistics.position_scale).mean()

    contacts = statistics.raw(outputs[..., CONTACTS], CONTACTS).clamp(0, 1)  # [N, B, 4]
    velocities = statistics.raw(outputs[..., BODY_VELOCITIES], BODY_VELOCITIES)
    feet = velocities.unflatten(-1, (23, 3))[..., [j - 1 for j in FOOT_JOINTS], :]
    terms["contact"] = (contacts * norm(feet) / statistics.velocity_scale).sum(-1).mean()

    # The mean cancels in the difference of positions.
    moved = (outputs[..., POSITIONS] - before[..., POSITIONS]) * statistics.std[POSITIONS]
    velocities = statistics.raw(outputs[..., VELOCITIES], VELOCITIES)
    terms["velocity"] = square_sum((velocities - moved) / statistics.velocity_scale).mean()

    root = slice(69, 73)  # p^r, o^r
    terms["root"] = square_sum(outputs[..., root] - before[..., root]).mean()

    first, last = key_weights(frames, outputs)
    positions = outputs[..., POSITIONS]
    to_first = square_sum(positions - window[0, :, POSITIONS])
    to_last = square_sum(positions - window[-1, :, POSITIONS])
    terms["key"] = (first * to_first + last * to_last).sum(0).mean()

    factors = standardised_factors(outputs[..., VELOCITIES], statistics)
    terms["vfac"] = square_sum(factors - window[1:, :, VELOCITY_FACTORS]).mean()

    consistency = terms["bone"] + terms["contact"] + terms["velocity"]
    terms["total"] = (
        0.3 * terms["rec"]
        + 0.2 * consistency
        + 0.15 * terms["root"]
        + 0.2 * terms["key"]
        + 0.15 * terms["vfac"]
    )
    return terms
