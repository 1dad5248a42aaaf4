# SPDX-License-Identifier: MIT OR Apache-2.0
"""Fills the frames between keyed poses of an armature with a dance by keydance.

docs/blender.md says how to use it. The poses go to `keydance generate` as BVH, as they are in the
world, in cm with Y up; what comes back becomes keys of the same action, of a type of their own, so
that the user's keys stay the keyframes of the next fill.
"""

import bisect
import functools
import math
import os
import shutil
import struct
import subprocess
import tempfile
import zlib
from array import array
from collections import namedtuple
from contextlib import contextmanager
from itertools import pairwise

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty
from bpy_extras.io_utils import ExportHelper
from mathutils import Euler, Matrix, Quaternion, Vector

bl_info = {
    "name": "keydance",
    "description": "Fills the frames between keyed poses with a dance",
    "author": "The keydance authors",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "location": "3D View > Sidebar > keydance",
    "category": "Animation",
}

# Models are made to fill so many frames at 30 a second; more are tried.
LONGEST, MODEL_FPS = 250, 30
# Keyframes beside a gap that are sent along, so that the dance enters and leaves it in motion.
CONTEXT = 2
# How tall a body may be to be taken as it is, and what others are made, cm.
BODY_HEIGHT, USUAL_HEIGHT = (90.0, 260.0), 170.0
# How far a joint may be from where it was meant, cm.
TOLERANCE = 0.01
# Seconds until a run is given up.
TIMEOUT = 1800
# The file that goes to the program.
POSES = "poses.bvh"
BVH_CHANNELS = ("Zrotation", "Xrotation", "Yrotation")
POSITIONS = ("Xposition", "Yposition", "Zposition")
PARTS = ("trunk", "left_leg", "right_leg", "right_arm", "left_arm")
ROTATION_PATHS = {
    "QUATERNION": ("rotation_quaternion", 4),
    "AXIS_ANGLE": ("rotation_axis_angle", 4),
}
# How a notice of the program ends that is no warning.
NOTICE = "the result is on it"
# Where an action says which of its keys were generated.
GENERATED = "keydance"

# Turns and places of the joints as BVH has them, cm with Y up.
Pose = namedtuple("Pose", "turns heads")
# A pose, and the values of the bones' channels that make it.
Sample = namedtuple("Sample", "pose values")


class Refused(Exception):
    """What the user can set right: shown as a report."""


@functools.cache
def mark():
    """The type of generated keys, as identifier and number."""
    types = bpy.types.Keyframe.bl_rna.properties["type"].enum_items
    kind = types.get("GENERATED") or types["JITTER"]
    return kind.identifier, kind.value


# --- Rotations -----------------------------------------------------------------------------------


def angles_of(turn, order, near=(0.0, 0.0, 0.0)):
    """Euler angles (x, y, z) of a quaternion, those nearest to `near`; `order` as Blender has it.

    Each angle is measured on what the ones before leave, so that they stay exact together where
    two axes coincide.
    """
    a, b, c = ("XYZ".index(axis) for axis in order)
    sign = 1.0 if (b - a) % 3 == 1 else -1.0
    rows = turn.to_matrix()
    if math.hypot(rows[a][a], rows[b][a]) > 1e-6:
        third = math.atan2(sign * rows[b][a], rows[a][a])
    else:
        third = near[c]
    cos, sin = math.cos(third), sign * math.sin(third)
    along_a = [cos * x + sin * y for x, y in zip(rows[a], rows[b])]
    along_b = [cos * y - sin * x for x, y in zip(rows[a], rows[b])]
    second = math.atan2(-sign * rows[c][a], along_a[a])
    first = math.atan2(-sign * along_b[c], along_b[b])
    candidates = []
    for values in ((first, second, third), (first + math.pi, math.pi - second, third + math.pi)):
        angles = [0.0, 0.0, 0.0]
        for axis, value in zip((a, b, c), values):
            angles[axis] = value + math.tau * round((near[axis] - value) / math.tau)
        candidates.append(angles)
    return min(candidates, key=lambda angles: sum(abs(x - y) for x, y in zip(angles, near)))


def channels_of(turn, mode, before):
    """A rotation as the channels of a rotation mode, near those of the frame before."""
    if mode == "QUATERNION":
        return list(-turn if turn.dot(Quaternion(before)) < 0.0 else turn)
    if mode == "AXIS_ANGLE":
        axis, angle = turn.to_axis_angle()
        earlier = Vector(before[1:])
        if abs(angle) < 1e-6 and earlier.length > 0.0:
            axis = earlier
        if axis.dot(earlier) < 0.0:
            axis, angle = -axis, -angle
        return [angle + math.tau * round((before[0] - angle) / math.tau), *axis]
    return angles_of(turn, mode, before)


def turn_of(channels, mode):
    if mode == "QUATERNION":
        return Quaternion(channels).normalized()
    if mode == "AXIS_ANGLE":
        axis = Vector(channels[1:])
        return Quaternion(axis, channels[0]) if axis.length > 0.0 else Quaternion()
    return Euler(channels, mode).to_quaternion()


# --- The armature --------------------------------------------------------------------------------


def armature_of(context):
    """The armature that is meant: the active object, or the one that deforms it."""
    active = context.object
    if active is not None and active.type != "ARMATURE":
        return active.find_armature()
    return active


@contextmanager
def frames_kept(scene):
    """Puts the scene back to its frame."""
    frame, subframe = scene.frame_current, scene.frame_subframe
    try:
        yield
    finally:
        scene.frame_set(frame, subframe=subframe)


