#!/usr/bin/env python3
"""Copies a trained run with some layers' weights set to 0, to see what they contribute. Needs numpy and safetensors.

    python scripts/zero_layers.py runs/whole_model runs/without_recurrent state_decoder.4 root_decoder.4
    keydance evaluate runs/without_recurrent --data DANCE --clips validation

`docs/pan2021.md` names the layers.
"""

import argparse
import pathlib
import shutil

from safetensors import safe_open
from safetensors.numpy import save_file

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("run", type=pathlib.Path)
parser.add_argument("out", type=pathlib.Path, help="a folder that does not exist yet")
parser.add_argument("layers", nargs="+")
arguments = parser.parse_args()

with safe_open(arguments.run / "weights.safetensors", "numpy") as weights:
    metadata = weights.metadata()
    tensors = {name: weights.get_tensor(name) for name in weights.keys()}
for layer in arguments.layers:
    zeroed = [name for name in tensors if name.startswith(layer + ".")]
    if not zeroed:
        parser.error(f"{arguments.run} has no weights of a layer {layer}")
    for name in zeroed:
        tensors[name] = 0 * tensors[name]
arguments.out.mkdir(parents=True)
for name in ("config.toml", "manifest.json"):
    shutil.copy(arguments.run / name, arguments.out)
save_file(tensors, arguments.out / "weights.safetensors", metadata)
