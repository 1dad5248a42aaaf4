"""Agreement of outputs, loss terms and gradients: keydance against PyTorch, plain against optimised."""

import json
import math
import sys
import tomllib

import torch
from safetensors import safe_open
from safetensors.torch import load_file

from layout import FEATURES, OUTPUTS, Statistics
from losses import TERMS, losses
from optimised import Optimised
from reference import Pan2021
from synthetic import random_model, windows_and_statistics

SELFTEST_TOLERANCE = 1e-9
TINY = 1e-12
JUDGED = ["outputs"] + [f"loss.{name}" for name in TERMS]


def results(run, model, window, ground_truth_fed):
    """Outputs, losses and gradients, by the names of an exported batch."""
    model.zero_grad(set_to_none=True)
    outputs = run(window, ground_truth_fed)
    terms = losses(outputs, window, model.statistics)
    terms["total"].backward()
    found = {"outputs": outputs.detach()}
    found |= {f"loss.{name}": terms[name].detach().reshape(1) for name in TERMS}
    found |= {f"gradient.{name}": p.grad.clone() for name, p in model.named_parameters()}
    return found


def difference(ours, theirs):
    """max |ours - theirs| over the largest of theirs; infinity where a number is not finite."""
    ours, theirs = ours.double(), theirs.double()
    found = ((ours - theirs).abs().max() / theirs.abs().max().clamp(min=TINY)).item()
    return float("inf") if math.isnan(found) else found


def compare(title, ours, theirs, tolerance, names=JUDGED):
    """Prints a table of the differences; returns the number of entries beyond the tolerance."""
    print(f"\n{title} (relative, tolerance {tolerance:g})")
    gradients = {n: difference(ours[n], theirs[n]) for n in theirs if n.startswith("gradient.")}
    for name in names:
        value = f"{theirs[name].item():14.6g}" if name.startswith("loss.") else " " * 14
        found = difference(ours[name], theirs[name])
        print(f"  {name:<16} {value}  {found:9.2e} {'ok' if found <= tolerance else 'DIFFERS'}")
    worst = max(gradients, key=gradients.get)
    print(f"  {len(gradients)} gradients, worst       {gradients[worst]:9.2e} ({worst})")
    for name, found in gradients.items():
        if not found <= tolerance:
            print(f"  {name:<31} {found:9.2e} DIFFERS")
    beyond = [n for n in names if not difference(ours[n], theirs[n]) <= tolerance]
    return len(beyond) + sum(not found <= tolerance for found in gradients.values())


def load_model(path, dtype):
    """The reference model with a checkpoint's weights and statistics, dropout off."""
    refuse_other_outputs(path)
    entries = load_file(path)
    missing = {"feature_mean", "feature_std", "position_scale", "velocity_scale"} - entries.keys()
    if missing:
        raise SystemExit(f"{path}: no entry {', '.join(sorted(missing))}")
    statistics = Statistics(
        mean=entries.pop("feature_mean").flatten(),
        std=entries.pop("feature_std").flatten(),
        position_scale=entries.pop("position_scale").reshape(()),
        velocity_scale=entries.pop("velocity_scale").reshape(()),
    ).to(dtype)
    if statistics.mean.shape != (FEATURES,) or statistics.std.shape != (FEATURES,):
        raise SystemExit(f"{path}: feature_mean and feature_std must have {FEATURES} numbers")
    model = Pan2021(statistics, dropout=0.0).to(dtype)
    try:
        model.load_state_dict(entries)
    except RuntimeError as error:
        raise SystemExit(f"{path}: {error}") from None
    return model.eval()


def config_of(path):
    """The config that a run's weights were written with; empty where there is none."""
    with safe_open(path, "pt") as file:
        written = (file.metadata() or {}).get("keydance")
    return tomllib.loads(json.loads(written)["config"]) if written else {}


def refuse_other_outputs(path):
    """The reference has the paper's network only; what `root_frame` changes is in statistics and batch."""
    output = config_of(path).get("model", {}).get("output", "absolute")
    if output != "absolute":
        raise SystemExit(f"{path}: model.output = {output}: the PyTorch version has absolute only")


def load_batch(path, parameters):
    """An exported batch; every entry is there and has the shape that it should have."""
    batch = load_file(path)
    window = batch.get("window")
    if window is None or window.dim() != 3 or window.shape[2] != FEATURES:
        raise SystemExit(f"{path}: no entry `window` of shape [N + 1, B, {FEATURES}]")
    shapes = {"outputs": (window.shape[0] - 1, window.shape[1], OUTPUTS), "ground_truth_fed": (1,)}
    shapes |= {f"loss.{name}": (1,) for name in TERMS}
    shapes |= {f"gradient.{name}": tuple(p.shape) for name, p in parameters}
    for name, shape in shapes.items():
        if name not in batch:
            raise SystemExit(f"{path}: no entry `{name}`")
        if tuple(batch[name].shape) != shape:
            raise SystemExit(f"{path}: `{name}` is {list(batch[name].shape)}, not {list(shape)}")
    return batch


def check(weights, batch_path, tolerance):
    """keydance's results against both PyTorch versions in f64; 0 if all agree.

    The reference is f64 so that PyTorch's rounding stays out of the comparison; what f32 costs PyTorch
    itself is printed beside it, and not judged.
    """
    disagreements = 0
    found = {}
    for name, dtype in (
        ("plain", torch.float64),
        ("optimised", torch.float64),
        ("optimised, f32", torch.float32),
    ):
        model = load_model(weights, dtype)
        batch = load_batch(batch_path, model.named_parameters())
        fed = bool(batch["ground_truth_fed"].item())
        window = batch["window"].to(dtype)
        found[name] = results(model if name == "plain" else Optimised(model), model, window, fed)
    print(
        f"{window.shape[1]} windows of {window.shape[0] - 1} frames, "
        + ("ground truth fed" if fed else "own predictions fed")
    )
    for name in ("plain", "optimised"):
        title = f"keydance against PyTorch, {name}, f64"
        disagreements += compare(title, batch, found[name], tolerance)
    title = "for scale: PyTorch, optimised, f32 against PyTorch, plain, f64"
    compare(title, found["optimised, f32"], found["plain"], tolerance)
    if disagreements:
        print(f"\n{disagreements} entries differ by more than {tolerance:g}", file=sys.stderr)
        return 1
    print("\nkeydance agrees with PyTorch")
    return 0


def selftest():
    """The optimised version against the plain one in f64; 0 if all agree."""
    disagreements = 0
    for frames, fed, chunk in ((12, False, None), (8, False, 3), (12, True, 5), (1, False, 1)):
        window, statistics = windows_and_statistics(12, 4, seed=frames)
        window = window[: frames + 1]
        model = random_model(statistics, seed=3, dropout=0.0).eval()
        plain = results(model, model, window, fed)
        optimised = results(Optimised(model, chunk=chunk), model, window, fed)
        title = f"optimised against plain: {frames} frames, {'ground truth' if fed else 'own predictions'} fed"
        disagreements += compare(title, optimised, plain, SELFTEST_TOLERANCE)
    return 1 if disagreements else 0
