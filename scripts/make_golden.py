#!/usr/bin/env python3
"""Writes tests/golden/pan2021.safetensors: what the PyTorch reference makes of a small network.

    python scripts/make_golden.py

On random windows, for N = 12 and N = 6, fed with the truth and with its own predictions: the latter's
outputs, every loss term, every gradient, all f64.
Needs the packages of scripts/pytorch_reference/requirements.txt.
"""

import sys
from pathlib import Path

import torch
from safetensors.torch import save_file

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "scripts" / "pytorch_reference"))

from layout import CONTACTS, FEATURES
from losses import TERMS, losses
from reference import Sizes
from synthetic import random_model, raw_windows, statistics_of

# No two alike, so that one taken for another shows.
SIZES = Sizes(width=4, hidden=8, heads=2, feed_forward=6)


def main():
    torch.set_num_threads(1)  # sums in one order
    features = raw_windows(12, 2, torch.Generator().manual_seed(1))
    statistics = statistics_of(features)
    model = random_model(statistics, 2, dropout=0.0, sizes=SIZES)
    with torch.no_grad():  # contact labels below 0, within and above 1, so that the clamp acts
        model.state_decoder[4].bias[69:73] = torch.tensor([-1.3, -0.8, 0.8, 1.3])
    window = statistics.standardised(features, slice(0, FEATURES))  # [13, 2, 154]
    names = sorted(name for name, _ in model.named_parameters())
    tensors = {
        "feature_mean": statistics.mean,
        "feature_std": statistics.std,
        "position_scale": statistics.position_scale.reshape(1),
        "velocity_scale": statistics.velocity_scale.reshape(1),
        "window": window,
    }
    tensors |= {f"weight.{name}": model.get_parameter(name).detach() for name in names}
    for frames in (12, 6):
        for feed in ("own", "fed"):
            case = f"n{frames}_{feed}"
            model.zero_grad()
            cut = window[: frames + 1]
            outputs = model(cut, ground_truth_fed=feed == "fed")
            terms = losses(outputs, cut, statistics)
            terms["total"].backward()
            labels = statistics.raw(outputs[..., CONTACTS], CONTACTS)
            inside = ((labels > 0) & (labels < 1)).double().mean().item()
            print(case, {name: round(terms[name].item(), 3) for name in TERMS})
            print(f"  contact labels not clamped: {inside:.2f}")
            if feed == "own":
                tensors[f"{case}.outputs"] = outputs.detach()
            tensors[f"{case}.terms"] = torch.stack([terms[name] for name in TERMS]).detach()
            # One after the other, in the order of their names.
            gradients = [model.get_parameter(name).grad.flatten() for name in names]
            tensors[f"{case}.gradients"] = torch.cat(gradients)
    path = ROOT / "tests" / "golden" / "pan2021.safetensors"
    path.parent.mkdir(exist_ok=True)
    metadata = {"terms": " ".join(TERMS)}
    save_file({name: value.contiguous() for name, value in tensors.items()}, path, metadata)
    print(f"{path.relative_to(ROOT)}: {path.stat().st_size} bytes")


if __name__ == "__main__":
    main()
