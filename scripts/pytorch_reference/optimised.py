"""The model of docs/pan2021.md, as fast as we can make it with PyTorch on a CPU; the same mathematics as reference.py.

What is done otherwise:
- Everything is feature-major, [features, ..., B]: one large product a layer, and attention, layer norm and
  dropout run along the batch, which a compiler vectorises whatever the number of tokens or heads.
- A token of the first layers is linear in 3 or 5 numbers, plus a constant of its position: embedding, query, key
  and value are made once a frame, by the composed weights, not once a segment and token.
- The last decoder layer is evaluated at the segment's centre only. With one query, keys and values need no
  projection: (W_k^T q) . x instead of q . (W_k x), likewise for values.
- The encoder goes over many segments at once; target code, position code and their part of lstm2's gates are made
  once for all frames.
- Dropout compares 16 random bits an element with a threshold; a frame's bits are drawn in one go.
- torch.compile fuses what stands between the products.

Shapes: B windows, N frames, u = 7 tokens, F frames of a chunk; fed frames X_t are [149, B].
"""

import math
from functools import partial

import numpy
import torch

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
    NORM_EPSILON,
    part_weights,
)
from reference import sinusoidal_positions

CONTROLLERS = ("root_trajectory_controller", "velocity_factor_controller")
PERCEPTRONS = ("state_encoder", "velocity_encoder", "state_decoder", "root_decoder")
GIVEN = {CONTROLLERS[0]: ROOT_POSITION, CONTROLLERS[1]: VELOCITY_FACTORS}
HEAD = WIDTH // HEADS
SCALE = HEAD**-0.5
AFTER = SEGMENT - BEFORE - 1
NARROW = 16  # columns


class Bits:
    """Random bits of a frame, handed out in order; None where nothing is dropped."""

    def __init__(self, bits):
        self.bits = bits  # [count], int16
        self.used = 0

    def take(self, *shape):
        if self.bits is None:
            return None
        start = self.used
        self.used += math.prod(shape)
        return self.bits[start : self.used].view(shape)


def drop(x, bits, dropout):
    """Dropout: an element goes where its 16 bits, read as a signed number, are below the threshold."""
    if bits is None:
        return x
    threshold = round(dropout * 65536) - 32768
    return torch.where(bits >= threshold, x * (65536 / (32768 - threshold)), 0.0)


def product(weight, x):
    """weight [out, in], x [in, ...] -> [out, ...]."""
    columns = x.reshape(weight.shape[1], -1)
    if 1 < columns.shape[1] < NARROW:  # several times faster in MKL the other way round
        y = (columns.T.contiguous() @ weight.T).T.contiguous()
    else:
        y = weight @ columns
    return y.view(-1, *x.shape[1:])


def linear(x, weight, bias):
    """x [in, ...] -> [out, ...]."""
    return product(weight, x) + bias.view((-1,) + (1,) * (x.dim() - 1))


def prelu(x, slope):
    return torch.where(x >= 0, x, slope * x)


def attention(q, k, v, bits, dropout):
    """Attention of 7 queries into 7 keys and values, all [256, 7, B]; bits [8, 7, 7, B]."""
    q, k, v = (x.unflatten(0, (HEADS, HEAD)) for x in (q, k, v))  # [8, 32, 7, B]
    scores = (q[:, :, :, None] * k[:, :, None]).sum(1) * SCALE  # [8, 7, 7, B]
    weights = drop(scores.softmax(2), bits, dropout)
    return (weights[:, None] * v[:, :, None]).sum(3).flatten(0, 1)  # [256, 7, B]


def attention_of_one(q, x, bits, dropout):
    """Attention of one query into x [256, 7, B], values not projected.

    q [8, 256, B]: the query as the heads' key weights see it, W_k^T q; bits [8, 7, B].
    Returns what each head sees [8, 256, B] and the sum of its weights [8, 1, B].
    """
    scores = (q[:, :, None] * x).sum(1) * SCALE  # [8, 7, B]
    weights = drop(scores.softmax(1), bits, dropout)
    return (weights[:, None] * x).sum(2), weights.sum(1, keepdim=True)


