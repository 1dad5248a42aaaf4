#!/usr/bin/env python3
"""Compares keydance with a PyTorch version of its model: numbers, gradients and speed.

    compare_pytorch.py check --weights W.safetensors --batch B.safetensors
    compare_pytorch.py time [--keydance BINARY]
        [--model pan2021 | li2023 | pu2022 | valleperez2021 | moglow2020]
    compare_pytorch.py selftest

Needs the packages of scripts/pytorch_reference/requirements.txt.
"""

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent / "pytorch_reference"))

import checks  # noqa: E402
import li2023_checks  # noqa: E402
import li2023_timing  # noqa: E402
import moglow2020_checks  # noqa: E402
import moglow2020_timing  # noqa: E402
import pu2022_checks  # noqa: E402
import pu2022_timing  # noqa: E402
import timing  # noqa: E402
import valleperez2021_checks  # noqa: E402
import valleperez2021_timing  # noqa: E402

SIZES = {"pan2021": ([5, 30, 60], 128), "li2023": ([50], 12), "pu2022": ([240], 20)}
FLOWS = {"valleperez2021": valleperez2021_timing, "moglow2020": moglow2020_timing}
EXPERIMENTS = Path(__file__).resolve().parent.parent / "experiments"
CHECKS = {
    "li2023": li2023_checks,
    "pu2022": pu2022_checks,
    "valleperez2021": valleperez2021_checks,
    "moglow2020": moglow2020_checks,
}
CONFIGS = {
    "li2023": "li2023/ours.toml",
    "pu2022": "pu2022/larger.toml",
    "valleperez2021": "valleperez2021/transflower.toml",
    "moglow2020": "valleperez2021/moglow.toml",
}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    commands = parser.add_subparsers(dest="command", required=True)

    check = commands.add_parser("check", help="outputs, losses and gradients of one exported batch")
    check.add_argument("--weights", type=Path, required=True, help="safetensors checkpoint")
    check.add_argument(
        "--batch", type=Path, required=True, help="safetensors: window and our results"
    )
    check.add_argument(
        "--tolerance",
        type=float,
        help="relative, of a tensor's largest [default: 1e-4; 1e-9 for a batch in f64]",
    )

    time = commands.add_parser("time", help="training steps and generation, in turn")
    time.add_argument("--model", choices=[*SIZES, *FLOWS], default="pan2021")
    time.add_argument("--config", type=Path, help="all but pan2021: of keydance's step")
    time.add_argument(
        "--sizes",
        choices=["two_cores", "paper"],
        help="valleperez2021, moglow2020: of the budget for two cores or the paper's [default: both]",
    )
    time.add_argument("--keydance", type=Path, help="binary to time in turn with PyTorch")
    time.add_argument("--frames", type=int, nargs="+", help="pan2021: 5 30 60; li2023: 50; pu2022: 240")
    time.add_argument(
        "--batch",
        type=int,
        help="windows; pan2021: 128, li2023: 12, pu2022: 20; on two cores and in the paper's sizes "
        "valleperez2021: 32 and 4, moglow2020: 16 and 4",
    )
    time.add_argument("--threads", type=int, default=2, help="all but pan2021: and processes")
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
        return check_kind(arguments.weights, arguments.batch, arguments.tolerance)
    if arguments.command == "selftest":
        kinds = (checks, li2023_checks, valleperez2021_checks)
        return 1 if sum(kind.selftest() for kind in kinds) else 0
    if arguments.model in CONFIGS:
        arguments.config = arguments.config or EXPERIMENTS / CONFIGS[arguments.model]
    if arguments.model in FLOWS:
        return FLOWS[arguments.model].time_all(arguments)
    frames, batch = SIZES[arguments.model]
    arguments.frames = arguments.frames or frames
    arguments.batch = arguments.batch or batch
    chosen = {"pan2021": timing, "li2023": li2023_timing, "pu2022": pu2022_timing}
    return chosen[arguments.model].time_all(arguments)


def check_kind(weights, batch, tolerance):
    """By the kind of model that the weights are of."""
    config = checks.config_of(weights)
    kind = config.get("model", {}).get("kind", "pan2021")
    if kind in CHECKS:
        return CHECKS[kind].check(weights, config, batch, tolerance)
    if kind == "pan2021":
        return checks.check(weights, batch, tolerance or 1e-4)
    raise SystemExit(f"{weights}: there is no PyTorch version of {kind}")


if __name__ == "__main__":
    sys.exit(main())
