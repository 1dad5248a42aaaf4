# SPDX-License-Identifier: MIT OR Apache-2.0
"""Tests of the add-on inside Blender; scripts/blender/test runs them."""

import math
import os
import pathlib
import random
import shutil
import sys
import tempfile
import traceback
import unittest.mock

import bpy
from mathutils import Euler, Matrix, Quaternion, Vector

HERE = pathlib.Path(__file__).resolve().parent
REPOSITORY = HERE.parent.parent
INTERPOLATION = REPOSITORY / "experiments/pan2021/interpolation.toml"
CLOSE = 1e-4  # m

# Joints in a T-pose, m, Z up: name, parent, head. "%" is a side; the left is at x > 0.
TRUNK = "Hips . 0 0 .98"
LEGS = """
    %UpLeg Hips .09 0 .93
    %Leg %UpLeg .1 -.01 .5
    %Foot %Leg .1 .02 .09
    %ToeBase %Foot .1 -.11 .02"""
# The order of the dance skeleton, which has the right arm first.
ARMS = """
    RightShoulder {chest} -.04 0 1.42
    LeftShoulder {chest} .04 0 1.42
    %Arm %Shoulder .17 .01 1.42
    %ForeArm %Arm .45 .02 1.42
    %Hand %ForeArm .7 0 1.42"""
FINGERS = """
    %HandThumb1 %Hand .72 -.03 1.4
    %HandThumb2 %HandThumb1 .75 -.05 1.39
    %HandIndex1 %Hand .79 -.02 1.42
    %HandIndex2 %HandIndex1 .83 -.02 1.42"""
OURS = (
    TRUNK
    + LEGS
    + """
    Spine Hips 0 0 1.06
    Spine1 Spine 0 .01 1.15
    Spine2 Spine1 0 .01 1.23
    Spine3 Spine2 0 .01 1.3
    Spine4 Spine3 0 .01 1.37"""
    + ARMS.format(chest="Spine4")
    + """
    Neck Spine4 0 .01 1.48
    Head Neck 0 -.01 1.58"""
)
MIXAMO = (
    TRUNK
    + LEGS
    + """
    Spine Hips 0 0 1.08
    Spine1 Spine 0 .01 1.2
    Spine2 Spine1 0 .01 1.33"""
    + ARMS.format(chest="Spine2")
    + FINGERS
    + """
    Neck Spine2 0 .01 1.48
    Head Neck 0 -.01 1.58
    HeadTop_End Head 0 -.01 1.76"""
)
ROOTED = "root . 0 0 0\n" + OURS.replace("Hips .", "Hips root", 1)


def joints_of(text):
    joints = []
    for line in text.split("\n"):
        if not line.strip():
            continue
        sides = (("Left", 1), ("Right", -1)) if "%" in line else (("", 1),)
        for side, sign in sides:
            name, parent, *place = line.replace("%", side).split()
            x, y, z = map(float, place)
            joints.append((name, None if parent == "." else parent, Vector((sign * x, y, z))))
    return joints


def build(text, prefix="", centimetres=False, mode="QUATERNION"):
    """An armature with rolls of all kinds; in cm with Y up on an object that undoes it, or in m."""
    data = bpy.data.armatures.new("Armature")
    obj = bpy.data.objects.new("Armature", data)
    bpy.context.scene.collection.objects.link(obj)
    bpy.context.view_layer.objects.active = obj
    bpy.ops.object.mode_set(mode="EDIT")
    dice = random.Random(3)
    made = {}
    into = Matrix.Rotation(-math.pi / 2, 4, "X") if centimetres else Matrix()
    size = 100.0 if centimetres else 1.0
    joints = joints_of(text)
    for name, parent, head in joints:
        bone = data.edit_bones.new(prefix + name)
        bone.head = into @ head * size
        ahead = [place for _, above, place in joints if above == name != "root"]
        bone.tail = into @ (ahead[0] if ahead else head + Vector((0, -0.05, 0.01))) * size
        bone.roll = dice.uniform(-3, 3)
        if parent:
            bone.parent = made[parent]
            bone.use_connect = (bone.head - bone.parent.tail).length < 1e-6 * size
        made[name] = bone
    bpy.ops.object.mode_set(mode="POSE")
    for bone in obj.pose.bones:
        bone.rotation_mode = mode
    if centimetres:
        obj.rotation_mode = "XYZ"
        obj.rotation_euler = (math.pi / 2, 0, 0)
        obj.scale = (0.01, 0.01, 0.01)
        obj.location = (0.3, -0.2, 0)
    return obj


