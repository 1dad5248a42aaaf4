"""The model of docs/pan2021.md out of plain torch.nn modules: slow, and easy to see that it is right.

B windows of N + 1 frames, time first: window [N + 1, B, 154], standardised; frame 0 is k1, frame N is k2.
"""

import math
from dataclasses import dataclass

import torch
from torch import nn

from layout import (
    BEFORE,
    HEADS,
    OUTPUTS,
    ROOT_POSITION,
    SEGMENT,
    STATE,
    TARGET,
    VELOCITIES,
    VELOCITY_FACTORS,
    WIDTH,
    standardised_factors,
)


@dataclass(frozen=True)
class Sizes:
    """The paper's sizes."""

    width: int = WIDTH  # of every code, LSTM and Transformer
    hidden: int = 512  # first layer of encoders and decoders
    heads: int = HEADS
    feed_forward: int = WIDTH


def encoder(inputs, sizes):
    width, hidden = sizes.width, sizes.hidden
    return nn.Sequential(
        nn.Linear(inputs, hidden), nn.PReLU(), nn.Linear(hidden, width), nn.PReLU()
    )


def decoder(outputs, sizes):
    width, hidden = sizes.width, sizes.hidden
    return nn.Sequential(
        nn.Linear(width, hidden),
        nn.PReLU(),
        nn.Linear(hidden, width),
        nn.PReLU(),
        nn.Linear(width, outputs),
    )


def sinusoidal_positions(dtype=torch.float64, width=WIDTH):
    """[7, width]: sin(p / 10000^(2i/width)) in column 2i, cos in column 2i + 1."""
    position = torch.arange(SEGMENT, dtype=torch.float64)[:, None]
    rate = torch.exp(torch.arange(0, width, 2, dtype=torch.float64) * (-math.log(10000.0) / width))
    table = torch.zeros(SEGMENT, width, dtype=torch.float64)
    table[:, 0::2] = torch.sin(position * rate)
    table[:, 1::2] = torch.cos(position * rate)
    return table.to(dtype)


class Controller(nn.Module):
    """Segments of what is given and of given and predicted mixed -> a code for the frame to predict."""

    def __init__(self, inputs, dropout, sizes):
        super().__init__()
        self.width = sizes.width
        shape = (sizes.width, sizes.heads, sizes.feed_forward)
        options = dict(dropout=dropout, activation="relu", batch_first=True, norm_first=False)
        self.target_projection = nn.Linear(inputs, sizes.width)
        self.mixture_projection = nn.Linear(inputs, sizes.width)
        self.encoder = nn.TransformerEncoder(
            nn.TransformerEncoderLayer(*shape, **options), 2, enable_nested_tensor=False
        )
        self.decoder = nn.TransformerDecoder(nn.TransformerDecoderLayer(*shape, **options), 2)
        for layer in [*self.encoder.layers, *self.decoder.layers]:
            layer.dropout = nn.Dropout(0.0)  # the one inside the feed-forward part
        self.output = nn.Linear(sizes.width, sizes.width)

    def forward(self, target, mixture):
        """target, mixture [B, 7, inputs] -> [B, width]."""
        positions = sinusoidal_positions(target.dtype, self.width)
        memory = self.encoder(self.target_projection(target) + positions)
        decoded = self.decoder(
            self.mixture_projection(mixture) + positions, memory
        )  # [B, 7, width]
        return self.output(decoded[:, BEFORE])


class Pan2021(nn.Module):
    def __init__(self, statistics, dropout=0.1, sizes=Sizes()):
        super().__init__()
        self.statistics = statistics
        self.state_encoder = encoder(77, sizes)
        self.velocity_encoder = encoder(72, sizes)
        self.target_controller = encoder(73, sizes)
        self.position_encoder = nn.Sequential(nn.Linear(4, 2 * sizes.width), nn.PReLU())
        self.root_trajectory_controller = Controller(3, dropout, sizes)
        self.velocity_factor_controller = Controller(5, dropout, sizes)
        self.lstm1 = nn.LSTM(4 * sizes.width, sizes.width)
        self.lstm2 = nn.LSTM(2 * sizes.width, sizes.width)
        self.state_decoder = decoder(142, sizes)  # p^b, c, v^b
        self.root_decoder = decoder(7, sizes)  # p^r, o^r, v^r

    def forward(self, window, ground_truth_fed=False):
        """window [N + 1, B, 154] -> standardised predictions of frames 1..N [N, B, 149].

        Of the window's frames 1..N only p^r and f are read (given), and p^b and o^r of frame N, unless
        the ground truth is fed.
        """
        last = window.shape[0] - 1  # N
        given_root = window[..., ROOT_POSITION]  # [N + 1, B, 3]
        given_factors = window[..., VELOCITY_FACTORS]  # [N + 1, B, 5]
        fed = window[0, :, :OUTPUTS]  # X_t [B, 149]
        fed_root = [given_root[0]]  # p^r of X_0 .. X_t
        fed_factors = [given_factors[0]]  # f of X_0 .. X_t
        state1 = state2 = None
        outputs = []
        for t in range(last):
            if t > 0:
                fed = window[t, :, :OUTPUTS] if ground_truth_fed else outputs[-1]
                fed_root.append(fed[:, ROOT_POSITION])
                fed_factors.append(standardised_factors(fed[:, VELOCITIES], self.statistics))
            segment = [min(max(t + 1 + k, 0), last) for k in range(-BEFORE, SEGMENT - BEFORE)]

            def mixed(given, fed_frames):
                return torch.stack([fed_frames[i] if i <= t else given[i] for i in segment], 1)

            root_code = self.root_trajectory_controller(
                given_root[segment].transpose(0, 1), mixed(given_root, fed_root)
            )
            factor_code = self.velocity_factor_controller(
                given_factors[segment].transpose(0, 1), mixed(given_factors, fed_factors)
            )
            state_code = self.state_encoder(fed[:, STATE])
            velocity_code = self.velocity_encoder(fed[:, VELOCITIES])
            codes = torch.cat([state_code, velocity_code, root_code, factor_code], 1)  # [B, 1024]
            hidden, state1 = self.lstm1(codes[None], state1)  # [1, B, 256]

            target_code = self.target_controller(window[last, :, TARGET])
            progress = torch.full_like(given_root[0, :, :1], (t + 1) / last)  # a_t, eq. 2
            position_code = self.position_encoder(torch.cat([given_root[t + 1], progress], 1))
            inputs = torch.cat([hidden[0], target_code], 1) + position_code  # [B, 512]
            hidden, state2 = self.lstm2(inputs[None], state2)

            pose = self.state_decoder(hidden[0])  # [B, 142]
            root = self.root_decoder(hidden[0])  # [B, 7]
            outputs.append(
                torch.cat([pose[:, :69], root[:, :4], pose[:, 69:73], pose[:, 73:], root[:, 4:]], 1)
            )
        return torch.stack(outputs)