def body_of(obj):
    """Bones of the body, parents first: those that deform and all above them, the largest tree."""
    bones = list(obj.data.bones)
    deforming = [bone for bone in bones if bone.use_deform] or bones
    chosen = {bone.name for bone in deforming}
    chosen.update(above.name for bone in deforming for above in bone.parent_recursive)
    trees = {}
    for bone in bones:
        if bone.name in chosen:
            root = (bone.parent_recursive or [bone])[-1]
            trees.setdefault(root.name, []).append(bone)
    body = max(trees.values(), key=len, default=[])
    if len(body) < 2:
        raise Refused(f"{obj.name} has no body of bones")
    return walk([bone for bone in body if bone.parent is None], {bone.name for bone in body})


def walk(bones, chosen):
    """Bones in the order of a BVH file: each with all below it."""
    order = []
    waiting = list(reversed(bones))
    while waiting:
        bone = waiting.pop()
        order.append(bone)
        waiting.extend(child for child in reversed(bone.children) if child.name in chosen)
    return order


class Rig:
    """The body of an armature in a scene."""

    def __init__(self, context, obj):
        if obj.mode == "EDIT":
            raise Refused("leave Edit Mode first")
        if obj.data.pose_position == "REST":
            raise Refused(f"{obj.name} shows its rest position; switch to Pose Position")
        self.context, self.scene, self.obj = context, context.scene, obj
        self.bones = body_of(obj)
        names = [bone.name for bone in self.bones]
        self.parents = [
            names.index(bone.parent.name) if bone.parent else None for bone in self.bones
        ]
        self.pose_bones = [obj.pose.bones[name] for name in names]
        self.rest = [bone.matrix_local.to_quaternion() for bone in self.bones]
        self.followers = self.constrained()
        self.cm = self.centimetres()
        self.into_bvh = Matrix.Rotation(-math.pi / 2.0, 4, "X") @ Matrix.Scale(self.cm, 4)
        place = self.place()
        self.upright, self.scale = place.to_quaternion(), place.median_scale
        self.fps = self.scene.render.fps / self.scene.render.fps_base

    def constrained(self):
        """Bones that constraints turn and nothing hangs on, such as twist bones: these follow."""
        parents, chains = set(self.parents), set()
        for bone in self.obj.pose.bones:
            for constraint in active_constraints(bone):
                if constraint.type in {"IK", "SPLINE_IK"}:
                    above = [bone, *bone.parent_recursive]
                    chains.update(it.name for it in above[: constraint.chain_count or None])
        followers, held = set(), []
        for index, bone in enumerate(self.pose_bones):
            active = bool(active_constraints(bone))
            if bone.name in chains or active and index in parents:
                held.append(bone.name)
            elif active:
                followers.add(index)
        if held:
            raise Refused(
                f"constraints move {listed(held)}; bake the poses first (Pose > Animation > Bake "
                "Action, with Visual Keying and Clear Constraints)"
            )
        return followers

    def world(self):
        """The armature's place in the world at the scene's frame."""
        graph = self.context.evaluated_depsgraph_get()
        return self.obj.evaluated_get(graph).matrix_world

    def place(self):
        """The same as BVH has it."""
        return self.into_bvh @ self.world()

    def centimetres(self):
        """In a unit of the world: as the scene has it where that makes a person."""
        world = self.world()
        scales = [Vector(column[:3]).length for column in world.col[:3]]
        if world.determinant() <= 0.0 or max(scales) > min(scales) * 1.0001:
            raise Refused(
                f"{self.obj.name} is scaled unevenly or mirrored; apply its scale (Ctrl A)"
            )
        points = [
            world @ point for bone in self.bones for point in (bone.head_local, bone.tail_local)
        ]
        size = max(max(axis) - min(axis) for axis in zip(*points))
        if size <= 0.0:
            raise Refused(f"{self.obj.name} has no size")
        unit = 100.0 * (self.scene.unit_settings.scale_length or 1.0)
        return unit if BODY_HEIGHT[0] <= size * unit <= BODY_HEIGHT[1] else USUAL_HEIGHT / size

    def moves_itself(self):
        """Whether the armature may be elsewhere at every frame."""
        animation = self.obj.animation_data
        own = any(not curve.data_path.startswith("pose.") for curve in curves_of(self.obj))
        return bool(own or self.obj.parent or self.obj.constraints or animation.drivers)

    def pose(self, place):
        """The evaluated pose at the scene's frame."""
        graph = self.context.evaluated_depsgraph_get()
        posed = self.obj.evaluated_get(graph).pose.bones
        around = place.to_quaternion()
        turns, heads = [], []
        for bone, rest in zip(self.bones, self.rest):
            matrix = posed[bone.name].matrix
            if max(abs(scale - 1.0) for scale in matrix.to_scale()) > 1e-3:
                raise Refused(
                    f"{bone.name} is scaled at frame {self.scene.frame_current}; "
                    "a dance has bones of one size"
                )
            turn = around @ matrix.to_quaternion() @ rest.inverted() @ self.upright.inverted()
            turns.append(turn.normalized())
            heads.append(place @ matrix.translation)
        return Pose(turns, heads)

    def locals(self, pose):
        """Rotation and translation of each joint in its parent."""
        for parent, turn, head in zip(self.parents, pose.turns, pose.heads):
            if parent is None:
                yield turn, head
            else:
                back = pose.turns[parent].inverted()
                yield back @ turn, back @ (head - pose.heads[parent])

    def offset(self, index):
        """From the parent's joint to a joint at rest, cm."""
        parent = self.parents[index]
        if parent is None:
            return Vector()
        along = self.bones[index].head_local - self.bones[parent].head_local
        return self.upright @ (along * self.scale)

    def bases(self, turns, heads, place):
        """Location and rotation of each pose bone for joints in the world."""
        around, back = place.to_quaternion().inverted(), place.inverted()
        matrices = []
        for index, bone in enumerate(self.bones):
            turn = around @ turns[index] @ self.upright @ self.rest[index]
            head = back @ heads[index]
            matrix = Matrix.Translation(head) @ turn.to_matrix().to_4x4()
            above = {}
            if self.parents[index] is not None:
                above = {
                    "parent_matrix": matrices[self.parents[index]],
                    "parent_matrix_local": bone.parent.matrix_local,
                }
            basis = bone.convert_local_to_pose(matrix, bone.matrix_local, invert=True, **above)
            matrices.append(matrix)
            yield basis.to_translation(), basis.to_quaternion()


