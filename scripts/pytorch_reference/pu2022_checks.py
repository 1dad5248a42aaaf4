"""Agreement of outputs, losses and gradients of the model of docs/pu2022.md."""

import sys

import torch
from safetensors.torch import load_file

from checks import compare
from pu2022 import GIVEN, TERMS, Pu2022, Setting, losses

TOLERANCES = {torch.float32: 1e-4, torch.float64: 1e-9}


def setting_of(config, batch):
    """From a run's config and a batch."""
    model, window = config["model"], config["window"]
    return Setting(
        joints=batch["key_poses"].shape[1] // 6,
        music_numbers=batch["music"].shape[1],
        width=model["width"],
        heads=model["heads"],
        layers=(model["motion_layers"], model["music_layers"], model["cross_layers"]),
        feed_forward=model["feed_forward"],
        pre_norm=model["norm"] == "pre",
        whole_music=model["music_span"] == "whole",
        local_positions=model["local_positions"],
        key_pose_embedding=model["key_pose_embedding"],
        ordinary_positions=model["ordinary_positions"],
        music=model["music"],
        seed=window["seed"],
        length=window["length"],
    )


def check(weights, config, batch_path, tolerance=None):
    """keydance's results, in the type of the file, against PyTorch's in f64; 0 if all agree."""
    batch = load_file(batch_path)
    missing = {*GIVEN, "windows"} - batch.keys()
    if missing:
        raise SystemExit(f"{batch_path}: no entry {', '.join(sorted(missing))}")
    theirs_in = batch["seed"].dtype
    tolerance = tolerance or TOLERANCES[theirs_in]
    windows = int(batch["windows"].item())
    model = Pu2022(setting_of(config, batch)).double()
    saved = load_file(weights)
    saved = {n: v for n, v in saved.items() if not n.startswith(("skeleton.", "music."))}
    try:
        model.load_state_dict(saved)
    except RuntimeError as error:
        raise SystemExit(f"{weights}: {error}") from None
    given = {name: batch[name].double() for name in GIVEN}
    said = model(given, windows)
    # A config from before these has none.
    loss = config["loss"]
    root, velocity = loss.get("root_weight", 1.0), loss.get("velocity_weight", 0.0)
    terms = losses(said, given, windows, root, velocity)
    terms["total"].backward()
    found = {"output": said.detach()}
    found |= {f"loss.{name}": term.detach().reshape(1) for name, term in terms.items()}
    for name, p in model.named_parameters():
        found[f"gradient.{name}"] = torch.zeros_like(p) if p.grad is None else p.grad
    absent = found.keys() - batch.keys()
    if absent:
        raise SystemExit(f"{batch_path}: no entry {', '.join(sorted(absent))}")
    print(f"{windows} windows of {model.setting.length} frames, keydance in {theirs_in}")
    names = ["output", *(f"loss.{name}" for name in TERMS)]
    disagreements = compare("keydance against PyTorch in f64", batch, found, tolerance, names)
    if disagreements:
        print(f"\n{disagreements} entries differ by more than {tolerance:g}", file=sys.stderr)
        return 1
    print("\nkeydance agrees with PyTorch")
    return 0