def add_and_norm(x, y, bias, norm_weight, norm_bias, bits, dropout):
    """Layer norm over the features of x + dropout(y + bias); x, y, bits [256, ...]."""
    shape = (-1,) + (1,) * (x.dim() - 1)
    x = x + drop(y + bias.view(shape), bits, dropout)
    centred = x - x.mean(0, keepdim=True)
    scale = (centred.square().mean(0, keepdim=True) + 1e-5).rsqrt()
    return centred * scale * norm_weight.view(shape) + norm_bias.view(shape)


def lstm_cell(gates, cell):
    """gates [1024, B] (i, f, g, o), cell [256, B] -> hidden, cell."""
    i, f, g, o = gates.split(WIDTH)
    cell = f.sigmoid() * cell + i.sigmoid() * g.tanh()
    return o.sigmoid() * cell.tanh(), cell


class Layer:
    """A Transformer layer's parameters, with the dropout bits to run it."""

    def __init__(self, p, bits, dropout):
        self.p, self.bits, self.dropout = p, bits, dropout

    def attend(self, q, k, v):
        bits = self.bits.take(HEADS, SEGMENT, SEGMENT, q.shape[-1])
        return attention(q, k, v, bits, self.dropout)

    def attend_one(self, query, x, part):
        """One query [256, B] into x [256, 7, B], values projected; the output projection is to do.

        The key bias adds the same to every score, so the softmax does not see it.
        """
        p = inside(self.p, part + ".")
        q = linear(query, p["q_weight"], p["q_bias"]).unflatten(0, (HEADS, HEAD))  # [8, 32, B]
        q = torch.bmm(p["k_weight"].unflatten(0, (HEADS, HEAD)).transpose(1, 2), q)  # [8, 256, B]
        bits = self.bits.take(HEADS, SEGMENT, x.shape[-1])
        seen, total = attention_of_one(q, x, bits, self.dropout)
        values = torch.bmm(p["v_weight"].unflatten(0, (HEADS, HEAD)), seen)  # [8, 32, B]
        return (values + p["v_bias"].view(HEADS, HEAD, 1) * total).flatten(0, 1)

    def add_and_norm(self, x, y, name, norm):
        """The sublayer's last linear map `name` of y, dropout, residual and `norm`."""
        return add_and_norm(
            x,
            product(self.p[name + ".weight"], y),
            self.p[name + ".bias"],
            self.p[norm + ".weight"],
            self.p[norm + ".bias"],
            self.bits.take(*x.shape),
            self.dropout,
        )

    def feed_forward(self, x, norm):
        hidden = linear(x, self.p["linear1.weight"], self.p["linear1.bias"]).relu()
        return self.add_and_norm(x, hidden, "linear2", norm)

    def encoder(self, x, q, k, v):
        """x, q, k, v [256, 7, B]: the tokens and their projections -> [256, 7, B]."""
        x = self.add_and_norm(x, self.attend(q, k, v), "self_attn.out_proj", "norm1")
        return self.feed_forward(x, "norm2")

    def decoder(self, x, q, k, v, memory_keys, memory_values):
        """All [256, 7, B] -> [256, 7, B]."""
        x = self.add_and_norm(x, self.attend(q, k, v), "self_attn.out_proj", "norm1")
        q = linear(x, self.p["multihead_attn.q_weight"], self.p["multihead_attn.q_bias"])
        seen = self.attend(q, memory_keys, memory_values)
        x = self.add_and_norm(x, seen, "multihead_attn.out_proj", "norm2")
        return self.feed_forward(x, "norm3")

    def decoder_at_centre(self, x, memory):
        """x, memory [256, 7, B] -> [256, B]."""
        centre = x[:, BEFORE]
        seen = self.attend_one(centre, x, "self_attn")
        centre = self.add_and_norm(centre, seen, "self_attn.out_proj", "norm1")
        seen = self.attend_one(centre, memory, "multihead_attn")
        centre = self.add_and_norm(centre, seen, "multihead_attn.out_proj", "norm2")
        return self.feed_forward(centre, "norm3")


def inside(p, prefix):
    """The entries of p below `prefix`, the prefix cut off."""
    return {name[len(prefix) :]: value for name, value in p.items() if name.startswith(prefix)}


