"""Training steps of MoGlow (docs/valleperez2021.md): PyTorch plain and compiled, and keydance, in turn."""

import sys

import torch

import flow_timing
from moglow2020 import GIVEN, Coupling, FastCoupling, Moglow2020, Setting, lstm_layer
from timing import keep_memory

SIZES = {"two_cores": (flow_timing.budget("moglow"), 16), "paper": ({}, 4)}  # and sequences
LARGE = ("paper",)
MOTION, AUDIO = Setting().motion, 85


def setting_of(sizes):
    """From `[model]` of a config; what it leaves out is the paper's."""
    past = sizes.get("motion_past", 40)
    heard = sizes.get("audio_past", 40) + sizes.get("audio_future", 10)
    own = {name: value for name, value in sizes.items() if hasattr(Setting(), name)}
    return Setting(**own, condition=past * MOTION + heard * AUDIO)


def frames_of(sizes):
    return sizes.get("sequence", 80)


def made_up_batch(sequences, sizes):
    """Numbers in place of motion and music; frames of a sequence."""
    rows = frames_of(sizes) * sequences
    torch.manual_seed(1)
    batch = {
        "condition": torch.randn(rows, setting_of(sizes).condition),
        "target": torch.randn(rows, MOTION),
    }
    return batch, frames_of(sizes)


def make(sizes, fast, fuse, _rank=0):
    """The model and its loss of a batch; all ranks make the same weights."""
    keep_memory()
    torch.manual_seed(0)
    model = Moglow2020(setting_of(sizes), FastCoupling if fast else Coupling)
    if fast and fuse:
        # One function for all layers of all blocks: the whole would take an hour to compile.
        FastCoupling.run_layer = staticmethod(torch.compile(lstm_layer, dynamic=False))
    frames = frames_of(sizes)
    return model, lambda batch: model(batch, len(batch["target"]) // frames)["total"]


def split(sizes, batch, parts):
    """By sequences; the rows of a frame stand together."""
    frames = frames_of(sizes)
    pieces = {name: batch[name].unflatten(0, (frames, -1)).chunk(parts, 1) for name in GIVEN}
    return [{name: pieces[name][k].flatten(0, 1) for name in GIVEN} for k in range(parts)]


def time_all(arguments):
    return flow_timing.time_all(arguments, sys.modules[__name__])