def active_constraints(bone):
    return [it for it in bone.constraints if not it.mute and it.influence > 0.0]


def listed(names):
    more = f" and {len(names) - 3} more" if len(names) > 3 else ""
    return ", ".join(names[:3]) + more


# --- Keys ----------------------------------------------------------------------------------------


def bag_of(obj):
    """What holds an armature's curves: its action, or from Blender 4.4 on a part of it."""
    animation = obj.animation_data
    if animation is None or animation.action is None:
        return None
    action = animation.action
    slot = getattr(animation, "action_slot", None)
    if slot is None or not getattr(action, "layers", None):
        return action if hasattr(action, "fcurves") else None
    return action.layers[0].strips[0].channelbag(slot, ensure=True)


def curves_of(obj):
    bag = bag_of(obj)
    return bag.fcurves if bag else []


def channels(bone):
    """Data paths and sizes of a pose bone's rotation in its mode, and of its location."""
    name, size = ROTATION_PATHS.get(bone.rotation_mode, ("rotation_euler", 3))
    return (bone.path_from_id(name), size), (bone.path_from_id("location"), 3)


def values_of(bone):
    """The same channels' values."""
    name, _ = ROTATION_PATHS.get(bone.rotation_mode, ("rotation_euler", 3))
    return list(getattr(bone, name)), list(bone.location)


def keys_of(curve):
    """Frame, value and type of each key."""
    points = curve.keyframe_points
    places, types = array("f", bytes(8 * len(points))), array("i", bytes(4 * len(points)))
    points.foreach_get("co", places)
    points.foreach_get("type", types)
    return list(zip(places[::2], places[1::2], types))


def frames_of(curve):
    return [frame for frame, _, _ in keys_of(curve)]


class Keys:
    """The keys of a body."""

    def __init__(self, obj, bones):
        self.obj = obj
        if bag_of(obj) is None:
            raise Refused(f"{obj.name} has no keyed poses; key two poses or more")
        self.action = obj.animation_data.action
        if self.action.library:
            raise Refused(f"the action {self.action.name} is linked; make it local first")
        self.bones = bones
        paths = {path for bone in bones for path, _ in channels(bone)}
        paths.update(bone.path_from_id("scale") for bone in bones)
        curves = [curve for curve in curves_of(obj) if curve.data_path in paths]
        self.curves = {(curve.data_path, curve.array_index): curve for curve in curves}
        self.generated = set(self.action.get(GENERATED, ()))

    def digests(self, place, keys):
        """What the action remembers of generated keys; None for those of another type."""
        (path, index), kind = place, mark()[1]
        seed = zlib.crc32(f"{path}[{index}]".encode())
        return [
            zlib.crc32(struct.pack("f", value), seed) - (1 << 31) if of_type == kind else None
            for _, value, of_type in keys
        ]

    def are_generated(self, place, keys):
        """Whether each key is as it was generated: of no other type, no other value."""
        return [digest in self.generated for digest in self.digests(place, keys)]

    def frames(self):
        """Frames that the user keyed, ascending."""
        frames = set()
        for place, curve in self.curves.items():
            keys = keys_of(curve)
            pairs = zip(keys, self.are_generated(place, keys))
            frames.update(frame for (frame, _, _), generated in pairs if not generated)
        return sorted(frames)

    def shown_frames(self):
        """The same by the types of keys alone: quick enough to draw."""
        kind, frames = mark()[1], set()
        for curve in self.curves.values():
            points = curve.keyframe_points
            types = array("i", bytes(4 * len(points)))
            points.foreach_get("type", types)
            frames.update(points[at].co[0] for at, own in enumerate(types) if own != kind)
        return sorted(frames)

    def promote(self):
        """Gives generated keys that the user changed since the type of keyframes."""
        if not self.generated:
            return
        for place, curve in self.curves.items():
            keys = keys_of(curve)
            for at, generated in enumerate(self.are_generated(place, keys)):
                if keys[at][2] == mark()[1] and not generated:
                    curve.keyframe_points[at].type = "KEYFRAME"

    def curve(self, bone, path, index):
        """The curve of a channel, a new one where there is none."""
        curve = self.curves.get((path, index))
        if curve is None:
            bag = bag_of(self.obj)
            curve = bag.fcurves.new(path, index=index)
            curve.group = bag.groups.get(bone.name) or bag.groups.new(bone.name)
            self.curves[path, index] = curve
        return curve

    def clear(self, gaps):
        """Removes what is inside gaps; how many keys that were."""
        inside = {frame for start, end in gaps for frame in range(start + 1, end)}
        removed = 0
        for curve in self.curves.values():
            keys = [at for at, frame in enumerate(frames_of(curve)) if frame in inside]
            for at in reversed(keys):
                curve.keyframe_points.remove(curve.keyframe_points[at], fast=True)
            if keys:
                curve.update()
            removed += len(keys)
        return removed

    def set(self, place, rows):
        """Sets generated keys, values by frame, in a curve that has none between the first and the
        last of them."""
        first = bisect.bisect(frames_of(self.curves[place]), min(rows))
        insert_keys(self.curves[place].keyframe_points, first, rows)
        self.generated.update(
            self.digests(place, [(0, value, mark()[1]) for value in rows.values()])
        )

    def split(self, place, frame, value):
        """Sets one that leaves the curve on both sides as it is."""
        curve = self.curves[place]
        hold_shape(curve, [frame])
        point = curve.keyframe_points.insert(frame, value)
        point.type = mark()[0]
        self.generated.update(self.digests(place, [(frame, point.co[1], mark()[1])]))
        hold_shape(curve, [frame])

    def remember(self):
        """Writes down which keys are generated ones."""
        there = set()
        for place, curve in self.curves.items():
            there.update(self.digests(place, keys_of(curve)))
        self.action[GENERATED] = sorted(there & self.generated)