def encode(tokens, constants, p, bits, dropout):
    """The encoder over the target segments of F frames.

    tokens (F + 6) x [1024, B]: embedding, query, key, value of frames t - 2 .. t + F + 3, positions left out;
    constants [1024, 7]: the part of the positions and biases.
    Returns the encoder's output, and the keys and values that the first decoder layer makes of it:
    [256, 7, F, B], [512, 7, F, B].
    """
    bits = Bits(bits)
    frames = len(tokens) - SEGMENT + 1
    segments = torch.stack([tokens[i + f] for i in range(SEGMENT) for f in range(frames)], 1)
    segments = segments.view(4 * WIDTH, SEGMENT, -1) + constants[:, :, None]  # [1024, 7, FB]
    x = Layer(p["encoder.0"], bits, dropout).encoder(*segments.split(WIDTH))
    p1 = p["encoder.1"]
    q, k, v = linear(x, p1["self_attn.in_proj_weight"], p1["self_attn.in_proj_bias"]).split(WIDTH)
    memory = Layer(p1, bits, dropout).encoder(x, q, k, v)
    cross = p["decoder.0"]
    keys_values = linear(memory, cross["multihead_attn.kv_weight"], cross["multihead_attn.kv_bias"])
    return memory.unflatten(2, (frames, -1)), keys_values.unflatten(2, (frames, -1))


def decode(tokens, memory, keys_values, p, bits, dropout):
    """The decoder at the centre of one segment.

    tokens [1024, 7, B]: embedding, query, key, value; memory [256, 7, B]; keys_values [512, 7, B] -> [256, B].
    """
    layer = Layer(p["decoder.0"], bits, dropout)
    x = layer.decoder(*tokens.split(WIDTH), *keys_values.split(WIDTH))
    centre = Layer(p["decoder.1"], bits, dropout).decoder_at_centre(x, memory)
    return linear(centre, p["output"]["weight"], p["output"]["bias"])


def perceptron(x, p, last=None):
    """The encoders (two layers) and decoders (a third without PReLU, named by `last`) outside the controllers."""
    x = prelu(linear(x, p["0.weight"], p["0.bias"]), p["1.weight"])
    x = prelu(linear(x, p["2.weight"], p["2.bias"]), p["3.weight"])
    return x if last is None else linear(x, p[last + ".weight"], p[last + ".bias"])


def fed_tokens(fed, composed, constants):
    """What the mixture segments need of a fed frame [149, B]: tokens of both controllers, [1024, B] each."""
    velocities = fed[VELOCITIES] * constants["velocity_std"] + constants["velocity_mean"]  # [72, B]
    speed = (velocities.unflatten(0, (-1, 3)).square().sum(1) + NORM_EPSILON).sqrt()  # [24, B]
    factors = constants["part_weights"] @ speed  # [5, B]
    factors = (factors - constants["factor_mean"]) / constants["factor_std"]
    return composed[0] @ fed[ROOT_POSITION], composed[1] @ factors


def frame_step(fed, history, given, constants, memories, state, given_gates, p, bits, dropout):
    """Predicts a frame from X_t and the states.

    fed [149, B]; for each controller: history 3 x [1024, B] (tokens of t - 2 .. t), given 4 x [1024, B]
    (t + 1 .. t + 4), constants [1024, 7], memories ([256, 7, B], [512, 7, B]); state: hidden and cell of both
    LSTMs, [256, B]; given_gates [1024, B]: what lstm2's gates get from target, position and biases.
    Returns the frame [149, B] and the new state.
    """
    bits = Bits(bits)
    codes = [
        perceptron(fed[STATE], p["state_encoder"]),
        perceptron(fed[VELOCITIES], p["velocity_encoder"]),
    ]
    for i, name in enumerate(CONTROLLERS):
        tokens = torch.stack([*history[i], *given[i]], 1) + constants[i][:, :, None]  # [1024, 7, B]
        codes.append(decode(tokens, *memories[i], p[name], bits, dropout))
    hidden1, cell1, hidden2, cell2 = state
    gates = linear(torch.cat([*codes, hidden1]), p["lstm1"], p["lstm1_bias"])
    hidden1, cell1 = lstm_cell(gates, cell1)
    gates = p["lstm2"] @ torch.cat([hidden1, hidden2]) + given_gates
    hidden2, cell2 = lstm_cell(gates, cell2)
    pose = perceptron(hidden2, p["state_decoder"], "4")  # [142, B]
    root = perceptron(hidden2, p["root_decoder"], "4")  # [7, B]
    frame = torch.cat([pose[:69], root[:4], pose[69:], root[4:]])
    return frame, (hidden1, cell1, hidden2, cell2)


