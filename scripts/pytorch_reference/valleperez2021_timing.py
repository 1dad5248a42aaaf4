"""Training steps of Transflower (docs/valleperez2021.md): PyTorch plain and compiled, and keydance, in turn.

The processes of PyTorch have running statistics of their own, as the paper's GPUs have; keydance's are
those of the whole batch.
"""

import sys

import torch

import flow_timing
from timing import keep_memory
from valleperez2021 import (
    GIVEN,
    FastTransformer,
    Setting,
    Sizes,
    Transformer,
    Valleperez2021,
)

SIZES = {"two_cores": (flow_timing.budget(), 32), "paper": ({}, 4)}  # and windows
LARGE = ()


def setting_of(sizes):
    """From `[model]` of a config; what it leaves out is the paper's."""
    paper = Setting()
    own = {name: value for name, value in sizes.items() if hasattr(paper, name)}
    of_coupling = ("flow_width", "flow_heads", "flow_feed_forward", "coupling_layers")
    values = vars(paper.coupling).values()
    coupling = [sizes.get(name, value) for name, value in zip(of_coupling, values)]
    layers = [
        sizes.get(f"{part}_layers", value)
        for part, value in zip(("motion", "audio", "cross"), paper.layers)
    ]
    audio_frames = sizes.get("audio_past", 120) + sizes.get("audio_future", 20)
    return Setting(
        **own, coupling=Sizes(*coupling), layers=tuple(layers), audio_frames=audio_frames
    )


def made_up_batch(windows, sizes):
    """Numbers in place of motion and music; frames that are predicted of a window."""
    s = setting_of(sizes)
    torch.manual_seed(1)
    batch = {
        "motion": torch.randn(windows * s.motion_context, s.motion),
        "audio": torch.randn(windows * s.audio_frames, s.audio),
        "target": torch.randn(windows * s.predicted_frames, s.motion),
    }
    return batch, s.predicted_frames


def make(sizes, fast, fuse, _rank=0):
    """The model in training and its loss of a batch; all ranks make the same weights."""
    keep_memory()
    torch.manual_seed(0)
    model = Valleperez2021(setting_of(sizes), FastTransformer if fast else Transformer)
    if fast and fuse:
        # Layers and blocks by themselves: each kind is compiled once, the whole would take too long.
        encoders = (model.motion_encoder, model.audio_encoder, model.cross_encoder)
        layers = [layer for encoder in encoders for layer in encoder.layers]
        for part in (*layers, *model.flow.blocks):
            part.compile(dynamic=False)
    return model, lambda batch: model(batch)["total"]


def split(_sizes, batch, parts):
    """By windows, whose rows stand together."""
    chunks = {name: value.chunk(parts) for name, value in batch.items()}
    return [{name: chunks[name][k] for name in GIVEN} for k in range(parts)]


def time_all(arguments):
    return flow_timing.time_all(arguments, sys.modules[__name__])