HANDLE_TYPES = ("handle_left_type", "handle_right_type")


@functools.cache
def columns():
    """What a key consists of, but for its handles' types: name, type code and size."""
    codes = {"FLOAT": "f", "ENUM": "i", "BOOLEAN": "b"}
    return [
        (it.identifier, codes[it.type], getattr(it, "array_length", 0) or 1)
        for it in bpy.types.Keyframe.bl_rna.properties
        if not it.is_readonly and it.identifier not in {"co_ui", *HANDLE_TYPES}
    ]


def insert_keys(points, at, rows):
    """Inserts linear generated keys, values by frame, before the key `at`, all at once."""
    linear = bpy.types.Keyframe.bl_rna.properties["interpolation"].enum_items["LINEAR"].value
    count = len(rows)
    places = [number for row in sorted(rows.items()) for number in row]
    new = {name: places for name in ("co", "handle_left", "handle_right")}
    new |= {"interpolation": [linear] * count, "type": [mark()[1]] * count}
    before = {}
    for name, code, size in columns():
        before[name] = array(code, bytes(array(code).itemsize * size * len(points)))
        points.foreach_get(name, before[name])
    # Blender 3.4 reads and writes these wrongly as a column.
    handles = {name: [getattr(point, name) for point in points] for name in HANDLE_TYPES}
    points.add(count)
    for name, types in handles.items():
        types[at:at] = ["AUTO_CLAMPED"] * count
        for point, of_type in zip(points[at:], types[at:]):
            if getattr(point, name) != of_type:
                setattr(point, name, of_type)
    for name, code, size in columns():
        block = array(code, new.get(name, [0] * size * count))
        values = before[name]
        points.foreach_set(name, values[: at * size] + block + values[at * size :])


def keys_of_body(obj):
    return Keys(obj, [obj.pose.bones[bone.name] for bone in body_of(obj)])


def hold_shape(curve, frames):
    """Keeps the curve around some frames as it is: its handles would follow new keys."""
    at = frames_of(curve)
    for frame in frames:
        first, last = bisect.bisect_left(at, frame) - 1, bisect.bisect_right(at, frame)
        for point in curve.keyframe_points[max(first, 0) : last + 1]:
            point.handle_left_type = point.handle_right_type = "FREE"


# --- BVH -----------------------------------------------------------------------------------------


def write_bvh(path, rig, poses, moving):
    """Poses one after the other; joints in `moving` have positions."""
    lines = ["HIERARCHY"]
    depth = 0
    for index, bone in enumerate(rig.bones):
        parent = rig.parents[index]
        level = len(bone.parent_recursive)
        for at in range(depth - 1, level - 1, -1):
            lines.append("  " * at + "}")
        depth = level + 1
        pad = "  " * level
        names = (POSITIONS if index in moving else ()) + BVH_CHANNELS
        name = " ".join(bone.name.split())
        lines += [
            f"{pad}{'ROOT' if parent is None else 'JOINT'} {name}",
            pad + "{",
            f"{pad}  OFFSET {numbers(rig.offset(index))}",
            f"{pad}  CHANNELS {len(names)} {' '.join(names)}",
        ]
        if index not in rig.parents:
            end = rig.upright @ (bone.tail_local - bone.head_local) * rig.scale
            lines += [
                f"{pad}  End Site",
                pad + "  {",
                f"{pad}    OFFSET {numbers(end)}",
                pad + "  }",
            ]
    lines += ["  " * at + "}" for at in range(depth - 1, -1, -1)]
    lines += ["MOTION", f"Frames: {len(poses)}", f"Frame Time: {1.0 / rig.fps:.12f}"]
    for pose in poses:
        row = []
        for index, (turn, translation) in enumerate(rig.locals(pose)):
            if index in moving:
                row.extend(translation)
            x, y, z = (math.degrees(angle) for angle in angles_of(turn, "YXZ"))
            row.extend((z, x, y))
        lines.append(numbers(row))
    with open(path, "w", encoding="utf-8") as file:
        file.write("\n".join(lines) + "\n")


def numbers(values):
    return " ".join(f"{value:.9f}" for value in values)


