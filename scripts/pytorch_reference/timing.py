"""Training steps, generation and single layers: PyTorch plain and optimised, and keydance, timed in turn."""

import ctypes
import json
import platform
import resource
import shutil
import subprocess
import time
from functools import partial

import torch

import optimised
from layout import Statistics
from losses import losses
from reference import Pan2021
from synthetic import windows_and_statistics
from training import OneProcess, Shards

DROPOUT = 0.1
THREADS = 2
CHUNK = 1  # frames that the encoder takes at once in training; more does not fit the caches
SHARDED = "optimised, two processes"
GENERATED = 60  # frames of a generated transition


def keep_memory():
    """Makes glibc keep freed memory: fresh pages for every large tensor cost as much as filling it."""
    if platform.libc_ver()[0] != "glibc":
        return
    libc = ctypes.CDLL(None)
    m_trim_threshold, m_mmap_max = -1, -4
    libc.mallopt(m_mmap_max, 0)
    libc.mallopt(m_trim_threshold, 2**31 - 1)


def make(name, fuse, dropout, rank):
    """The model and the callable to run it; `rank` makes the dropout of the shards differ."""
    keep_memory()
    torch.manual_seed(0)
    statistics = Statistics(torch.zeros(154), torch.ones(154), torch.tensor(1.0), torch.tensor(1.0))
    model = Pan2021(statistics, dropout)
    if name == "plain":
        return model, model
    return model, optimised.Optimised(model, dropout, optimised.Functions(fuse), CHUNK, seed=rank)


def make_training(name, fuse, dropout, rank):
    """The model and its loss of a window."""
    model, run = make(name, fuse, dropout, rank)
    return model, lambda window: losses(run(window), window, model.statistics)["total"]


def split(window, parts):
    return [part.contiguous() for part in window.chunk(parts, 1)]


def windows(frames, count):
    return windows_and_statistics(frames, count, seed=frames)[0].float()


def seconds(run):
    start = time.perf_counter()
    run()
    return time.perf_counter() - start


def keydance(binary, *arguments):
    """The JSON line that a benchmark of the binary prints last."""
    command = [binary, *map(str, arguments), "--json"]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(map(str, command))} failed:\n{done.stderr}")
    return json.loads(done.stdout.strip().splitlines()[-1])


def in_turn(runs, rounds):
    """Times each of `runs` (name -> function returning a speed) in turn; the best of each."""
    best = {}
    for _ in range(rounds):
        for name, run in runs.items():
            best[name] = max(best.get(name, 0.0), run())
    return best


def report(title, unit, best):
    print(f"\n{title}, {unit}")
    for name, speed in best.items():
        print(f"  {name:<34} {speed:10.1f}", flush=True)
    if "keydance" in best:
        others = {n: s for n, s in best.items() if n != "keydance"}
        name = max(others, key=others.get)
        print(f"  keydance / {name}: {best['keydance'] / others[name]:.2f}")


def time_training(arguments, trainers):
    for frames in arguments.frames:
        window = windows(frames, arguments.batch)
        work = frames * arguments.batch
        runs = {}
        for name, trainer in trainers.items():
            if name == SHARDED or frames <= arguments.others_up_to:
                trainer.step(window)  # compiles, allocates
                runs[name] = partial(lambda t: work / seconds(lambda: t.step(window)), trainer)
        if arguments.keydance:
            options = ["--frames", frames, "--batch", arguments.batch, "--threads", THREADS]
            runs["keydance"] = lambda: keydance(arguments.keydance, "bench-step", *options)[
                "frame_steps_per_second"
            ]
        title = f"training step, {frames} frames, batch {arguments.batch}, {THREADS} threads"
        report(title, "frame-steps/s", in_turn(runs, arguments.rounds))


