#!/usr/bin/env python3
"""Turns AIST++ into dances with their music: motion/NAME.bvh, audio/NAME.wav and the published split.

    aistpp_pairs.py --motions AISTPP/motions --music AIST/wav --splits AISTPP/splits --out PAIRS
    aistpp_pairs.py selftest

For who has the data (https://google.github.io/aistplusplus_dataset: motions as pickles, split lists;
https://aistdancedb.ongaaccel.jp: the music). A pickle has smpl_poses [frames, 72], axis and angle of
24 joints, smpl_trans [frames, 3] and smpl_scaling [1], 60 frames a second. Of the skeleton it has the
scale alone, so bones are those of a mean body; rotations are the pickle's own. Sequences that
ignore_list.txt names are left out. PAIRS/aistpp.toml is the split as a config. Needs numpy.
"""

import argparse
import pickle
import shutil
import sys
import tempfile
from pathlib import Path

import numpy as np

SEQUENCES = 1408
FPS = 60
# Name, parent, place in the rest pose of a mean body, cm: X left, Y up, Z forward.
JOINTS = [
    ("Hips", -1, (0.0, 0.0, 0.0)),
    ("LeftUpLeg", 0, (6.9, -9.1, -0.7)),
    ("RightUpLeg", 0, (-6.8, -9.1, -0.4)),
    ("Spine", 0, (-0.2, 10.9, -2.7)),
    ("LeftLeg", 1, (10.4, -46.7, -1.1)),
    ("RightLeg", 2, (-10.6, -47.3, -1.3)),
    ("Spine1", 3, (0.3, 24.4, -2.6)),
    ("LeftFoot", 4, (9.0, -86.5, -5.5)),
    ("RightFoot", 5, (-9.0, -87.2, -5.5)),
    ("Spine2", 6, (0.4, 29.7, 0.0)),
    ("LeftToe", 7, (11.7, -92.0, 6.4)),
    ("RightToe", 8, (-11.6, -92.0, 6.8)),
    ("Neck", 9, (0.2, 51.1, -4.3)),
    ("LeftShoulder", 9, (8.3, 41.9, -3.4)),
    ("RightShoulder", 9, (-7.7, 41.6, -3.9)),
    ("Head", 12, (0.7, 57.6, 0.8)),
    ("LeftArm", 13, (17.4, 44.9, -4.3)),
    ("RightArm", 14, (-17.3, 44.8, -4.8)),
    ("LeftForeArm", 16, (43.4, 43.7, -7.1)),
    ("RightForeArm", 17, (-42.7, 43.5, -6.9)),
    ("LeftHand", 18, (68.3, 44.5, -7.2)),
    ("RightHand", 19, (-68.2, 44.3, -7.5)),
    ("LeftHandIndex", 20, (76.7, 43.7, -8.7)),
    ("RightHandIndex", 21, (-76.7, 43.7, -8.5)),
]
CHILDREN = [[k for k, (_, parent, _) in enumerate(JOINTS) if parent == j] for j in range(24)]
# Files hold joints depth first.
ORDER = []


def visit(joint):
    ORDER.append(joint)
    for child in CHILDREN[joint]:
        visit(child)


visit(0)


class Refused(Exception):
    """What is wrong with the input, and what to do."""


def matrices(rotations):
    """Axis and angle [.., 3] -> rotation matrices [.., 3, 3]."""
    angle = np.linalg.norm(rotations, axis=-1, keepdims=True)[..., None]
    axis = rotations / np.maximum(angle[..., 0], 1e-12)
    x, y, z = axis[..., 0], axis[..., 1], axis[..., 2]
    o = np.zeros_like(x)
    cross = np.stack([o, -z, y, z, o, -x, -y, x, o], -1).reshape(*x.shape, 3, 3)
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * (cross @ cross)


def zxy(rotation):
    """Angles of R = Rz Rx Ry, degrees, [.., 3] in this order."""
    x = np.arcsin(np.clip(rotation[..., 2, 1], -1, 1))
    z = np.arctan2(-rotation[..., 0, 1], rotation[..., 1, 1])
    y = np.arctan2(-rotation[..., 2, 0], rotation[..., 2, 2])
    return np.degrees(np.stack([z, x, y], -1))


class ArraysOnly(pickle.Unpickler):
    """A pickle can run code; these need arrays of numpy and nothing else."""

    def find_class(self, module, name):
        if module.split(".")[0] == "numpy" and name in ("_reconstruct", "ndarray", "dtype", "scalar"):
            return super().find_class(module, name)
        raise pickle.UnpicklingError(f"it asks for {module}.{name}")


