"""Training steps of the flows of docs/valleperez2021.md: PyTorch plain and compiled, and keydance, in turn."""

import json
import platform
import shutil
import subprocess
import time
import tomllib
from functools import partial
from pathlib import Path

import torch

from timing import in_turn, keep_memory, processor, report, seconds
from training import OneProcess, Shards

EXPERIMENTS = Path(__file__).resolve().parents[2] / "experiments"
BUDGET = EXPERIMENTS / "budgets" / "valleperez2021_one_core.toml"
STEPS = 3  # of a turn; the fastest counts


def budget(row=None):
    """Sizes of a model on two cores, by the keys of `[model]`."""
    table = tomllib.loads(BUDGET.read_text())
    return table["rows"][row]["model"] if row else table["model"]


def keydance(arguments, sizes, frames, batch):
    """Frame-steps a second."""
    threads = str(arguments.threads)
    command = [arguments.keydance, "bench-step", arguments.config]
    for key, value in sizes.items():
        command += ["--set", f"model.{key}={value}"]
    command += ["--frames", str(frames), "--batch", str(batch), "--threads", threads]
    command += ["--shards", threads]
    command += ["--repetitions", str(STEPS), "--json"]
    process = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=False)
    if process.returncode != 0:
        raise SystemExit(f"{' '.join(map(str, command))} failed")
    return json.loads(process.stdout.strip().splitlines()[-1])["frame_steps_per_second"]


def time_sizes(arguments, kind, title, sizes, batch_size):
    """Trains `kind` (a module with `made_up_batch`, `make` and `split`) in these sizes."""
    torch.compiler.reset()  # functions of other sizes
    fuse = shutil.which("c++") is not None
    threads, batch_size = arguments.threads, arguments.batch or batch_size
    batch, frames = kind.made_up_batch(batch_size, sizes)
    # Beside the others the plain version of large sizes would not fit the memory.
    versions = {"optimised": True} if title in kind.LARGE else {"plain": False, "optimised": True}
    trainers = {
        f"{name}, threaded products": OneProcess(*kind.make(sizes, fast, fuse))
        for name, fast in versions.items()
    }
    shards = {
        f"{name}, processes": Shards(
            partial(kind.make, sizes, fast, fuse), partial(kind.split, sizes), threads, fuse
        )
        for name, fast in versions.items()
        if threads > 1
    }
    trainers |= shards
    work, runs = batch_size * frames, {}
    for name, trainer in trainers.items():
        start = time.perf_counter()
        trainer.step(batch)  # compiles, allocates
        print(f"  {name}: ready after {time.perf_counter() - start:.0f} s", flush=True)
        step = partial(trainer.step, batch)
        runs[name] = lambda step=step: work / min(seconds(step) for _ in range(STEPS))
    if arguments.keydance:
        runs["keydance"] = lambda: keydance(arguments, sizes, frames, batch_size)
    best = in_turn(runs, arguments.rounds)
    for trainer in shards.values():
        trainer.close()
    plural = "s" if threads > 1 else ""
    title = f"{arguments.model}, {title}, {frames} frames, batch {batch_size}, {threads} thread{plural}"
    report(f"training step of {title}", "frame-steps/s", best)


def time_all(arguments, kind):
    keep_memory()
    torch.set_num_threads(arguments.threads)
    load = Path("/proc/loadavg")
    print(
        f"{processor()}; {torch.backends.cpu.get_cpu_capability()}; Python "
        f"{platform.python_version()}, PyTorch {torch.__version__}"
        + (f"; load {load.read_text().split()[0]} before" if load.exists() else "")
    )
    for title, (sizes, batch) in kind.SIZES.items():
        if arguments.sizes in (None, title):
            time_sizes(arguments, kind, title, sizes, batch)
    return 0
