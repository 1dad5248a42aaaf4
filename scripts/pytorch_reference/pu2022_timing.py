"""Training steps of the model of docs/pu2022.md: PyTorch plain and compiled, and keydance, in turn."""

import json
import platform
import shutil
import subprocess
import time
from functools import partial

import torch

from pu2022 import GIVEN, Pu2022, Setting, losses
from timing import SHARDED, in_turn, keep_memory, processor, report, seconds
from training import OneProcess, Shards

SETS = ["model.dropout=0"]


def made_up_batch(windows, setting, seed):
    """Numbers in place of poses and music, a key pose every 45 frames."""
    generator = torch.Generator().manual_seed(seed)

    def draw(rows, columns):
        return torch.randn(windows * rows, columns, generator=generator)

    s = setting
    numbers, generated = 6 * s.joints + 3, s.length - s.seed
    is_key = torch.tensor([float(t > s.seed and t % 45 == 0) for t in range(s.length)])
    is_key = is_key.repeat(windows)[:, None]
    return {
        "seed": draw(s.seed, numbers),
        "music": draw(s.length, s.music_numbers),
        "key_poses": draw(s.length, 6 * s.joints) * is_key,
        "is_key": is_key,
        "local_positions": draw(s.length, s.width),
        "weights": 1 + draw(generated, 1).abs(),
        "truth": draw(generated, numbers),
    }


def make(compiled, fuse, setting, _rank):
    """The model and its loss of a batch; all ranks make the same weights."""
    keep_memory()
    torch.manual_seed(0)
    model = Pu2022(setting)
    run = torch.compile(model) if compiled and fuse else model

    def loss(batch):
        windows = len(batch["music"]) // setting.length
        return losses(run(batch, windows), batch, windows)["total"]

    return model, loss


def split(batch, parts):
    """By windows, whose rows stand together."""
    chunks = {name: value.chunk(parts) for name, value in batch.items()}
    return [{name: chunks[name][k] for name in GIVEN} for k in range(parts)]


def keydance(arguments, setting):
    """Frame-steps a second."""
    threads = str(arguments.threads)
    command = [arguments.keydance, "bench-step", arguments.config]
    command += [part for pair in SETS for part in ("--set", pair)]
    command += ["--frames", str(setting.length), "--batch", str(arguments.batch)]
    command += ["--threads", threads, "--shards", threads, "--repetitions", "3", "--json"]
    process = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=False)
    if process.returncode != 0:
        raise SystemExit(f"{' '.join(map(str, command))} failed")
    return json.loads(process.stdout.strip().splitlines()[-1])["frame_steps_per_second"]


def time_all(arguments):
    keep_memory()
    fuse = shutil.which("c++") is not None
    setting, threads = Setting(length=arguments.frames[0]), arguments.threads
    print(
        f"{processor()}; {torch.backends.cpu.get_cpu_capability()}; Python "
        f"{platform.python_version()}, PyTorch {torch.__version__}, "
        f"{'fused with torch.compile' if fuse else 'no compiler: nothing fused'}"
    )
    torch.set_num_threads(threads)
    batch = made_up_batch(arguments.batch, setting, seed=1)
    trainers = {
        "plain": OneProcess(*make(False, False, setting, 0)),
        "compiled, threaded products": OneProcess(*make(True, fuse, setting, 0)),
    }
    if threads > 1:
        trainers[SHARDED] = Shards(partial(make, True, fuse, setting), split, threads, fuse)
    work, runs = arguments.batch * (setting.length - setting.seed), {}
    for name, trainer in trainers.items():
        start = time.perf_counter()
        trainer.step(batch)  # compiles, allocates
        print(f"  {name}: ready after {time.perf_counter() - start:.0f} s", flush=True)
        step = partial(trainer.step, batch)
        runs[name] = lambda step=step: work / min(seconds(step) for _ in range(3))
    if arguments.keydance:
        runs["keydance"] = lambda: keydance(arguments, setting)
    best = in_turn(runs, arguments.rounds)
    plural = "s" if threads > 1 else ""
    title = f"training step of pu2022, light, batch {arguments.batch}, {threads} thread{plural}"
    report(title, "frame-steps/s", best)
    if SHARDED in trainers:
        trainers[SHARDED].close()
    return 0