def read(path):
    """Rotations [frames, 24, 3] and root places [frames, 3], cm."""
    with open(path, "rb") as file:
        try:
            motion = ArraysOnly(file).load()
        except (pickle.UnpicklingError, EOFError) as error:
            raise Refused(f"{path}: {error}") from None
    try:
        poses = np.asarray(motion["smpl_poses"], dtype=float)
        places = np.asarray(motion["smpl_trans"], dtype=float)
        scale = float(np.asarray(motion["smpl_scaling"], dtype=float).reshape(-1)[0])
    except (KeyError, TypeError, ValueError, IndexError) as error:
        raise Refused(f"{path}: no motion of AIST++: {error}") from None
    if poses.ndim != 2 or poses.shape[1] != 72 or places.shape != (len(poses), 3) or not scale > 0:
        raise Refused(f"{path}: smpl_poses {poses.shape}, smpl_trans {places.shape}, scale {scale}")
    if not (np.isfinite(poses).all() and np.isfinite(places).all()):
        raise Refused(f"{path}: it has a NaN or an infinity")
    return poses.reshape(-1, 24, 3), 100 * places / scale


def offset(joint):
    _, parent, place = JOINTS[joint]
    return np.array(place) - (np.array(JOINTS[parent][2]) if parent >= 0 else 0)


def bvh(poses, places):
    """The content of a BVH file, cm, Y up."""
    lines = ["HIERARCHY"]

    def write(joint, depth):
        pad = "  " * depth
        title = "ROOT" if depth == 0 else "JOINT"
        channels = "Zrotation Xrotation Yrotation"
        if depth == 0:
            channels = f"6 Xposition Yposition Zposition {channels}"
        else:
            channels = f"3 {channels}"
        numbers = " ".join(f"{x:.6f}" for x in offset(joint))
        lines.extend([f"{pad}{title} {JOINTS[joint][0]}", f"{pad}{{"])
        lines.extend([f"{pad}  OFFSET {numbers}", f"{pad}  CHANNELS {channels}"])
        for child in CHILDREN[joint]:
            write(child, depth + 1)
        if not CHILDREN[joint]:
            lines.extend([f"{pad}  End Site", f"{pad}  {{", f"{pad}    OFFSET 0 0 0", f"{pad}  }}"])
        lines.append(f"{pad}}}")

    write(0, 0)
    lines += ["MOTION", f"Frames: {len(poses)}", f"Frame Time: {1 / FPS:.9f}"]
    angles = zxy(matrices(poses))[:, ORDER].reshape(len(poses), -1)
    for place, row in zip(places, angles):
        lines.append(" ".join(f"{x:.6f}" for x in [*place, *row]))
    return "\n".join(lines) + "\n"


def music_of(name, folder):
    """The song of a sequence: gBR_sBM_cAll_d04_mBR0_ch01 dances to mBR0."""
    parts = [part for part in name.split("_") if part.startswith("m")]
    found = [folder / f"{part}{end}" for part in parts for end in (".wav", ".mp3", ".flac")]
    found = [path for path in found if path.is_file()]
    if not found:
        raise Refused(f"{name}: no song {' or '.join(parts) or 'in its name'} in {folder}")
    return found[0]


def names_in(path):
    return path.read_text().split() if path.is_file() else []


def convert(motions, music, splits, out):
    """Writes all pairs; the number of them."""
    files = sorted(motions.glob("*.pkl"))
    if not files:
        raise Refused(f"{motions} has no .pkl file; give the folder motions of AIST++")
    if len(files) != SEQUENCES:
        print(f"warning: AIST++ has {SEQUENCES} sequences, {motions} {len(files)}", file=sys.stderr)
    ignored = set(names_in(splits.parent / "ignore_list.txt"))
    for folder in (out / "motion", out / "audio"):
        folder.mkdir(parents=True)
    written = []
    for file in files:
        if file.stem in ignored:
            continue
        song = music_of(file.stem, music)
        (out / "motion" / f"{file.stem}.bvh").write_text(bvh(*read(file)))
        shutil.copyfile(song, out / "audio" / f"{file.stem}{song.suffix}")
        written.append(file.stem)
    lists = {part: names_in(splits / f"crossmodal_{part}.txt") for part in ("train", "val", "test")}
    if not lists["train"] or not lists["test"]:
        raise Refused(f"{splits} has no crossmodal_train.txt and crossmodal_test.txt")
    keys = {"train": "train", "val": "validation", "test": "test"}
    listed = {keys[part]: [it for it in names if it in set(written)] for part, names in lists.items()}
    text = "[data]\nmusic = true\n\n[data.split.list]\n"
    for part, names in listed.items():
        text += f"{part} = [{', '.join(repr(name + '.bvh') for name in names)}]\n"
    (out / "aistpp.toml").write_text(text)
    counts = ", ".join(f"{len(names)} {part}" for part, names in listed.items())
    print(f"{len(written)} dances, {counts}: {out}")
    return len(written)


