"""Agreement of the model of docs/valleperez2021.md: latent, noise, inverse, densities, losses, gradients."""

import json
import math
from pathlib import Path

import torch
from safetensors.torch import load_file

import flow
from checks import compare
from flow_checks import (
    TOLERANCES,
    gradients,
    load_batch,
    load_weights,
    log_densities,
    verdict,
)
from valleperez2021 import (
    GIVEN,
    Block,
    FastTransformer,
    Setting,
    Sizes,
    Transformer,
    Valleperez2021,
    bucket,
)

EXAMPLE = Path(__file__).resolve().parents[2] / "tests" / "papers" / "flow_example.json"


def setting_of(config, batch):
    """From a run's config and a batch."""
    model = config["model"]
    return Setting(
        motion=batch["motion"].shape[1],
        audio=batch["audio"].shape[1],
        layers=(model["motion_layers"], model["audio_layers"], model["cross_layers"]),
        audio_frames=model["audio_past"] + model["audio_future"],
        hears=model["music"],
        coupling=Sizes(
            model["flow_width"],
            model["flow_heads"],
            model["flow_feed_forward"],
            model["coupling_layers"],
        ),
        **{
            name: model[name]
            for name in (
                "head", "width", "heads", "feed_forward", "motion_context", "predicted_frames",
                "positions", "cross_positions", "blocks", "norm",
            )
        },
    )  # fmt: skip


def results(model, batch):
    """By the names of an exported batch; rows window by window."""
    # With gradients on: without, a layer of torch.nn takes what is added to its scores for a mask.
    h, target = model.latent(batch), model.target(batch)
    found = {"latent": h.flatten(0, 1)}
    if model.setting.head == "flow":
        flowed = model.flow(target, h)
        found["noise"] = flowed.z.flatten(0, 1)
        found["back"] = model.flow.inverse(flowed.z, h).flatten(0, 1)
        found["log_density"] = log_densities(flowed)
    else:
        squares = (target - h).square() + math.log(2 * math.pi)
        found["log_density"] = -squares.sum((1, 2)) / 2
    found = {name: value.detach() for name, value in found.items()}
    return found | gradients(model, model(batch))


def nearest_kink(model, batch):
    """The smallest number, by size, that goes into a ReLU."""
    smallest = []

    def see(_module, _inputs, output):
        smallest.append(output.detach().abs().min().item())

    layers = [part for name, part in model.named_modules() if name.endswith(".linear1")]
    hooks = [layer.register_forward_hook(see) for layer in layers]
    model(batch)
    for hook in hooks:
        hook.remove()
    return min(smallest, default=math.inf)


def check(weights, config, batch_path, tolerance=None):
    """keydance's results, in the type of the file, against both versions in f64; 0 if all agree."""
    batch = load_batch(batch_path, [*GIVEN, "windows"])
    theirs_in, setting = batch["motion"].dtype, setting_of(config, batch)
    given = {name: batch[name].double() for name in GIVEN}
    found = {}
    for version, transformer in (("plain", Transformer), ("optimised", FastTransformer)):
        model = load_weights(Valleperez2021(setting, transformer).double(), weights)
        found[version] = results(model, given)
        if "target.log_deviations" in batch:
            deviation = load_file(weights)["target.deviation"].double()
            found[version]["target.log_deviations"] = deviation.log().sum().reshape(1)
    windows, kink = int(batch["windows"].item()), nearest_kink(model, given)
    print(
        f"{windows} windows of {setting.predicted_frames} frames, keydance in {theirs_in}; "
        f"{kink:.1e} goes into a ReLU, nothing nearer 0"
    )
    return verdict(batch, batch_path, found, tolerance or TOLERANCES[theirs_in])


def selftest():
    """Both versions of a block against the specification's example; the number that disagree."""
    example = json.loads(EXAMPLE.read_text())
    size = example["sizes"]
    setting = Setting(
        motion=size["channels"],
        width=size["latent"],
        predicted_frames=size["frames"],
        coupling=Sizes(size["width"], size["heads"], size["feed_forward"], size["layers"]),
        norm="act",
    )

    def number(value):
        return torch.tensor(value, dtype=torch.float64)

    prefix = "flow.blocks.0."
    weights = {n.removeprefix(prefix): number(v) for n, v in example["weights"].items()}
    expected = {
        "out": number(example["out"]),
        "log_density": number(example["log_prob_nats"]),
        "loss.total": number([example["nll_bits_per_frame"]]),
        "x": number(example["inverse"]["x"]),
    }
    gradients_of = example["gradients_of_nll"]
    expected |= {f"gradient.{n.removeprefix(prefix)}": number(v) for n, v in gradients_of.items()}
    wrong = sum(bucket(int(delta)) != found for delta, found in example["t5_buckets"].items())
    for version, transformer in (("plain", Transformer), ("optimised", FastTransformer)):
        block = Block(setting, transformer).double()
        block.load_state_dict(weights)
        x, h = (number(example[name]).requires_grad_() for name in ("x", "h"))
        y, norm, linear, coupling = block(x, h)
        flowed = flow.Flowed(y, norm, linear, coupling)
        found = gradients(block, flow.losses(flowed))
        found |= {"gradient.x": x.grad, "gradient.h": h.grad, "out": y.detach()}
        found["log_density"] = log_densities(flowed).detach()
        found["x"] = block.inverse(number(example["inverse"]["z"]), h).detach()
        title = f"valleperez2021, {version} against the specification's example"
        names = ["out", "log_density", "loss.total", "x"]
        wrong += compare(title, found, expected, TOLERANCES[torch.float64], names)
    return wrong