def pose(obj, frame, seed, root="Hips", prefix=""):
    """Keys a pose at a frame."""
    dice = random.Random(seed)
    for bone in obj.pose.bones:
        turn = Euler([dice.gauss(0, 0.3) for _ in range(3)]).to_quaternion()
        key_turn(bone, turn, frame)
    hips = obj.pose.bones[prefix + root]
    shift = Vector((dice.uniform(-0.3, 0.3), 0.02 * frame, dice.uniform(-0.05, 0.05)))
    unit = obj.matrix_world.to_scale()[0]
    back = (obj.matrix_world.to_quaternion() @ hips.bone.matrix_local.to_quaternion()).inverted()
    hips.location = back @ shift / unit
    hips.keyframe_insert("location", frame=frame)


def key_turn(bone, turn, frame):
    if bone.rotation_mode == "QUATERNION":
        bone.rotation_quaternion = turn
        bone.keyframe_insert("rotation_quaternion", frame=frame)
    elif bone.rotation_mode == "AXIS_ANGLE":
        axis, angle = turn.to_axis_angle()
        bone.rotation_axis_angle = (angle, *axis)
        bone.keyframe_insert("rotation_axis_angle", frame=frame)
    else:
        bone.rotation_euler = turn.to_euler(bone.rotation_mode)
        bone.keyframe_insert("rotation_euler", frame=frame)


def joints_at(obj, frame):
    """World places of the joints, m."""
    bpy.context.scene.frame_set(frame)
    return {bone.name: obj.matrix_world @ bone.head for bone in obj.pose.bones}


def apart(some, others):
    return max((some[name] - others[name]).length for name in others)


def curves(obj):
    return module().curves_of(obj)


def keys(obj):
    """What the keys of an armature say, by curve and frame."""
    said = ("type", "interpolation", "easing", "back", "select_control_point")
    return {
        (curve.data_path, curve.array_index, point.co[0]): (
            point.co[1],
            *(getattr(point, name) for name in said),
        )
        for curve in curves(obj)
        for point in curve.keyframe_points
    }


def values(obj, frames):
    return {
        (curve.data_path, curve.array_index, frame): curve.evaluate(frame)
        for curve in curves(obj)
        for frame in frames
    }


def module():
    return sys.modules["keydance"]


def fresh(fps=24, run=INTERPOLATION):
    """An empty scene with the add-on set up."""
    bpy.ops.wm.read_homefile(use_empty=True)
    scene = bpy.context.scene
    scene.render.fps, scene.frame_start, scene.frame_end = fps, 0, 40
    chosen = bpy.context.preferences.addons["keydance"].preferences
    chosen.binary, chosen.run = os.environ["KEYDANCE"], str(run)
    return scene


def refused(operator, words):
    """An operator reports an error that says so."""
    try:
        operator()
    except RuntimeError as error:
        said = str(error)
        assert words in said and "Traceback" not in said, said
    else:
        raise AssertionError(f"no error about {words!r}")


