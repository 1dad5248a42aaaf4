"""Random weights and random smooth windows, for checks that need no data."""

import torch

from layout import (
    BODY_POSITIONS,
    BODY_VELOCITIES,
    CONTACTS,
    FEATURES,
    JOINTS,
    PARENTS,
    VELOCITIES,
    VELOCITY_FACTORS,
    Statistics,
    velocity_factors,
)
from reference import Pan2021


def raw_windows(frames, windows, generator):
    """Features of a made-up dancer, [frames + 1, windows, 154], f64, cm and rad."""

    def draw(*shape):
        return torch.randn(*shape, dtype=torch.float64, generator=generator)

    def smooth(numbers, size):
        """[frames + 2, windows, numbers]: three waves of random amplitude, period and phase."""
        t = torch.arange(frames + 2, dtype=torch.float64)[:, None, None]
        waves = [
            draw(windows, numbers)
            * torch.sin(
                t * (0.05 + 0.15 * draw(windows, numbers).abs()) + 3 * draw(windows, numbers)
            )
            for _ in range(3)
        ]
        return size * sum(waves)

    bones = 12 * draw(JOINTS, 3)
    rest = torch.zeros(JOINTS, 3, dtype=torch.float64)
    for joint in range(1, JOINTS):
        rest[joint] = rest[PARENTS[joint]] + bones[joint]
    body = rest[1:].flatten() + smooth(69, 4.0)
    root = torch.tensor([0.0, 90.0, 0.0], dtype=torch.float64) + smooth(3, 15.0)
    positions = torch.cat([body, root], -1)  # [frames + 2, windows, 72]

    features = torch.zeros(frames + 1, windows, FEATURES, dtype=torch.float64)
    features[..., 0:72] = positions[1:]
    features[..., 72:73] = smooth(1, 0.8)[1:]
    features[..., CONTACTS] = (smooth(4, 1.0)[1:] > 0).to(torch.float64)
    features[..., VELOCITIES] = positions[1:] - positions[:-1]
    features[..., VELOCITY_FACTORS] = velocity_factors(features[..., VELOCITIES])
    return features


def statistics_of(features):
    std, mean = torch.std_mean(features.flatten(0, -2), 0, correction=0)
    return Statistics(
        mean=mean,
        std=std,
        position_scale=std[BODY_POSITIONS].square().mean().sqrt(),
        velocity_scale=std[BODY_VELOCITIES].square().mean().sqrt(),
    )


def windows_and_statistics(frames, windows, seed):
    """Standardised windows [frames + 1, windows, 154], f64, and their statistics."""
    generator = torch.Generator().manual_seed(seed)
    features = raw_windows(frames, windows, generator)
    statistics = statistics_of(features)
    return statistics.standardised(features, slice(0, FEATURES)), statistics


def random_model(statistics, seed, dropout=0.1):
    """The reference model, f64, with every parameter away from its neutral value."""
    generator = torch.Generator().manual_seed(seed)
    model = Pan2021(statistics, dropout).double()
    with torch.no_grad():
        for name, parameter in model.named_parameters():
            noise = torch.rand(parameter.shape, dtype=torch.float64, generator=generator) * 2 - 1
            if parameter.dim() == 2:
                parameter.copy_(noise * (2.5 / parameter.shape[1] ** 0.5))
            elif "norm" in name and name.endswith("weight"):
                parameter.copy_(1 + 0.3 * noise)
            elif parameter.shape == (1,):  # a slope of PReLU
                parameter.copy_(0.25 + 0.1 * noise)
            else:
                parameter.copy_(0.1 * noise)
    return model
