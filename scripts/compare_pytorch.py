#!/usr/bin/env python3
"""Compares keydance with a PyTorch version of its model: numbers, gradients and speed.

    compare_pytorch.py check --weights W.safetensors --batch B.safetensors
    compare_pytorch.py time [--keydance BINARY]
    compare_pytorch.py selftest

Needs the packages of scripts/pytorch_reference/requirements.txt.
"""

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent / "pytorch_reference"))

import checks  # noqa: E402
import timing  # noqa: E402


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    commands = parser.add_subparsers(dest="command", required=True)

    check = commands.add_parser("check", help="outputs, losses and gradients of one exported batch")
    check.add_argument("--weights", type=Path, required=True, help="safetensors checkpoint")
    check.add_argument(
        "--batch", type=Path, required=True, help="safetensors: window and our results"
    )
    check.add_argument(
        "--tolerance", type=float, default=1e-4, help="relative, of a tensor's largest"
    )

    time = commands.add_parser("time", help="training steps and generation, in turn")
    time.add_argument("--keydance", type=Path, help="binary to time in turn with PyTorch")
    time.add_argument("--frames", type=int, nargs="+", default=[5, 30, 60])
    time.add_argument("--batch", type=int, default=128)
    time.add_argument("--rounds", type=int, default=5, help="turns; the best of each counts")
    time.add_argument(
        "--others-up-to",
        type=int,
        default=30,
        help="most frames for the plain version and threaded products, which take the most memory",
    )

    commands.add_parser("selftest", help="plain against optimised version, random weights, f64")

    arguments = parser.parse_args()
    if arguments.command == "check":
        return checks.check(arguments.weights, arguments.batch, arguments.tolerance)
    if arguments.command == "selftest":
        return checks.selftest()
    return timing.time_all(arguments)


if __name__ == "__main__":
    sys.exit(main())