def world(poses, places, joint_offsets):
    """Joint places [frames, 24, 3], cm."""
    local = matrices(poses)
    turned, placed = [None] * 24, [None] * 24
    for joint, (_, parent, _) in enumerate(JOINTS):
        if parent < 0:
            turned[joint], placed[joint] = local[:, joint], places
        else:
            turned[joint] = turned[parent] @ local[:, joint]
            placed[joint] = placed[parent] + turned[parent] @ joint_offsets[joint]
    return np.stack(placed, 1)


def parsed(text):
    """Joint places of a file that `bvh` wrote, [frames, 24, 3], cm."""
    rows = text.split("Frame Time:")[1].split("\n")[1:-1]
    numbers = np.array([[float(x) for x in row.split()] for row in rows])
    angles = np.radians(numbers[:, 3:].reshape(len(rows), 24, 3))
    turn = {axis: np.eye(3)[k] for k, axis in enumerate("xyz")}
    local = np.empty((len(rows), 24, 3, 3))
    for place, joint in enumerate(ORDER):
        z, x, y = angles[:, place].T
        parts = [matrices(a[:, None] * turn[axis]) for a, axis in ((z, "z"), (x, "x"), (y, "y"))]
        local[:, joint] = parts[0] @ parts[1] @ parts[2]
    turned, placed = [None] * 24, [None] * 24
    for joint, (_, parent, _) in enumerate(JOINTS):
        if parent < 0:
            turned[joint], placed[joint] = local[:, joint], numbers[:, :3]
        else:
            turned[joint] = turned[parent] @ local[:, joint]
            placed[joint] = placed[parent] + turned[parent] @ offset(joint)
    return np.stack(placed, 1)


def selftest():
    """Small files of the form of AIST++, there and back; 0 if all agree."""
    random = np.random.default_rng(1)
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        for name in ("motions", "wav", "splits"):
            (folder / name).mkdir()
        names = [f"gBR_sBM_cAll_d04_mBR{k}_ch0{k}" for k in range(3)]
        for name in names:
            motion = {
                "smpl_poses": random.normal(size=(7, 72)),
                "smpl_trans": 90 * random.normal(size=(7, 3)),
                "smpl_scaling": np.array([90.0]),
            }
            with open(folder / "motions" / f"{name}.pkl", "wb") as file:
                pickle.dump(motion, file)
        for k in range(3):
            (folder / "wav" / f"mBR{k}.wav").write_bytes(b"RIFF")
        for part, name in zip(("train", "val", "test"), names):
            (folder / "splits" / f"crossmodal_{part}.txt").write_text(name + "\n")
        out = folder / "pairs"
        assert convert(folder / "motions", folder / "wav", folder / "splits", out) == 3
        offsets = [offset(joint) for joint in range(24)]
        for name in names:
            expected = world(*read(folder / "motions" / f"{name}.pkl"), offsets)
            found = parsed((out / "motion" / f"{name}.bvh").read_text())
            worst = np.abs(found - expected).max()
            assert worst < 1e-3, worst
            assert (out / "audio" / f"{name}.wav").is_file()
        config = (out / "aistpp.toml").read_text()
        assert config.count(".bvh") == 3 and "music = true" in config
        (folder / "motions" / "bad_mBR0.pkl").write_bytes(pickle.dumps({"smpl_poses": [[0.0] * 72]}))
        try:
            convert(folder / "motions", folder / "wav", folder / "splits", folder / "other")
        except Refused as refused:
            assert "bad_mBR0" in str(refused)
        else:
            raise AssertionError("a pickle without its places was taken")
    print("files come back as they went")
    return 0


def main():
    if sys.argv[1:] == ["selftest"]:
        return selftest()
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--motions", type=Path, required=True, help="folder of pickles")
    parser.add_argument("--music", type=Path, required=True, help="folder of songs, such as mBR0.wav")
    parser.add_argument("--splits", type=Path, required=True, help="folder of the published lists")
    parser.add_argument("--out", type=Path, required=True, help="new folder for the pairs")
    arguments = parser.parse_args()
    try:
        convert(arguments.motions, arguments.music, arguments.splits, arguments.out)
    except (Refused, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
