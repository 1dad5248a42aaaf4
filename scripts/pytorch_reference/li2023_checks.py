"""Agreement of outputs, losses and gradients of the model of docs/li2023.md."""

import sys

import torch
from safetensors.torch import load_file

from checks import compare
from li2023 import GIVEN, TERMS, Li2023, Optimised, Plain, Setting
from li2023_synthetic import made_up_batch, random_model

TOLERANCES = {torch.float32: 1e-4, torch.float64: 1e-9}
SELFTEST_TOLERANCE = 1e-9


def results(run, model, batch, windows):
    """Outputs, losses and gradients, by the names of an exported batch."""
    model.zero_grad(set_to_none=True)
    rotations, logits, terms = run(batch, windows)
    terms["total"].backward()
    found = {
        "output.rotations": rotations.detach(),
        "output.contacts": logits.detach().softmax(-1),
    }
    found |= {f"loss.{name}": term.detach().reshape(1) for name, term in terms.items()}
    # Where no loss sees a parameter, keydance has zeros.
    for name, p in model.named_parameters():
        found[f"gradient.{name}"] = torch.zeros_like(p) if p.grad is None else p.grad.clone()
    return found


def judged(found):
    return [n for n in found if n.startswith("output.")] + [
        f"loss.{name}" for name in TERMS if f"loss.{name}" in found
    ]


def setting_of(config, entries, parents, feet):
    """From a run's config, its weights file and a batch."""
    model, loss = config["model"], config["loss"]
    ranges = tuple(entries["windows.ranges"].double().tolist())
    return Setting(
        parents=parents,
        feet=feet,
        width=model["width"],
        layers=model["layers"],
        heads=model["heads"],
        longest=config["schedule"]["lengths"]["max"],
        keyframe_embedding=model["keyframe_embedding"],
        contact_embedding=model["contact_embedding"],
        state_decoder=model["state_decoder"],
        fade_frames=model["fade_frames"],
        reconstruction=loss.get("reconstruction", "mean_square"),
        contact=loss["contact"],
        position=loss["position"],
        root=loss["root"],
        soft_weights=config["rtr"]["weights"] == "predicted_soft",
        units=ranges if loss["unit"] == "range" else (1.0, 1.0),
    )


def load_model(path, config, batch, dtype):
    """The plain model with a run's weights."""
    entries = load_file(path)
    parents = tuple(int(parent) for parent in batch["parents"])
    feet = tuple(int(joint) for joint in batch["feet"])
    model = Li2023(setting_of(config, entries, parents, feet)).to(dtype)
    weights = {n: v for n, v in entries.items() if not n.startswith(("skeleton.", "windows."))}
    try:
        model.load_state_dict(weights)
    except RuntimeError as error:
        raise SystemExit(f"{path}: {error}") from None
    return model


def load_batch(path):
    batch = load_file(path)
    missing = {*GIVEN, "parents", "feet", "windows"} - batch.keys()
    if missing:
        raise SystemExit(f"{path}: no entry {', '.join(sorted(missing))}")
    return batch


def check(weights, config, batch_path, tolerance=None):
    """keydance's results, in the type of the file, against both versions in f64; 0 if all agree."""
    batch = load_batch(batch_path)
    theirs_in = batch["input"].dtype
    tolerance = tolerance or TOLERANCES[theirs_in]
    windows = int(batch["windows"].item())
    found = {}
    for name, dtype in (
        ("plain", torch.float64),
        ("optimised", torch.float64),
        ("optimised, f32", torch.float32),
    ):
        model = load_model(weights, config, batch, dtype)
        given = {n: batch[n].to(dtype) for n in GIVEN}
        run = Plain(model) if name == "plain" else Optimised(model)
        found[name] = results(run, model, given, windows)
    absent = found["plain"].keys() - batch.keys()
    if absent:
        raise SystemExit(f"{batch_path}: no entry {', '.join(sorted(absent))}")
    print(f"{windows} windows of {len(batch['input']) // windows} frames, keydance in {theirs_in}")
    names = judged(found["plain"])
    disagreements = 0
    for name in ("plain", "optimised"):
        title = f"keydance against PyTorch, {name}, f64"
        disagreements += compare(title, batch, found[name], tolerance, names)
    title = "for scale: PyTorch, optimised, f32 against PyTorch, plain, f64"
    compare(title, found["optimised, f32"], found["plain"], TOLERANCES[torch.float32], names)
    if disagreements:
        print(f"\n{disagreements} entries differ by more than {tolerance:g}", file=sys.stderr)
        return 1
    print("\nkeydance agrees with PyTorch")
    return 0


def selftest():
    """The optimised version against the plain one in f64; the number that disagree."""
    disagreements = 0
    for title, changes in (
        ("the whole model", {}),
        ("fading, convolution, norm, given feet", dict(
            fade_frames=3, state_decoder="conv3", reconstruction="norm", soft_weights=False,
            units=(2.0, 3.0),
        )),
        ("L_rec alone", dict(
            keyframe_embedding=False, contact_embedding=False, contact=0.0, position=0.0, root=0.0
        )),
    ):  # fmt: skip
        model = random_model(seed=3, width=8, heads=2, layers=2, **changes)
        batch = made_up_batch(3, 9, seed=1, joints=model.setting.joints)
        plain = results(Plain(model), model, batch, 3)
        optimised = results(Optimised(model), model, batch, 3)
        title = f"li2023, optimised against plain: {title}"
        names = judged(plain)
        disagreements += compare(title, optimised, plain, SELFTEST_TOLERANCE, names)
    return disagreements