def read_bvh(path, rig):
    """The poses of a file that is on the same rig."""
    with open(path, encoding="utf-8") as file:
        lines = [line.split() for line in file]
    layout = [words[2:] for words in lines if words[:1] == ["CHANNELS"]]
    start = next(at for at, words in enumerate(lines) if words[:1] == ["Frames:"])
    rows = [[float(word) for word in words] for words in lines[start + 2 :] if words]
    if len(layout) != len(rig.bones) or len(rows) != int(lines[start][1]):
        raise Refused("keydance wrote a motion of another rig; is the program up to date?")
    offsets = [rig.offset(index) for index in range(len(rig.bones))]
    return [pose_of_row(row, layout, offsets, rig.parents) for row in rows]


def pose_of_row(row, layout, offsets, parents):
    turns, heads = [], []
    values = iter(row)
    for names, offset, parent in zip(layout, offsets, parents):
        turn, translation = Quaternion(), offset.copy()
        for name in names:
            value, axis = next(values), "XYZ".index(name[0])
            if name.endswith("position"):
                translation[axis] = value
            else:
                along = Vector((axis == 0, axis == 1, axis == 2))
                turn = turn @ Quaternion(along, math.radians(value))
        if parent is not None:
            translation = heads[parent] + turns[parent] @ translation
            turn = turns[parent] @ turn
        turns.append(turn.normalized())
        heads.append(translation)
    return Pose(turns, heads)


# --- The program ---------------------------------------------------------------------------------


def preferences(context):
    return context.preferences.addons[__name__].preferences


def file_path(text):
    return os.path.expanduser(bpy.path.abspath(text))


def program(context):
    """The path of the program, and the run to name to it, if any."""
    chosen = preferences(context)
    binary = shutil.which(file_path(chosen.binary))
    if binary is None:
        raise Refused(
            f"there is no program {chosen.binary!r}; choose keydance in the add-on's preferences"
        )
    return binary, [file_path(chosen.run)] if chosen.run.strip() else []


def run_program(binary, arguments, obj):
    """Runs the program; what it warned of, with the armature in place of the file."""
    try:
        done = subprocess.run(
            [binary, *arguments],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=TIMEOUT,
            check=False,
            encoding="utf-8",
            errors="replace",
            creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
        )
    except OSError as error:
        raise Refused(f"{binary} cannot be run: {error.strerror}") from error
    except subprocess.TimeoutExpired as error:
        raise Refused(f"keydance did not end within {TIMEOUT} seconds") from error
    said = done.stderr.replace(POSES, obj.name)
    if done.returncode != 0:
        error, unrecognised, _ = " ".join(said.split("error:")[-1].split()).partition(
            "; keydance rig "
        )
        if unrecognised:
            error += "; write a mapping file (the button beside Mapping) and edit it"
        raise Refused(error or f"keydance ended with code {done.returncode}")
    lines = [line.partition("warning:")[2].strip() for line in said.splitlines()]
    return [line for line in lines if line]


def generate(context, rig, folder, arguments):
    """Has the file of poses in a folder filled; the poses made, and what it warned of."""
    binary, run = program(context)
    motion, out = os.path.join(folder, POSES), os.path.join(folder, "filled.bvh")
    arguments = [
        "generate",
        *run,
        "--motion",
        motion,
        "--own-frames",
        "--unit",
        "cm",
        "--up",
        "y",
        "--out",
        out,
        *arguments,
    ]
    warnings = run_program(binary, arguments, rig.obj)
    return read_bvh(out, rig), warnings


@contextmanager
def written(rig, poses, moving):
    """A folder with a file of poses, for as long as it is needed."""
    try:
        with tempfile.TemporaryDirectory(prefix="keydance-") as folder:
            write_bvh(os.path.join(folder, POSES), rig, poses, moving)
            yield folder
    except OSError as error:
        raise Refused(f"the motion cannot be written or read: {error}") from error


def options_of(settings, cm):
    """The controls as options of the program."""
    options = []
    factors = [(part, settings.velocity * getattr(settings, part)) for part in PARTS]
    changed = [f"{part}={factor:.6g}" for part, factor in factors if abs(factor - 1.0) > 1e-6]
    if changed:
        options += ["--velocity", ",".join(changed)]
    if settings.rise:
        options += ["--raise", f"{cm * settings.rise:.6g}"]
    if settings.foot_cleanup:
        options.append("--foot-cleanup")
    if settings.mapping.strip():
        options += ["--mapping", file_path(settings.mapping)]
    return options


# --- Filling -------------------------------------------------------------------------------------


def gaps_between(frames):
    return [(start, end) for start, end in pairwise(frames) if end - start > 1]


def runs_of(gaps):
    """Gaps that follow one another, together."""
    runs = []
    for gap in gaps:
        if runs and runs[-1][-1][1] == gap[0]:
            runs[-1].append(gap)
        else:
            runs.append([gap])
    return runs


def around(run, frames, longest):
    """The keyframes of a run of gaps with some on both sides, none across a gap too long."""
    first, last = frames.index(run[0][0]), frames.index(run[-1][1])
    for _ in range(CONTEXT):
        if first > 0 and frames[first] - frames[first - 1] <= longest:
            first -= 1
        if last + 1 < len(frames) and frames[last + 1] - frames[last] <= longest:
            last += 1
    return frames[first : last + 1]