def dropout_counts(windows):
    """Random numbers that `encode` takes for a frame and a controller, and that `frame_step` takes."""
    weights = HEADS * SEGMENT * SEGMENT
    tokens = WIDTH * SEGMENT
    encoder = 2 * (weights + 2 * tokens)
    decoder = 2 * weights + 3 * tokens + 2 * HEADS * SEGMENT + 3 * WIDTH
    return windows * encoder, windows * 2 * decoder


class Functions:
    """What runs once a frame, as it is or compiled; each new shape is compiled anew."""

    def __init__(self, fuse=False):
        torch._dynamo.config.recompile_limit = 64
        wrap = partial(torch.compile, dynamic=False) if fuse else lambda function: function
        self.encode, self.frame_step, self.fed_tokens = map(wrap, (encode, frame_step, fed_tokens))


class Optimised:
    """Runs the parameters of a reference model (they are shared, not copied)."""

    def __init__(self, model, dropout=0.0, functions=None, chunk=None, seed=0):
        """chunk: frames that the encoder takes at once, all if None."""
        self.parameters = dict(model.named_parameters())
        self.statistics = model.statistics
        self.dropout = dropout
        self.functions = functions or Functions()
        self.chunk = chunk
        self.generator = numpy.random.Generator(numpy.random.SFC64(seed))
        std, mean = model.statistics.std[:, None], model.statistics.mean[:, None]
        self.constants = {
            "velocity_std": std[VELOCITIES],
            "velocity_mean": mean[VELOCITIES],
            "factor_std": std[VELOCITY_FACTORS],
            "factor_mean": mean[VELOCITY_FACTORS],
            "part_weights": velocity_order_weights(std.dtype),
        }

    def draw(self, count):
        if self.dropout == 0:
            return None
        words = self.generator.integers(0, 2**64, size=(count + 3) // 4, dtype=numpy.uint64)
        return torch.from_numpy(words.view(numpy.int16))[:count]

    def __call__(self, window, ground_truth_fed=False):
        """window [N + 1, B, 154] -> [N, B, 149], as the reference."""
        window = window.transpose(1, 2).contiguous()  # [N + 1, 154, B]
        last, windows = window.shape[0] - 1, window.shape[2]
        p = self.parameters
        weights = {name: inside(p, name + ".") for name in PERCEPTRONS}
        weights |= {name: controller_parameters(inside(p, name + ".")) for name in CONTROLLERS}

        memories, given, composed, constants = [], [], [], []
        for name in CONTROLLERS:
            part = inside(p, name + ".")
            values = pad(window[:, GIVEN[name]])  # [N + 6, in, B]
            weight, constant = compose(
                part, "target_projection.", "encoder.layers.0.self_attn.in_proj_"
            )
            memories.append(
                self.encode(torch.matmul(weight, values).unbind(), constant, weights[name])
            )
            weight, constant = compose(
                part, "mixture_projection.", "decoder.layers.0.self_attn.in_proj_"
            )
            composed.append(weight)
            constants.append(constant)
            given.append(torch.matmul(weight, values).unbind())  # [1024, B] a frame
        given_gates = self.given_gates(window)
        weights["lstm1"] = torch.cat([p["lstm1.weight_ih_l0"], p["lstm1.weight_hh_l0"]], 1)
        weights["lstm1_bias"] = p["lstm1.bias_ih_l0"] + p["lstm1.bias_hh_l0"]
        weights["lstm2"] = torch.cat(
            [p["lstm2.weight_ih_l0"][:, :WIDTH], p["lstm2.weight_hh_l0"]], 1
        )

        state = tuple(window.new_zeros(WIDTH, windows) for _ in range(4))
        fed = window[0, :OUTPUTS]
        # Tokens of the fed frames t - 2 .. t; those before k1 repeat k1, and k1 is given.
        history = [(given[i][BEFORE - 1],) * BEFORE for i in range(2)]
        outputs = []
        for t in range(last):
            if t > 0:
                fed = window[t, :OUTPUTS] if ground_truth_fed else outputs[-1]
                tokens = self.functions.fed_tokens(fed, composed, self.constants)
                history = [(*history[i][1:], tokens[i]) for i in range(2)]
            frame, state = self.functions.frame_step(
                fed,
                history,
                [g[t + BEFORE : t + SEGMENT] for g in given],
                constants,
                [m[t] for m in memories],
                state,
                given_gates[t],
                weights,
                self.draw(dropout_counts(windows)[1]),
                self.dropout,
            )
            outputs.append(frame)
        return torch.stack(outputs).transpose(1, 2)

    def encode(self, tokens, constant, part):
        """tokens (N + 6) x [1024, B] -> memory and keys and values of each of the N frames."""
        frames, windows = len(tokens) - SEGMENT + 1, tokens[0].shape[1]
        chunk = self.chunk or frames
        memories = []
        for start in range(0, frames, chunk):
            size = min(chunk, frames - start)
            memory, keys_values = self.functions.encode(
                tokens[start : start + size + SEGMENT - 1],
                constant,
                part,
                self.draw(size * dropout_counts(windows)[0]),
                self.dropout,
            )
            memories += zip(memory.unbind(2), keys_values.unbind(2))
        return memories

    def given_gates(self, window):
        """window [N + 1, 154, B] -> what lstm2's gates get from target, position and biases, N x [1024, B]."""
        p = self.parameters
        last, _, windows = window.shape
        last -= 1
        target = perceptron(window[last, TARGET], inside(p, "target_controller."))  # [256, B]
        progress = torch.arange(1, last + 1, dtype=window.dtype)[:, None, None] / last  # a_t
        position = torch.cat([window[1:, ROOT_POSITION], progress.expand(-1, 1, windows)], 1)
        position = linear(  # [512, N, B]
            position.transpose(0, 1), p["position_encoder.0.weight"], p["position_encoder.0.bias"]
        )
        position = prelu(position, p["position_encoder.1.weight"])
        weight = p["lstm2.weight_ih_l0"]
        bias = p["lstm2.bias_ih_l0"] + p["lstm2.bias_hh_l0"]
        gates = (
            linear(position, weight, bias) + (weight[:, WIDTH:] @ target)[:, None]
        )  # [1024, N, B]
        return gates.transpose(0, 1).contiguous().unbind()


def controller_parameters(p):
    """A controller's parameters, a dictionary a layer, with the attention's projections cut apart.

    Cut once for all frames: the gradient of a slice fills the whole with zeros first.
    """
    layers = {"output": inside(p, "output.")}
    for stack in ("encoder", "decoder"):
        for i in (0, 1):
            layers[f"{stack}.{i}"] = inside(p, f"{stack}.layers.{i}.")
    cut_attention(layers["decoder.0"], "multihead_attn", {"q": 1, "kv": 2})
    cut_attention(layers["decoder.1"], "self_attn", {"q": 1, "k": 1, "v": 1})
    cut_attention(layers["decoder.1"], "multihead_attn", {"q": 1, "k": 1, "v": 1})
    return layers


def cut_attention(p, part, names):
    """Adds the pieces of in_proj_weight and in_proj_bias by their names, each so many times 256 rows."""
    sizes = [WIDTH * count for count in names.values()]
    for kind in ("weight", "bias"):
        pieces = p[f"{part}.in_proj_{kind}"].split(sizes)
        p |= {f"{part}.{name}_{kind}": piece for name, piece in zip(names, pieces)}


def velocity_order_weights(dtype):
    """[5, 24]: eq. 1's weights in the order of the velocities, the root last."""
    weights = part_weights(dtype)
    return torch.cat([weights[1:], weights[:1]]).T.contiguous()


def pad(values):
    """[N + 1, ...] -> [N + 6, ...]: frames -2 .. N + 3, the ends repeated."""
    return torch.cat([values[:1]] * (BEFORE - 1) + [values] + [values[-1:]] * AFTER)


def compose(p, projection, attention_in):
    """Embedding, query, key and value of a token as one linear map of its input.

    Returns the weight [1024, in], and for each position the constant [1024, 7] of biases and sinusoids.
    """
    weight, bias = p[projection + "weight"], p[projection + "bias"]
    in_weight, in_bias = p[attention_in + "weight"], p[attention_in + "bias"]
    positions = sinusoidal_positions(weight.dtype).T + bias[:, None]  # [256, 7]
    return (
        torch.cat([weight, in_weight @ weight]),
        torch.cat([positions, in_weight @ positions + in_bias[:, None]]),
    )
