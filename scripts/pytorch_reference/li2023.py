"""The model of docs/li2023.md: plain, out of torch.nn modules, and as fast as we can make it on a CPU.

W windows of T frames, rows = W T; J joints, d = J c. A batch is a dictionary of tensors by the names
of an exported batch: input [rows, 4 J], keyframes, contacts [rows, 2], distances [rows, 1],
offsets [rows, 3 J], truth.rotations [rows, 4 J]. Random masks (stochastic depth) are off.
"""

from dataclasses import dataclass

import torch
from torch import nn
from torch.nn import functional

TERMS = ["total", "rec", "con", "position", "root"]
SMALLEST_SQUARE = 1e-12
GIVEN = ["input", "keyframes", "contacts", "distances", "offsets", "truth.rotations"]


@dataclass(frozen=True)
class Setting:
    """What a config and its data say; the defaults are the paper's."""

    parents: tuple  # -1: none
    feet: tuple = (7, 3)  # right, left
    width: int = 32
    layers: int = 4
    heads: int = 8
    longest: int = 50
    keyframe_embedding: bool = True
    contact_embedding: bool = True
    state_decoder: str = "linear"
    fade_frames: int = 0
    reconstruction: str = "mean_square"
    contact: float = 1.0
    position: float = 1e-5
    root: float = 1e-5
    soft_weights: bool = True
    units: tuple = (1.0, 1.0)  # cm, of L_p and L_r

    @property
    def joints(self):
        return len(self.parents)


class Encoder(nn.Module):
    def __init__(self, positions, width, setting):
        super().__init__()
        self.position = nn.Parameter(torch.zeros(positions, width))
        options = dict(dropout=0.0, activation="gelu", batch_first=True, norm_first=True)
        self.layers = nn.ModuleList(
            nn.TransformerEncoderLayer(width, setting.heads, 2 * width, **options)
            for _ in range(setting.layers)
        )
        self.norm = nn.LayerNorm(width)

    def forward(self, x):
        """x [sequences, tokens, width] -> the same shape."""
        x = x + self.position[: x.shape[1]]
        for layer in self.layers:
            x = layer(x)
        return self.norm(x)