class Filling:
    """One press of Fill."""

    def __init__(self, context, obj, settings):
        self.context, self.settings = context, settings
        self.scene = context.scene
        self.rig = Rig(context, obj)
        self.keys = Keys(obj, self.rig.pose_bones)
        self.frames = chosen_frames(self.keys, settings)
        if len(self.frames) < 2:
            found = f"at frame {self.frames[0]} only" if self.frames else "nowhere"
            raise Refused(
                f"{obj.name} is keyed {found} in the chosen frames; key two poses or more"
            )
        self.samples, self.warnings = {}, []
        self.longest = LONGEST * self.rig.fps / MODEL_FPS

    def fill(self, gaps):
        program(self.context)
        runs = [(run, around(run, self.frames, self.longest)) for run in runs_of(gaps)]
        with frames_kept(self.scene):
            self.sample(runs)
            moving = self.moving()
            made = {}
            for run, keyframes in runs:
                made.update(self.made(run, keyframes, moving))
            self.keys.promote()
            self.keys.clear(gaps)
            for run, _ in runs:
                self.write(run, made, moving)
            self.keys.remember()
            self.scene.frame_end = max(self.scene.frame_end, gaps[-1][1])
            self.keys.action.update_tag()
            self.check(gaps, made)

    def sample(self, runs):
        """Looks at all frames that are sent, and where the armature is where it moves."""
        whole = self.settings.between == "MOTION"
        wanted = set()
        for _, keyframes in runs:
            wanted.update(range(keyframes[0], keyframes[-1] + 1) if whole else keyframes)
        inside = {frame for run, _ in runs for start, end in run for frame in range(start, end)}
        self.places = {}
        frames = wanted | inside if self.rig.moves_itself() else wanted
        for frame in sorted(frames):
            self.scene.frame_set(frame)
            place = self.rig.place()
            self.places[frame] = place
            if frame in wanted:
                values = [values_of(bone) for bone in self.rig.pose_bones]
                self.samples[frame] = Sample(self.rig.pose(place), values)
        for frame in inside - frames:
            self.places[frame] = place

    def moving(self):
        """Joints that have positions: the root, those that leave their place, those keyed to."""
        moving = {0}
        for index, bone in enumerate(self.rig.bones):
            path = self.rig.pose_bones[index].path_from_id("location")
            if not bone.use_connect and any((path, axis) in self.keys.curves for axis in range(3)):
                moving.add(index)
        offsets = [self.rig.offset(index) for index in range(len(self.rig.bones))]
        for sample in self.samples.values():
            for index, (_, translation) in enumerate(self.rig.locals(sample.pose)):
                if (translation - offsets[index]).length > TOLERANCE / 10.0:
                    moving.add(index)
        return moving

    def made(self, run, keyframes, moving):
        """The generated poses inside the gaps of a run, by frame."""
        if self.settings.between == "MOTION":
            rows = range(keyframes[0], keyframes[-1] + 1)
            times = ["--keyframes", joined(frame - keyframes[0] for frame in keyframes)]
        else:
            rows = keyframes
            lengths = (end - start for start, end in pairwise(keyframes))
            times = ["--keyframes", joined(range(len(rows))), "--length", joined(lengths)]
        times += options_of(self.settings, self.rig.cm)
        sent = [self.samples[frame].pose for frame in rows]
        with written(self.rig, sent, moving) as folder:
            poses, warnings = generate(self.context, self.rig, folder, times)
        if len(poses) != keyframes[-1] - keyframes[0] + 1:
            raise Refused(f"keydance made {len(poses)} frames of another rate")
        self.warnings += warnings
        self.meets(poses, keyframes)
        return {
            frame: poses[frame - keyframes[0]]
            for start, end in run
            for frame in range(start + 1, end)
        }

    def meets(self, poses, keyframes):
        """Says by how much the result misses the keyed poses."""
        for frame in keyframes:
            apart = furthest(poses[frame - keyframes[0]].heads, self.samples[frame].pose.heads)
            if apart > TOLERANCE:
                self.warnings.append(
                    f"the result is {10.0 * apart:.1f} mm from the pose at frame {frame}"
                )

    def write(self, run, made, moving):
        """Keys what was made in the gaps of a run, and at its keyframes what has no key there."""
        rig = self.rig
        basis = {
            frame: list(rig.bases(*made[frame], self.places[frame]))
            for start, end in run
            for frame in range(start + 1, end)
        }
        for index, bone in enumerate(rig.pose_bones):
            if index in rig.followers:
                continue
            (turn_path, turn_size), (path, size) = channels(bone)
            located = {frame: basis[frame][index][0] for frame in basis}
            if index in moving and not self.is_there(path, located, self.start(run, index, 1)):
                self.write_channels(run, bone, path, size, located, (index, 1))
            turned = {}
            for start, end in run:
                near = self.samples[start].values[index][0]
                for frame in range(start + 1, end):
                    near = channels_of(basis[frame][index][1], bone.rotation_mode, near)
                    turned[frame] = near
            self.write_channels(run, bone, turn_path, turn_size, turned, (index, 0))
            self.hold_before_jumps(run, bone, turned, index)

    def start(self, run, index, kind):
        return self.samples[run[0][0]].values[index][kind]

    def is_there(self, path, rows, values):
        """Whether a bone's location is this without keys; `values` where it has no curves."""
        near = TOLERANCE / 10.0 / self.rig.scale
        for axis, value in enumerate(values):
            curve = self.keys.curves.get((path, axis))
            for frame, wanted in rows.items():
                there = curve.evaluate(frame) if curve else value
                if abs(there - wanted[axis]) > near:
                    return False
        return True

    def write_channels(self, run, bone, path, size, rows, which):
        index, kind = which
        ends = {run[0][0], run[-1][1]}
        for axis in range(size):
            curve, place = self.keys.curve(bone, path, axis), (path, axis)
            hold_shape(curve, ends)
            keyed = set(frames_of(curve))
            for frame in {frame for gap in run for frame in gap} - keyed:
                value = self.samples[frame].values[index][kind][axis]
                if frame in ends:
                    self.keys.split(place, frame, value)
                else:
                    self.keys.set(place, {frame: value})
            for start, end in run:
                inside = range(start + 1, end)
                self.keys.set(place, {frame: rows[frame][axis] for frame in inside})
            curve.update()

    def hold_before_jumps(self, run, bone, turned, index):
        """Holds the frame before a keyed pose whose channels count their turns otherwise."""
        (path, size), _ = channels(bone)
        for _, end in run:
            keyed = self.samples[end].values[index][0]
            last = turned[end - 1]
            near = channels_of(turn_of(keyed, bone.rotation_mode), bone.rotation_mode, last)
            if max(abs(x - y) for x, y in zip(keyed, near)) < 0.5:
                continue
            for axis in range(size):
                curve = self.keys.curves[path, axis]
                at = bisect.bisect_left(frames_of(curve), end - 1)
                curve.keyframe_points[at].interpolation = "CONSTANT"

    def check(self, gaps, made):
        """Says where the armature plays otherwise than meant: a modifier, a driver, the NLA."""
        meant = {frame: self.samples[frame].pose for gap in gaps for frame in gap}
        for start, end in gaps:
            middle = (start + end) // 2
            meant[middle] = made[middle]
        worst = (0.0, 0)
        for frame in sorted(meant):
            self.scene.frame_set(frame)
            pose = self.rig.pose(self.rig.place())
            worst = max(worst, (furthest(pose.heads, meant[frame].heads), frame))
        if worst[0] > TOLERANCE:
            self.warnings.append(
                f"at frame {worst[1]} joints play {10.0 * worst[0]:.1f} mm from where they were "
                "meant: look for drivers, curve modifiers and NLA strips"
            )