class Written:
    """Keeps the files that go to the program and come back."""

    def __enter__(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.count, self.read = 0, module().read_bvh

        def read(path, rig):
            folder = pathlib.Path(path).parent
            shutil.copytree(folder, self.folder / str(self.count))
            self.count += 1
            return self.read(path, rig)

        module().read_bvh = read
        return self

    def __exit__(self, *_):
        module().read_bvh = self.read
        shutil.rmtree(self.folder)

    def result(self, number=0):
        return forward_kinematics(self.folder / str(number) / "filled.bvh")


def forward_kinematics(path):
    """World places of the joints of every frame of a BVH file, and its frame time."""
    lines = [line.split() for line in path.read_text().splitlines()]
    joints, above = [], []
    for words in lines:
        if words[0] in ("ROOT", "JOINT"):
            joints.append([" ".join(words[1:]), above[-1] if above else None, None, None])
            above.append(len(joints) - 1)
        elif words[0] == "End":
            above.append(None)
        elif words[0] == "OFFSET" and above[-1] is not None:
            joints[above[-1]][2] = Vector(map(float, words[1:]))
        elif words[0] == "CHANNELS":
            joints[above[-1]][3] = words[2:]
        elif words[0] == "}":
            above.pop()
        elif words[0] == "MOTION":
            break
    at = lines.index(["MOTION"])
    frames = []
    for row in lines[at + 3 :]:
        channels = iter(map(float, row))
        places, turns = [], []
        for _, parent, offset, names in joints:
            place, turn = offset.copy(), Matrix.Identity(3)
            for name in names:
                value = next(channels)
                if name.endswith("position"):
                    place["XYZ".index(name[0])] = value
                else:
                    turn = turn @ Matrix.Rotation(math.radians(value), 3, name[0])
            if parent is not None:
                place = places[parent] + turns[parent] @ place
                turn = turns[parent] @ turn
            places.append(place)
            turns.append(turn)
        frames.append({joint[0]: place for joint, place in zip(joints, places)})
    assert len(frames) == int(lines[at + 1][1])
    return frames, float(lines[at + 2][2])


def check_fill(obj, frames, fps=24, metres=1.0):
    """Fill meets the keyed poses, plays the program's result, and keeps to frames and scene."""
    scene = bpy.context.scene
    at, end = scene.frame_current, scene.frame_end
    before = {frame: joints_at(obj, frame) for frame in frames}
    own, eased = keys(obj), values(obj, range(frames[0], frames[-1] + 1))
    scene.frame_set(at)
    with Written() as written:
        assert bpy.ops.keydance.fill() == {"FINISHED"}
        made, frame_time = written.result()
    assert scene.frame_current == at
    assert scene.frame_end == max(end, frames[-1])
    assert abs(frame_time * fps - 1.0) < 1e-9
    assert len(made) == frames[-1] - frames[0] + 1
    for frame in frames:
        assert apart(joints_at(obj, frame), before[frame]) < CLOSE / 100
    after = keys(obj)
    assert all(after[key] == own[key] for key in own)
    for bone in obj.pose.bones:
        path = module().channels(bone)[0][0]
        keyed = {key[2] for key in after if key[0] == path}
        assert keyed == set(range(frames[0], frames[-1] + 1)), bone.name
    worst = 0.0
    for frame in range(frames[0], frames[-1] + 1):
        row = made[frame - frames[0]]
        meant = {name: Vector((x, -z, y)) / 100 / metres for name, (x, y, z) in row.items()}
        worst = max(worst, apart(joints_at(obj, frame), meant) * metres)
    assert worst < CLOSE, worst
    now = values(obj, range(frames[0], frames[-1] + 1))
    assert max(abs(now[key] - eased[key]) for key in eased) > 1e-3
    print(f"  furthest joint from the program's result: {1e6 * worst:.1f} µm")


def check_keyframes(scene, obj, frames):
    assert module().Filling(bpy.context, obj, scene.keydance).frames == frames


# --- The tests -----------------------------------------------------------------------------------


def test_ours():
    fresh()
    obj = build(OURS)
    for frame in (0, 24, 61):
        pose(obj, frame, frame)
    check_fill(obj, (0, 24, 61))
    filling = module().Filling(bpy.context, obj, bpy.context.scene.keydance)
    filling.fill([(0, 24), (24, 61)])
    assert filling.warnings == [], "it is the dance skeleton itself"


def test_ours_at_other_rates():
    for fps in (30, 60):
        fresh(fps)
        obj = build(OURS)
        for frame in (5, 6, 40):
            pose(obj, frame, frame)
        check_fill(obj, (5, 6, 40), fps)


def test_mixamo_as_imported():
    fresh()
    obj = build(MIXAMO, "mixamorig:", centimetres=True)
    for frame in (1, 20, 50):
        pose(obj, frame, frame, prefix="mixamorig:")
    check_fill(obj, (1, 20, 50))


def test_mixamo_in_metres():
    fresh(30)
    obj = build(MIXAMO, "mixamorig:")
    for frame in (1, 20, 50):
        pose(obj, frame, frame, prefix="mixamorig:")
    check_fill(obj, (1, 20, 50), 30)


def test_euler_and_axis_angle():
    for mode in ("XYZ", "ZYX", "YXZ", "AXIS_ANGLE"):
        fresh()
        obj = build(MIXAMO, "mixamorig:", centimetres=True, mode=mode)
        for frame in (0, 30):
            pose(obj, frame, frame, prefix="mixamorig:")
        check_fill(obj, (0, 30))


def test_hips_below_a_root():
    fresh()
    obj = build(ROOTED)
    for frame in (0, 12, 40):
        pose(obj, frame, frame)
    check_fill(obj, (0, 12, 40))
    root = obj.pose.bones["root"].path_from_id("location")
    assert not any(key[0] == root for key in keys(obj)), "the root bone need not move"


def test_right_angles():
    """Where Euler angles have no single value."""
    fresh()
    obj = build(OURS, mode="XYZ")
    for frame, sign in ((0, 1), (30, -1)):
        for bone in obj.pose.bones:
            key_turn(bone, Euler((0, sign * math.pi / 2, 0)).to_quaternion(), frame)
    check_fill(obj, (0, 30))


def test_a_giant_and_a_dwarf():
    for scale in (100.0, 0.2):
        scene = fresh()
        obj = build(OURS)
        obj.scale = (scale,) * 3
        bpy.context.view_layer.update()
        for frame in (0, 30):
            pose(obj, frame, frame)
        scene.frame_set(0)
        sizes = [
            obj.matrix_world @ point
            for bone in obj.data.bones
            for point in (bone.head_local, bone.tail_local)
        ]
        height = max(max(axis) - min(axis) for axis in zip(*sizes))
        check_fill(obj, (0, 30), metres=1.7 / height)


def test_armature_that_moves():
    """Where the object is animated, too."""
    fresh()
    obj = build(OURS)
    for frame in (0, 20, 45):
        pose(obj, frame, frame)
        obj.location = (0.01 * frame, 0, 0)
        obj.rotation_euler = (0, 0, 0.02 * frame)
        obj.keyframe_insert("location", frame=frame)
        obj.keyframe_insert("rotation_euler", frame=frame)
    check_fill(obj, (0, 20, 45))


def test_one_gap_again():
    scene = fresh()
    obj = build(MIXAMO, "mixamorig:", centimetres=True)
    frames = (0, 20, 45, 70)
    for frame in frames:
        pose(obj, frame, frame, prefix="mixamorig:")
    for curve in curves(obj):
        for at, point in enumerate(curve.keyframe_points):
            point.easing = ("AUTO", "EASE_IN", "EASE_OUT", "EASE_IN_OUT")[at]
            point.back, point.select_control_point = 1.0 + at, at % 2 == 0
    own = keys(obj)
    bpy.ops.keydance.fill()
    before = keys(obj)
    assert all(before[key] == own[key] for key in own)
    scene.frame_set(30)
    assert bpy.ops.keydance.fill_gap() == {"FINISHED"}
    assert keys(obj) == before, "with the same controls the same dance"
    scene.keydance.rise = 0.2
    bpy.ops.keydance.fill_gap()
    after = keys(obj)
    outside = {key for key in before if not 20 < key[2] < 45}
    assert all(before[key] == after[key] for key in outside)
    assert {key for key in after if not 20 < key[2] < 45} == outside
    assert any(before[key] != after[key] for key in before)
    assert joints_at(obj, 32)["mixamorig:Hips"].z > 0.1


def test_one_gap_alone():
    """The others are as Blender eases them, also where bones are keyed at other frames."""
    for interpolation in ("BEZIER", "LINEAR", "CONSTANT"):
        scene = fresh()
        obj = build(OURS)
        for frame in (0, 20, 45, 70):
            pose(obj, frame, frame)
        unkeyed = {
            module().channels(obj.pose.bones[name])[0][0]: index
            for name, index in (("LeftArm", 1), ("RightArm", 2))
        }
        for curve in curves(obj):
            for point in curve.keyframe_points:
                point.interpolation = interpolation
            if curve.data_path in unkeyed:
                point = curve.keyframe_points[unkeyed[curve.data_path]]
                curve.keyframe_points.remove(point)
        outside = [*range(21), *range(45, 80)]
        before = values(obj, outside)
        scene.frame_set(21)
        bpy.ops.keydance.fill_gap()
        after = values(obj, outside)
        assert max(abs(after[key] - before[key]) for key in before) < 1e-6
        assert all(after[key] == before[key] for key in before if key[0] not in unkeyed)


def test_key_on_a_generated_frame():
    for changed in (True, False):
        scene = fresh()
        obj = build(OURS)
        for frame in (0, 40):
            pose(obj, frame, frame)
        bpy.ops.keydance.fill()
        scene.frame_set(17)
        arm = obj.pose.bones["RightArm"]
        if changed:
            turn = arm.rotation_quaternion @ Quaternion((1, 0, 0), 0.8)
            key_turn(arm, turn, 17)
        else:
            bpy.ops.keydance.keep()
        pinned = joints_at(obj, 17)
        old = joints_at(obj, 10)
        bpy.ops.keydance.fill()
        assert apart(joints_at(obj, 17), pinned) < CLOSE / 100
        if changed:
            assert apart(joints_at(obj, 10), old) > 0.01
        kinds = {value[1] for key, value in keys(obj).items() if key[2] == 17}
        assert "KEYFRAME" in kinds
        check_keyframes(scene, obj, [0, 17, 40])


def test_keys_moved_in_time():
    """What was generated is still that."""
    scene = fresh()
    obj = build(OURS)
    for frame in (0, 40):
        pose(obj, frame, frame)
    bpy.ops.keydance.fill()
    for curve in curves(obj):
        for point in curve.keyframe_points:
            point.co[0] += 5
        curve.update()
    check_keyframes(scene, obj, [5, 45])


def test_clear():
    fresh()
    obj = build(OURS)
    for frame in (0, 15, 40):
        pose(obj, frame, frame)
    own = keys(obj)
    bpy.ops.keydance.fill()
    bpy.ops.keydance.clear()
    assert keys(obj) == own
    refused(bpy.ops.keydance.clear, "nothing generated")


def test_range_and_length():
    scene = fresh()
    obj = build(OURS)
    for frame in (0, 20, 40, 60):
        pose(obj, frame, frame)
    scene.keydance.use_range = True
    scene.keydance.first, scene.keydance.last = 15, 45
    bpy.ops.keydance.fill()
    assert {key[2] for key in keys(obj)} == {0, *range(20, 41), 60}
    assert scene.frame_end == 40


def test_poses_held_until_the_next():
    """Keys with constant interpolation, as poses are blocked out."""
    fresh()
    obj = build(OURS)
    for frame in (0, 15, 40):
        pose(obj, frame, frame)
    for curve in curves(obj):
        for point in curve.keyframe_points:
            point.interpolation = "CONSTANT"
    check_fill(obj, (0, 15, 40))


def test_own_keys_of_the_generated_type():
    scene = fresh()
    obj = build(OURS)
    for frame in (0, 15, 40):
        pose(obj, frame, frame)
    for curve in curves(obj):
        for point in curve.keyframe_points:
            point.type = module().mark()[0]
    for _ in range(2):
        check_keyframes(scene, obj, [0, 15, 40])
        bpy.ops.keydance.fill()


def test_present_motion():
    scene = fresh()
    obj = build(MIXAMO, "mixamorig:", centimetres=True)
    for frame in (0, 25, 40):
        pose(obj, frame, frame, prefix="mixamorig:")
    scene.keydance.between = "MOTION"
    check_fill(obj, (0, 25, 40))


def test_twist_bones_follow_and_chains_are_refused():
    scene = fresh()
    obj = build(MIXAMO, "mixamorig:", centimetres=True)
    for frame in (0, 25):
        pose(obj, frame, frame, prefix="mixamorig:")
    tip = obj.pose.bones["mixamorig:LeftHandIndex2"]
    constraint = tip.constraints.new("COPY_ROTATION")
    constraint.target, constraint.subtarget = obj, "mixamorig:LeftHandIndex1"
    path = module().channels(tip)[0][0]
    bpy.ops.keydance.fill()
    assert {key[2] for key in keys(obj) if key[0] == path} == {0, 25}
    foot = obj.pose.bones["mixamorig:LeftLeg"].constraints.new("IK")
    foot.chain_count = 2
    foot.target, foot.subtarget = obj, "mixamorig:RightHand"
    refused(bpy.ops.keydance.fill, "constraints move mixamorig:LeftUpLeg, mixamorig:LeftLeg")
    foot.mute = True
    assert scene.keydance.velocity == 1.0
    bpy.ops.keydance.fill()


def test_control_bones_stay_out():
    fresh()
    obj = build(OURS)
    bpy.ops.object.mode_set(mode="EDIT")
    handle = obj.data.edit_bones.new("Handle")
    handle.head, handle.tail = (9, 9, 0), (9, 9, 1)
    handle.use_deform = False
    bpy.ops.object.mode_set(mode="POSE")
    path = obj.pose.bones["Handle"].path_from_id("location")
    for frame in (0, 30):
        pose(obj, frame, frame)
    obj.pose.bones["Handle"].keyframe_insert("location", frame=11)
    bpy.ops.keydance.fill()
    assert {key[2] for key in keys(obj) if key[0] == path} == {11}


def test_panel():
    scene = fresh()
    obj = build(OURS)
    layout = unittest.mock.MagicMock()
    draw_gaps = module().draw_gaps

    def labels():
        layout.reset_mock()
        draw_gaps(layout, scene, obj)
        return [call.kwargs["text"] for call in layout.label.call_args_list]

    assert labels() == ["Armature has no keyed poses; key two poses or more"]
    for frame in (0, 200, 401):
        pose(obj, frame, frame)
    long = ["Armature: keyed at 3 frames", "200 to 401: more than the 200 frames of models"]
    assert labels() == long
    bpy.ops.keydance.fill()
    assert labels() == long
    scene.keydance.use_range = True
    assert labels() == ["Armature: keyed at 1 frame"]
    panel = unittest.mock.MagicMock(layout=layout)
    module().KEYDANCE_PT_panel.draw(panel, bpy.context)
    named = {call.args[0] for call in layout.column().operator.call_args_list}
    assert {"keydance.fill", "keydance.fill_gap"} <= named


def test_undo():
    scene = fresh()
    obj = build(OURS)
    for frame in (0, 30):
        pose(obj, frame, frame)
    bpy.ops.object.mode_set(mode="OBJECT")
    own = keys(obj)
    window = bpy.context.window_manager.windows[0]
    with bpy.context.temp_override(window=window):
        bpy.ops.ed.undo_push(message="Poses")
        bpy.ops.keydance.fill("EXEC_DEFAULT", True)
        assert len(keys(obj)) > 10 * len(own)
        bpy.ops.ed.undo()
    obj, scene = bpy.data.objects["Armature"], bpy.context.scene
    assert keys(obj) == own
    assert module().GENERATED not in obj.animation_data.action
    assert scene.frame_end == 40


def test_errors():
    scene = fresh()
    obj = build(OURS)
    fill, chosen = bpy.ops.keydance.fill, bpy.context.preferences.addons["keydance"].preferences
    refused(fill, "has no keyed poses")
    pose(obj, 0, 1)
    refused(fill, "keyed at frame 0 only")
    pose(obj, 1, 2)
    refused(fill, "no frames between")
    pose(obj, 30, 3)
    own = keys(obj)
    scene.frame_set(35)
    refused(bpy.ops.keydance.fill_gap, "frame 35 is not between")
    refused(bpy.ops.keydance.keep, "no generated pose at frame 35")
    program = chosen.binary
    chosen.binary = "/nowhere/keydance"
    refused(fill, "there is no program '/nowhere/keydance'")
    chosen.binary = str(HERE / "test_keydance.py")
    refused(fill, "there is no program")
    chosen.binary, chosen.run = program, "/nowhere/run"
    refused(fill, "/nowhere/run cannot be read")
    chosen.run = str(INTERPOLATION)
    scene.keydance.mapping = "/nowhere/mapping.toml"
    refused(fill, "/nowhere/mapping.toml cannot be read")
    scene.keydance.mapping = ""
    kept = tempfile.tempdir
    tempfile.tempdir = "/nowhere"
    refused(fill, "cannot be written or read")
    tempfile.tempdir = kept
    obj.scale = (1, 1, 2)
    refused(fill, "scaled unevenly")
    obj.scale = (1, 1, 1)
    head = obj.pose.bones["Head"]
    head.scale = (2, 2, 2)
    refused(fill, "Head is scaled")
    head.scale = (1, 1, 1)
    obj.data.pose_position = "REST"
    refused(fill, "rest position")
    obj.data.pose_position = "POSE"
    assert keys(obj) == own
    head.keyframe_insert("location", frame=7.5)
    refused(fill, "a key is at frame 7.50")


def test_rig_that_is_not_recognised():
    scene = fresh()
    obj = build(OURS)
    for number, bone in enumerate(obj.data.bones):
        bone.name = f"Bone.{number}"
    for frame in (0, 30):
        pose(obj, frame, frame, root="Bone.0")
    own = keys(obj)
    refused(bpy.ops.keydance.fill, "was not recognised")
    assert keys(obj) == own
    with tempfile.TemporaryDirectory() as folder:
        mapping = pathlib.Path(folder) / "mapping.toml"
        bpy.ops.keydance.mapping(filepath=str(mapping))
        assert scene.keydance.mapping == str(mapping)
        named = mapping.read_text()
        assert '# Hips = "?"' in named
        for number, (joint, *_) in enumerate(joints_of(OURS)):
            named = named.replace(f'# {joint} = "?"', f'{joint} = "Bone.{number}"')
        mapping.write_text(named)
        assert bpy.ops.keydance.fill() == {"FINISHED"}


def test_the_model_that_comes_with_the_program():
    for text, prefix, centimetres in ((OURS, "", False), (MIXAMO, "mixamorig:", True)):
        scene = fresh(run="")
        obj = build(text, prefix, centimetres)
        for frame in (0, 24, 61, 120):
            pose(obj, frame, frame, prefix=prefix)
        check_fill(obj, (0, 24, 61, 120))
        before = keys(obj)
        scene.frame_set(40)
        bpy.ops.keydance.fill_gap()
        assert keys(obj) == before
        scene.keydance.velocity = 1.5
        bpy.ops.keydance.fill_gap()
        after = keys(obj)
        assert all(after[key] == before[key] for key in before if not 24 < key[2] < 61)
        assert after != before


def main():
    bpy.ops.preferences.addon_install(filepath=str(HERE / "keydance.py"))
    bpy.ops.preferences.addon_enable(module="keydance")
    print("Blender", bpy.app.version_string)
    chosen = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else []
    failed = []
    for name, test in list(globals().items()):
        if not name.startswith("test_") or chosen and name not in chosen:
            continue
        print(name, flush=True)
        try:
            test()
        except Exception:
            traceback.print_exc()
            failed.append(name)
    bpy.ops.preferences.addon_disable(module="keydance")
    print(f"failed: {', '.join(failed)}" if failed else "all passed")
    sys.exit(bool(failed))


if __name__ == "__main__":
    main()
