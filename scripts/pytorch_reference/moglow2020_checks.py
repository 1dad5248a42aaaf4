"""Agreement of MoGlow (docs/valleperez2021.md): noise, densities, losses, gradients, and its inverse."""

import torch

from flow_checks import (
    TOLERANCES,
    gradients,
    load_batch,
    load_weights,
    log_densities,
    verdict,
)
from moglow2020 import GIVEN, Coupling, FastCoupling, Moglow2020, Setting


def setting_of(config, batch):
    """From a run's config and a batch."""
    model = config["model"]
    return Setting(
        motion=batch["target"].shape[1],
        condition=batch["condition"].shape[1],
        blocks=model["blocks"],
        hidden=model["hidden"],
        lstm_layers=model["lstm_layers"],
    )


def results(model, batch, sequences):
    """By the names of an exported batch, and `back`, the targets that the noise goes back to."""
    with torch.no_grad():
        flowed = model.flowed(batch, sequences)
        z = flowed.z.transpose(0, 1)
        back = model.flow.inverse(z, batch["condition"].unflatten(0, (-1, sequences)))
    found = {"noise": z.flatten(0, 1), "back": back.flatten(0, 1)}
    found["log_density"] = log_densities(flowed)
    return found | gradients(model, model(batch, sequences))


def check(weights, config, batch_path, tolerance=None):
    """keydance's results, in the type of the file, against both versions in f64; 0 if all agree."""
    batch = load_batch(batch_path, [*GIVEN, "sequences"])
    theirs_in, setting = batch["target"].dtype, setting_of(config, batch)
    sequences = int(batch["sequences"].item())
    batch["back"] = batch["target"]
    given = {name: batch[name].double() for name in GIVEN}
    found = {}
    for version, coupling in (("plain", Coupling), ("optimised", FastCoupling)):
        model = load_weights(Moglow2020(setting, coupling).double(), weights)
        found[version] = results(model, given, sequences)
    frames = len(batch["target"]) // sequences
    print(f"{sequences} sequences of {frames} frames, keydance in {theirs_in}")
    return verdict(batch, batch_path, found, tolerance or TOLERANCES[theirs_in])