def furthest(points, others):
    return max((a - b).length for a, b in zip(points, others))


def counted(number, noun):
    return f"{number} {noun}{'' if number == 1 else 's'}"


def joined(values):
    return ",".join(str(value) for value in values)


def chosen_frames(keys, settings):
    """The user's keyframes in the chosen frames."""
    frames = in_range(keys.frames(), settings)
    for frame in frames:
        if frame != round(frame):
            raise Refused(
                f"a key is at frame {frame:.2f}, between two frames; snap keys to whole "
                "frames (Dope Sheet > Key > Snap > Nearest Frame)"
            )
    return [int(frame) for frame in frames]


def in_range(frames, settings):
    if not settings.use_range:
        return frames
    return [frame for frame in frames if settings.first <= frame <= settings.last]


def gap_at(frames, frame):
    """The gap around a frame: on a keyframe the one after it, on the last the one before."""
    gaps = [gap for gap in pairwise(frames) if gap[0] <= frame <= gap[1]]
    return gaps[-1] if gaps else None


# --- Blender -------------------------------------------------------------------------------------


class KeydancePreferences(bpy.types.AddonPreferences):
    bl_idname = __name__

    binary: StringProperty(
        name="Program",
        subtype="FILE_PATH",
        default="keydance",
        description="The keydance program; its name alone where it is on the PATH",
    )
    run: StringProperty(
        name="Run",
        subtype="DIR_PATH",
        description="Folder of a trained run; empty for the model that comes with the program",
    )

    def draw(self, _context):
        self.layout.prop(self, "binary")
        self.layout.prop(self, "run")


def factor(name):
    return FloatProperty(
        name=name,
        default=1.0,
        min=0.0,
        soft_max=3.0,
        step=10,
        description="How fast this part moves, beside what the model is asked for else",
    )


class KeydanceSettings(bpy.types.PropertyGroup):
    use_range: BoolProperty(
        name="Frame Range", description="Fill between these frames only, else between all keys"
    )
    first: IntProperty(name="First", default=1)
    last: IntProperty(name="Last", default=250)
    between: EnumProperty(
        name="Path",
        items=(
            ("POSES", "Smooth", "The root goes along a smooth curve through the keyed poses"),
            ("MOTION", "As It Is", "Root path and velocities are those of the present motion"),
        ),
    )
    velocity: factor("Velocity")
    trunk: factor("Trunk")
    left_leg: factor("Left Leg")
    right_leg: factor("Right Leg")
    right_arm: factor("Right Arm")
    left_arm: factor("Left Arm")
    rise: FloatProperty(
        name="Raise",
        subtype="DISTANCE",
        soft_min=-1.0,
        soft_max=1.0,
        description="How much higher the root goes halfway between two keyed poses",
    )
    foot_cleanup: BoolProperty(
        name="Hold Feet", description="Hold feet still where they are on the ground, and above it"
    )
    mapping: StringProperty(
        name="Mapping",
        subtype="FILE_PATH",
        description="Mapping file, for a rig whose joints are not recognised by their names",
    )


class KeydanceOperator:
    """An operator on the armature that is meant."""

    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        obj = armature_of(context)
        return obj is not None and obj.mode != "EDIT"

    def execute(self, context):
        try:
            self.act(context, armature_of(context), context.scene.keydance)
        except Refused as refused:
            self.report({"ERROR"}, str(refused))
            return {"CANCELLED"}
        return {"FINISHED"}

    def fill(self, context, filling, gaps):
        window = context.window
        if window is not None:
            window.cursor_set("WAIT")
        try:
            filling.fill(gaps)
        finally:
            if window is not None:
                window.cursor_set("DEFAULT")
        for warning in dict.fromkeys(filling.warnings):
            self.report({"INFO" if warning.endswith(NOTICE) else "WARNING"}, warning)
        filled = sum(end - start - 1 for start, end in gaps)
        said = f"Filled {counted(filled, 'frame')} in {counted(len(gaps), 'gap')}"
        self.report({"INFO"}, said)


