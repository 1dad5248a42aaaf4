#!/usr/bin/env python3
"""Whether a trained run's controllers pass on what they are given. Needs the packages of scripts/pytorch_reference/requirements.txt.

    python scripts/study_controllers.py --keydance target/release/keydance --data DANCE runs/whole_model ...

Prints, over 128 windows of 30 frames of training clips, the norm of each code's mean and the root mean square of its distance from there. A code
that hardly moves tells the LSTM nothing, whatever it is given.
"""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

import torch
from safetensors.torch import load_file
from torch import nn

sys.path.insert(0, str(Path(__file__).resolve().parent / "pytorch_reference"))

from layout import BEFORE, ROOT_POSITION, SEGMENT, VELOCITY_FACTORS  # noqa: E402
from reference import Controller, Sizes  # noqa: E402

CONTROLLERS = {
    "root_trajectory_controller": ROOT_POSITION,
    "velocity_factor_controller": VELOCITY_FACTORS,
}


def codes(weights, window, name, columns):
    """[N * windows, width]: the codes where what was fed back is what was asked for."""
    weights = {key[len(name) + 1 :]: w for key, w in weights.items() if key.startswith(name + ".")}
    if not weights:
        return None
    given = window[..., columns].transpose(0, 1)  # [windows, N + 1, channels]
    last = given.shape[1] - 1
    around = [range(t + 1 - BEFORE, t + 1 - BEFORE + SEGMENT) for t in range(last)]
    segments = torch.cat([given[:, [min(max(i, 0), last) for i in frames]] for frames in around])
    if "0.weight" in weights:
        inputs, width = weights["0.weight"].shape[1], weights["2.weight"].shape[0]
        layers = nn.Sequential(
            nn.Linear(inputs, width), nn.PReLU(), nn.Linear(width, width), nn.PReLU()
        )
        layers.load_state_dict(weights)
        return layers(torch.cat([segments, segments], 1).flatten(1))
    controller = Controller(segments.shape[-1], 0.0, Sizes())
    controller.load_state_dict(weights)
    return controller.eval()(segments, segments)


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--keydance", required=True, help="the binary")
    parser.add_argument("--data", required=True, help="folder of the BVH files")
    parser.add_argument("runs", nargs="+", type=Path)
    arguments = parser.parse_args()
    print(f"{'run':<32}{'controller':<30}{'mean':>8}{'deviation':>12}")
    for run in arguments.runs:
        with tempfile.TemporaryDirectory() as folder:
            batch = f"{folder}/batch.safetensors"
            command = [arguments.keydance, "export-batch", run, "--data", arguments.data]
            subprocess.run([*command, "--windows", "128", "--out", batch], check=True)
            window = load_file(batch)["window"].float()
        weights = load_file(run / "weights.safetensors")
        for name, columns in CONTROLLERS.items():
            with torch.no_grad():
                code = codes(weights, window, name, columns)
            if code is not None:
                mean = code.mean(0)
                deviation = (code - mean).square().sum(1).mean().sqrt()
                print(f"{run.name:<32}{name:<30}{mean.norm():8.2f}{deviation:12.4f}")


if __name__ == "__main__":
    main()
