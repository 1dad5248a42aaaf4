"""Training steps of the model of docs/li2023.md: PyTorch plain and optimised, and keydance, in turn."""

import json
import os
import platform
import resource
import shutil
import subprocess
import time
from functools import partial

import torch

from li2023 import Optimised, Plain
from li2023_synthetic import made_up_batch, random_model
from timing import SHARDED, in_turn, keep_memory, processor, report, seconds
from training import OneProcess, Shards

FLOP = 121e6  # of a frame, forwards and backwards, c = 32 and 24 joints
SETS = ["model.width=32", "model.stochastic_depth=0"]


def make(name, fuse, frames, _rank):
    """The model and its loss of a batch; all ranks make the same weights."""
    keep_memory()
    model = random_model(seed=0, dtype=torch.float32)
    run = Plain(model) if name == "plain" else Optimised(model, fuse)
    return model, lambda batch: run(batch, len(batch["input"]) // frames)[2]["total"]


def split(batch, parts):
    """By windows, whose rows stand together."""
    chunks = {name: value.chunk(parts) for name, value in batch.items()}
    return [{name: chunk[k] for name, chunk in chunks.items()} for k in range(parts)]


def keydance(arguments, memory):
    """Frame-steps a second; `memory` gets the most that the process held, GiB."""
    sets = [part for pair in SETS for part in ("--set", pair)]
    threads = str(arguments.threads)
    command = [arguments.keydance, "bench-step", arguments.config, *sets, "--json"]
    command += ["--frames", str(arguments.frames[0]), "--batch", str(arguments.batch)]
    command += ["--threads", threads, "--shards", threads, "--repetitions", "5"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    output = process.stdout.read()
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode != 0:
        raise SystemExit(f"{' '.join(map(str, command))} failed")
    memory.append(usage.ru_maxrss / 2**20)
    return json.loads(output.strip().splitlines()[-1])["frame_steps_per_second"]


def product_speed():
    """FLOP/s of a large product: what the cores give at best."""
    a = torch.randn(2048, 2048)
    b = torch.randn(2048, 2048)
    return 2 * 2048**3 / min(seconds(lambda: a @ b) for _ in range(5))


def time_all(arguments):
    keep_memory()
    fuse = shutil.which("c++") is not None
    frames, count, threads = arguments.frames[0], arguments.batch, arguments.threads
    print(
        f"{processor()}; {torch.backends.cpu.get_cpu_capability()}; Python "
        f"{platform.python_version()}, PyTorch {torch.__version__}, "
        f"{'fused with torch.compile' if fuse else 'no compiler: nothing fused'}"
    )
    torch.set_num_threads(threads)
    batch = made_up_batch(count, frames, seed=1, dtype=torch.float32)
    trainers = {
        "plain": OneProcess(*make("plain", False, frames, 0)),
        "optimised, threaded products": OneProcess(*make("optimised", fuse, frames, 0)),
    }
    if threads > 1:
        trainers[SHARDED] = Shards(
            partial(make, "optimised", fuse, frames), split, threads, fuse
        )
    work, memory, runs = frames * count, [], {}
    for name, trainer in trainers.items():
        start = time.perf_counter()
        trainer.step(batch)  # compiles, allocates
        print(f"  {name}: ready after {time.perf_counter() - start:.0f} s", flush=True)
        step = partial(trainer.step, batch)
        runs[name] = lambda step=step: work / min(seconds(step) for _ in range(5))
    if arguments.keydance:
        runs["keydance"] = lambda: keydance(arguments, memory)
    runs["product"] = lambda: product_speed() / FLOP
    best = in_turn(runs, arguments.rounds)
    peak = best.pop("product") * FLOP
    plural = "s" if threads > 1 else ""
    title = f"training step of li2023, c = 32, {frames} frames, batch {count}, {threads} thread{plural}"
    report(title, "frame-steps/s", best)
    print(f"  a product of 2048 x 2048 has {peak / 1e9:.0f} GFLOP/s; of these")
    for name, speed in best.items():
        print(f"  {name:<34} {100 * speed * FLOP / peak:9.0f} %")
    own = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    print(f"most memory: PyTorch {own:.1f} GiB in this process", end="")
    print(f", keydance {max(memory):.2f} GiB" if memory else "")
    if SHARDED in trainers:
        trainers[SHARDED].close()
    return 0
