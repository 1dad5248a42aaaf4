"""Made-up windows and weights for the model of docs/li2023.md."""

import torch

from layout import PARENTS
from li2023 import Li2023, Setting

DANCE = tuple(PARENTS)


def made_up_batch(windows, frames, seed, joints=len(PARENTS), dtype=torch.float64):
    """Smooth rotations near those that are given, bones of some cm."""
    generator = torch.Generator().manual_seed(seed)

    def draw(*shape):
        return torch.randn(*shape, generator=generator, dtype=torch.float64)

    rows = windows * frames
    unit = torch.nn.functional.normalize
    given = unit(draw(windows, 1, joints, 4) + 0.2 * draw(windows, frames, joints, 4), dim=-1)
    truth = unit(given + 0.2 * draw(windows, frames, joints, 4), dim=-1)
    ends = torch.tensor([t in (0, frames - 1) for t in range(frames)]).repeat(windows)
    right = torch.rand(rows, generator=generator) < 0.5
    nearer = torch.tensor([min(t, frames - 1 - t) for t in range(frames)]).repeat(windows)
    offsets = 10 * draw(windows, 1, joints, 3).expand(windows, frames, joints, 3)
    batch = {
        "input": given.reshape(rows, -1),
        "keyframes": torch.stack([ends, ~ends], 1),
        "contacts": torch.stack([right, ~right], 1),
        "distances": nearer[:, None],
        "offsets": offsets.reshape(rows, -1),
        "truth.rotations": truth.reshape(rows, -1),
    }
    return {name: value.to(dtype).contiguous() for name, value in batch.items()}


def random_model(seed, dtype=torch.float64, **setting):
    """The plain model with every parameter away from its neutral value."""
    torch.manual_seed(seed)
    model = Li2023(Setting(parents=DANCE, **setting)).to(dtype)
    with torch.no_grad():
        for parameter in model.parameters():
            parameter += 0.05 * torch.randn_like(parameter)
    return model