def time_generation(arguments, fuse, count, threads):
    torch.set_num_threads(threads)
    window = windows(GENERATED, count)
    runs = {}
    for name, fused in (("plain", False), ("optimised", False), ("optimised, fused", True)):
        if fused and not fuse:
            continue
        model, run = make(name, fused, 0.0, rank=0)
        model.eval()
        if name != "plain":
            run.chunk = None if count == 1 else CHUNK
        with torch.inference_mode():
            run(window)

        def speed(run=run):
            with torch.inference_mode():
                return GENERATED * count / seconds(lambda: run(window))

        runs[name] = speed
    if arguments.keydance:
        options = ["--batch", count, "--threads", threads]
        runs["keydance"] = lambda: keydance(arguments.keydance, "bench-generate", *options)[
            "frames_per_second"
        ]
    best = in_turn(runs, arguments.rounds)
    title = f"generation of {GENERATED} frames, batch {count}, {threads} thread{'s'[: threads - 1]}"
    report(title, "frames/s", best)
    if count == 1:
        print("  ms a frame: " + ", ".join(f"{n} {1e3 / s:.2f}" for n, s in best.items()))


class LstmAndLinear(torch.nn.Module):
    """The model's first LSTM and a linear layer, on whole sequences."""

    def __init__(self):
        super().__init__()
        self.lstm = torch.nn.LSTM(1024, 256)
        self.head = torch.nn.Linear(256, 142)

    def forward(self, x):
        return self.head(self.lstm(x)[0])


def encoder_layers():
    layer = partial(torch.nn.TransformerEncoderLayer, 256, 8, 256, DROPOUT, batch_first=True)
    return torch.nn.Sequential(layer(), layer())


def time_layers(arguments):
    """Forward, a sum of squares, backward: milliseconds, the best of some steps each turn."""
    torch.set_num_threads(THREADS)
    cases = {
        "lstm_ms": (
            "LSTM 1024 -> 256 and linear, 128 x 30",
            LstmAndLinear(),
            torch.randn(30, 128, 1024),
        ),
        "encoder_layers_ms": (
            "two encoder layers, 128 windows of 7",
            encoder_layers(),
            torch.randn(128, 7, 256, requires_grad=True),
        ),
    }
    for key, (title, module, x) in cases.items():

        def step(module=module, x=x):
            module.zero_grad()
            x.grad = None
            module(x).square().sum().backward()

        step()
        runs = {"PyTorch": lambda: min(1e3 * seconds(step) for _ in range(5))}
        if arguments.keydance:
            options = ["--threads", THREADS]
            runs["keydance"] = lambda: keydance(arguments.keydance, "bench-layers", *options)[key]
        best = {name: float("inf") for name in runs}
        for _ in range(arguments.rounds):
            for name, run in runs.items():
                best[name] = min(best[name], run())
        print(f"\n{title}, forward and backward, {THREADS} threads, ms")
        for name, time_taken in best.items():
            print(f"  {name:<34} {time_taken:10.1f}", flush=True)
        if "keydance" in best:
            print(f"  PyTorch / keydance: {best['PyTorch'] / best['keydance']:.2f}")


def processor():
    try:
        with open("/proc/cpuinfo") as lines:
            names = [
                line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")
            ]
        return f"{names[0]}, {len(names)} cores"
    except (OSError, IndexError):
        return platform.processor() or platform.machine()


def time_all(arguments):
    keep_memory()
    fuse = shutil.which("c++") is not None
    print(
        f"{processor()}; {torch.backends.cpu.get_cpu_capability()}; Python {platform.python_version()}, "
        f"PyTorch {torch.__version__}, {'fused with torch.compile' if fuse else 'no compiler: nothing fused'}"
    )
    print(
        f"best of {arguments.rounds} turns; own predictions fed, dropout {DROPOUT} in training, f32"
    )
    torch.set_num_threads(THREADS)
    trainers = {
        "plain": OneProcess(*make_training("plain", False, DROPOUT, rank=0)),
        "optimised, threaded products": OneProcess(
            *make_training("optimised", fuse, DROPOUT, rank=0)
        ),
        SHARDED: Shards(
            partial(make_training, "optimised", fuse, DROPOUT), split, THREADS, fuse
        ),
    }
    time_training(arguments, trainers)
    trainers[SHARDED].close()
    for count, threads in ((1, 1), (64, THREADS)):
        time_generation(arguments, fuse, count, threads)
    time_layers(arguments)
    children = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 2**20
    print(
        f"\nmost memory: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20:.1f} GiB in this process, "
        f"{children:.1f} GiB in the largest other"
    )
    return 0