class KEYDANCE_OT_fill(KeydanceOperator, bpy.types.Operator):
    bl_idname = "keydance.fill"
    bl_label = "Fill"
    bl_description = "Fill the frames between all keyed poses with a dance"

    def act(self, context, obj, settings):
        filling = Filling(context, obj, settings)
        gaps = gaps_between(filling.frames)
        if not gaps:
            raise Refused("there are no frames between the keyed poses")
        self.fill(context, filling, gaps)


class KEYDANCE_OT_fill_gap(KeydanceOperator, bpy.types.Operator):
    bl_idname = "keydance.fill_gap"
    bl_label = "Fill This Gap"
    bl_description = (
        "Fill the gap around the current frame alone; all other frames stay as they are"
    )

    def act(self, context, obj, settings):
        filling = Filling(context, obj, settings)
        gap = gap_at(filling.frames, context.scene.frame_current)
        if gap is None or gap[1] - gap[0] < 2:
            raise Refused(f"frame {context.scene.frame_current} is not between two keyed poses")
        self.fill(context, filling, [gap])


class KEYDANCE_OT_keep(KeydanceOperator, bpy.types.Operator):
    bl_idname = "keydance.keep"
    bl_label = "Keep This Pose"
    bl_description = "Make the generated pose at the current frame a keyframe of the next fill"

    def act(self, context, obj, settings):
        frame = context.scene.frame_current
        points = [
            curve.keyframe_points[at]
            for curve in keys_of_body(obj).curves.values()
            for at, key in enumerate(frames_of(curve))
            if key == frame
        ]
        if not points:
            raise Refused(f"there is no generated pose at frame {frame}")
        for point in points:
            point.type = "KEYFRAME"


class KEYDANCE_OT_clear(KeydanceOperator, bpy.types.Operator):
    bl_idname = "keydance.clear"
    bl_label = "Clear"
    bl_description = "Remove what was generated between the keyed poses"

    def act(self, context, obj, settings):
        keys = keys_of_body(obj)
        keys.promote()
        frames = chosen_frames(keys, settings)
        if not keys.clear(gaps_between(frames)):
            raise Refused("there is nothing generated between the keyed poses")
        keys.remember()


class KEYDANCE_OT_mapping(KeydanceOperator, ExportHelper, bpy.types.Operator):
    bl_idname = "keydance.mapping"
    bl_label = "Write Mapping File"
    bl_description = "Write which bones were recognised, to be edited where they are not all right"
    bl_options = {"REGISTER"}
    filename_ext = ".toml"

    def act(self, context, obj, settings):
        rig = Rig(context, obj)
        binary, _ = program(context)
        with written(rig, [rig.pose(rig.place())], {0}) as folder:
            motion = os.path.join(folder, POSES)
            run_program(binary, ["rig", motion, "--out", self.filepath, "--force"], obj)
        settings.mapping = self.filepath


class KEYDANCE_PT_panel(bpy.types.Panel):
    bl_label = "keydance"
    bl_category = "keydance"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        obj, settings = armature_of(context), context.scene.keydance
        if obj is None:
            layout.label(text="Select an armature", icon="ARMATURE_DATA")
            return
        layout.prop(settings, "use_range")
        if settings.use_range:
            layout.prop(settings, "first")
            layout.prop(settings, "last")
        layout.prop(settings, "between")
        column = layout.column(align=True)
        column.prop(settings, "velocity")
        for part in PARTS:
            column.prop(settings, part)
        layout.prop(settings, "rise")
        layout.prop(settings, "foot_cleanup")
        row = layout.row(align=True)
        row.prop(settings, "mapping")
        row.operator("keydance.mapping", text="", icon="FILE_NEW")
        if not context.screen.is_animation_playing:
            draw_gaps(layout.column(align=True), context.scene, obj)
        column = layout.column(align=True)
        column.operator("keydance.fill", icon="ACTION")
        column.operator("keydance.fill_gap")
        row = layout.row(align=True)
        row.operator("keydance.keep")
        row.operator("keydance.clear")


def draw_gaps(layout, scene, obj):
    """How many keyframes there are, and which gaps are longer than models are made for."""
    try:
        keys = keys_of_body(obj)
    except Refused as refused:
        layout.label(text=str(refused), icon="INFO")
        return
    frames = in_range(keys.shown_frames(), scene.keydance)
    layout.label(text=f"{obj.name}: keyed at {counted(len(frames), 'frame')}", icon="KEYFRAME_HLT")
    longest = LONGEST * scene.render.fps / scene.render.fps_base / MODEL_FPS
    for start, end in gaps_between(frames):
        if end - start > longest:
            layout.label(
                text=f"{start:.0f} to {end:.0f}: more than the {longest:.0f} frames of models",
                icon="ERROR",
            )


CLASSES = (
    KeydancePreferences,
    KeydanceSettings,
    KEYDANCE_OT_fill,
    KEYDANCE_OT_fill_gap,
    KEYDANCE_OT_keep,
    KEYDANCE_OT_clear,
    KEYDANCE_OT_mapping,
    KEYDANCE_PT_panel,
)


def register():
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Scene.keydance = bpy.props.PointerProperty(type=KeydanceSettings)


def unregister():
    del bpy.types.Scene.keydance
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