class Li2023(nn.Module):
    """Eq. 12 to 16; the weights have the names of a run's."""

    def __init__(self, setting):
        super().__init__()
        self.setting = setting
        joints, d = setting.joints, setting.joints * setting.width
        self.spatial = Encoder(joints, setting.width, setting)
        self.spatial.embed = nn.Linear(4, setting.width)
        self.mix = nn.ModuleDict()
        if setting.keyframe_embedding:
            self.mix["keyframe"] = nn.Linear(2, d)
        if setting.contact_embedding:
            self.mix["contact"] = nn.Linear(2, d)
        self.temporal = Encoder(setting.longest, d, setting)
        if setting.state_decoder == "linear":
            self.state = nn.Linear(d, 4 * joints)
        else:
            self.state = nn.Conv1d(d, 4 * joints, 3, padding=1)
        self.contact = nn.Linear(d, 2)

    def forward(self, batch, windows):
        """Y [rows, 4 J] and the contact logits [rows, 2]."""
        given = batch["input"]
        rows = len(given)
        x = self.spatial.embed(given.view(rows, -1, 4))
        x = self.spatial(x).reshape(rows, -1)
        if "keyframe" in self.mix:
            x = x + self.mix["keyframe"](batch["keyframes"])
        if "contact" in self.mix:
            x = x + self.mix["contact"](batch["contacts"])
        x = self.temporal(x.view(windows, rows // windows, -1))
        if self.setting.state_decoder == "linear":
            residual = self.state(x)
        else:
            residual = self.state(x.transpose(1, 2)).transpose(1, 2)
        residual = residual.reshape(rows, -1)
        if self.setting.fade_frames:
            residual = residual * (batch["distances"] / self.setting.fade_frames).clamp(max=1)
        return given + residual, self.contact(x).view(rows, 2)


def product(a, b):
    """Hamilton product of quaternions (x, y, z, w) [.., 4]."""
    ax, ay, az, aw = a.unbind(-1)
    bx, by, bz, bw = b.unbind(-1)
    return torch.stack(
        [
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by + ay * bw + az * bx - ax * bz,
            aw * bz + az * bw + ax * by - ay * bx,
            aw * bw - ax * bx - ay * by - az * bz,
        ],
        -1,
    )


def rotate(q, v):
    """R(q) v of unit quaternions q [.., 4] and vectors v [.., 3]."""
    u, w = q[..., :3], q[..., 3:]
    across = torch.cross(u, v, dim=-1)
    return v + 2 * (w * across + torch.cross(u, across, dim=-1))


def forward_kinematics(rotations, offsets, parents):
    """Unit quaternions [rows, 4 J] and offsets [rows, 3 J] -> positions [rows, J, 3], cm."""
    local = rotations.unflatten(-1, (-1, 4))
    offsets = offsets.unflatten(-1, (-1, 3))
    world, positions = [], []
    for joint, parent in enumerate(parents):
        own, offset = local[:, joint], offsets[:, joint]
        if parent < 0:
            world.append(own)
            positions.append(offset)
        else:
            world.append(product(world[parent], own))
            positions.append(positions[parent] + rotate(world[parent], offset))
    return torch.stack(positions, 1)


def reconstructed_root(positions, weights, windows, feet):
    """Eq. 7 to 11: the root from R_1 [windows, T, 3]; positions [rows, J, 3], weights [rows, 2]."""
    feet = positions[:, list(feet)].unflatten(0, (windows, -1))  # [windows, T, 2, 3]
    weights = weights.unflatten(0, (windows, -1))[..., None]
    steps = -(weights[:, :-1] * (feet[:, 1:] - feet[:, :-1])).sum(2)
    return torch.cat([torch.zeros_like(steps[:, :1]), steps.cumsum(1)], 1)


def normalised(rotations):
    q = rotations.unflatten(-1, (-1, 4))
    return (q / (q.square().sum(-1, keepdim=True) + SMALLEST_SQUARE).sqrt()).flatten(-2)


def losses(rotations, logits, batch, windows, setting, kinematics=forward_kinematics):
    """Eq. 17 to 21, each a scalar by its name."""
    truth = batch["truth.rotations"]
    difference = rotations - truth
    if setting.reconstruction == "norm":
        rec = (difference.square().sum(-1) + SMALLEST_SQUARE).sqrt().mean()
    else:
        rec = difference.square().mean()
    terms = {"rec": rec}
    total = rec
    if setting.contact > 0:
        terms["con"] = -2 * (logits.log_softmax(-1) * batch["contacts"]).sum(-1).mean()
        total = total + setting.contact * terms["con"]
    if setting.position > 0 or setting.root > 0:
        own = kinematics(normalised(rotations), batch["offsets"], setting.parents)
        recorded = kinematics(truth, batch["offsets"], setting.parents)
        if setting.position > 0:
            terms["position"] = ((own - recorded) / setting.units[0]).square().mean()
            total = total + setting.position * terms["position"]
        if setting.root > 0:
            soft = setting.soft_weights and setting.contact > 0
            weights = logits.softmax(-1) if soft else batch["contacts"]
            root = reconstructed_root(own, weights, windows, setting.feet)
            target = reconstructed_root(recorded, batch["contacts"], windows, setting.feet)
            terms["root"] = ((root - target) / setting.units[1]).square().mean()
            total = total + setting.root * terms["root"]
    return terms | {"total": total}


def levels(parents):
    """The joints below the root by their depth, and for each the place of its parent in the level above."""
    depth = [0] * len(parents)
    found = []
    for joint, parent in enumerate(parents):
        if parent < 0:
            continue
        depth[joint] = depth[parent] + 1
        while len(found) < depth[joint]:
            found.append([])
        found[depth[joint] - 1].append(joint)
    above = [[joint for joint, parent in enumerate(parents) if parent < 0], *found]
    return [(ours, [up.index(parents[j]) for j in ours]) for up, ours in zip(above, found)]


def kinematics_by_levels(rotations, offsets, parents):
    """As `forward_kinematics`, the joints of one depth at once, components first: [4, joints, rows]."""
    local = rotations.unflatten(-1, (-1, 4)).permute(2, 1, 0)
    offsets = offsets.unflatten(-1, (-1, 3)).permute(2, 1, 0)
    roots = [joint for joint, parent in enumerate(parents) if parent < 0]
    world, position = local[:, roots], offsets[:, roots]
    order, found = list(roots), [position]
    for joints, above in levels(parents):
        x, y, z, w = world[:, above].unbind()
        own, (a, b, c) = local[:, joints].unbind(), offsets[:, joints].unbind()
        i, j, k = y * c - z * b, z * a - x * c, x * b - y * a
        turned = torch.stack(
            [
                a + 2 * (w * i + y * k - z * j),
                b + 2 * (w * j + z * i - x * k),
                c + 2 * (w * k + x * j - y * i),
            ]
        )
        position = position[:, above] + turned
        world = torch.stack(
            [
                w * own[0] + x * own[3] + y * own[2] - z * own[1],
                w * own[1] + y * own[3] + z * own[0] - x * own[2],
                w * own[2] + z * own[3] + x * own[1] - y * own[0],
                w * own[3] - x * own[0] - y * own[1] - z * own[2],
            ]
        )
        found.append(position)
        order += joints
    places = sorted(range(len(order)), key=order.__getitem__)
    return torch.cat(found, 1)[:, places].permute(2, 1, 0)


def attention_of_few(q, k, v):
    """Heads of a few numbers: products of whole batches beat the blocks of the fused kernel."""
    scores = (q * q.shape[-1] ** -0.5) @ k.transpose(-1, -2)
    return scores.softmax(-1) @ v


def block(x, p, heads):
    """A pre-norm layer; x [sequences, tokens, width], p its weights by name."""
    shape, width = x.shape, x.shape[-1]
    y = functional.layer_norm(x, (width,), p["norm1.weight"], p["norm1.bias"])
    y = functional.linear(y, p["self_attn.in_proj_weight"], p["self_attn.in_proj_bias"])
    q, k, v = y.view(*shape[:2], 3, heads, -1).permute(2, 0, 3, 1, 4)
    few = width // heads < 16
    attend = attention_of_few if few else functional.scaled_dot_product_attention
    y = attend(q, k, v).transpose(1, 2).reshape(shape)
    x = x + functional.linear(y, p["self_attn.out_proj.weight"], p["self_attn.out_proj.bias"])
    y = functional.layer_norm(x, (width,), p["norm2.weight"], p["norm2.bias"])
    y = functional.gelu(functional.linear(y, p["linear1.weight"], p["linear1.bias"]))
    return x + functional.linear(y, p["linear2.weight"], p["linear2.bias"])


def encode(x, p, setting):
    x = x + p["position"][: x.shape[1]]
    for number in range(setting.layers):
        prefix = f"layers.{number}."
        layer = {n[len(prefix) :]: value for n, value in p.items() if n.startswith(prefix)}
        x = block(x, layer, setting.heads)
    return functional.layer_norm(x, x.shape[-1:], p["norm.weight"], p["norm.bias"])


def forward_and_losses(p, batch, windows, setting):
    """Outputs and losses with the parameters `p` by name: one function for a compiler."""

    def inside(prefix):
        return {n[len(prefix) :]: value for n, value in p.items() if n.startswith(prefix)}

    given = batch["input"]
    rows = len(given)
    spatial = inside("spatial.")
    x = functional.linear(given.view(rows, -1, 4), spatial["embed.weight"], spatial["embed.bias"])
    x = encode(x, spatial, setting).reshape(rows, -1)
    for name, code in (("keyframe", "keyframes"), ("contact", "contacts")):
        if f"mix.{name}.weight" in p:
            x = x + functional.linear(batch[code], p[f"mix.{name}.weight"], p[f"mix.{name}.bias"])
    x = encode(x.view(windows, rows // windows, -1), inside("temporal."), setting)
    if setting.state_decoder == "linear":
        residual = functional.linear(x, p["state.weight"], p["state.bias"])
    else:
        frames = x.transpose(1, 2)
        residual = functional.conv1d(frames, p["state.weight"], p["state.bias"], padding=1)
        residual = residual.transpose(1, 2)
    residual = residual.reshape(rows, -1)
    if setting.fade_frames:
        residual = residual * (batch["distances"] / setting.fade_frames).clamp(max=1)
    rotations = given + residual
    logits = functional.linear(x, p["contact.weight"], p["contact.bias"]).view(rows, 2)
    terms = losses(rotations, logits, batch, windows, setting, kinematics_by_levels)
    return rotations, logits, terms


class Plain:
    def __init__(self, model):
        self.model = model

    def __call__(self, batch, windows):
        rotations, logits = self.model(batch, windows)
        return rotations, logits, losses(rotations, logits, batch, windows, self.model.setting)


class Optimised:
    """Runs the parameters of a plain model (they are shared, not copied)."""

    def __init__(self, model, fuse=False):
        self.parameters = dict(model.named_parameters())
        self.setting = model.setting
        compiled = torch.compile(forward_and_losses, dynamic=False) if fuse else forward_and_losses
        self.run = compiled

    def __call__(self, batch, windows):
        return self.run(self.parameters, batch, windows, self.setting)
