#!/usr/bin/env python3
"""How well exported motions follow the velocity factors asked for, and how smooth they are. Needs numpy and Python 3.11.

    python scripts/study_exports.py runs/whole_model --keydance target/release/keydance --data DANCE

For each validation clip of the run (trained with data.validation_share), `keydance generate` makes a dance with a keyframe every SPACING
frames, its root trajectory and velocity factors the clip's, and `keydance features` measures the BVH file that was written. Prints the
means over these frames, with velocity refinement, without, and of the clips themselves: velocity factors, their distance from those
asked for, acceleration of the joints relative to the root, and distance from the clip's poses (as in LRP).
"""

import argparse
import pathlib
import subprocess
import tempfile
import tomllib

import numpy as np

from study_poses import BODY, FACTORS, split

FIRST = 10  # frame of the first keyframe: the features of the first frames have no past


def validation_clips(run, data):
    """As in src/data/split.rs."""
    share = tomllib.loads((run / "config.toml").read_text())["data"]["validation_share"]
    train, _ = split([path.name for path in data.glob("*.bvh")])
    until = lambda count: int(count * share + 1e-9)
    return [name for i, name in enumerate(train) if until(i + 1) > until(i)]


def measured(dance, clip):
    """Both [frames, 154]; sums over the numbers, and how many numbers there are."""
    missed = np.abs(dance[1:, FACTORS] - clip[1:, FACTORS])
    bend = np.diff(dance[:, BODY].reshape(len(dance), -1, 3), 2, axis=0)
    quantities = (
        dance[1:, FACTORS],
        missed,
        np.linalg.norm(bend, axis=2),
        np.linalg.norm(dance[1:, BODY] - clip[1:, BODY], axis=1),
    )
    return np.array([(quantity.sum(), quantity.size) for quantity in quantities])


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("run", type=pathlib.Path)
    arguments.add_argument("--keydance", default="keydance")
    arguments.add_argument("--data", required=True, type=pathlib.Path)
    arguments.add_argument("--spacing", type=int, default=60)
    given = arguments.parse_args()
    names = validation_clips(given.run, given.data)
    if not names:
        arguments.error(f"{given.run} has no validation clips")

    with tempfile.TemporaryDirectory() as folder:
        motion, table = pathlib.Path(folder, "dance.bvh"), pathlib.Path(folder, "features.npy")

        def keydance(*words):
            done = subprocess.run([given.keydance, *words], capture_output=True, text=True)
            if done.returncode:
                arguments.exit(1, done.stderr)  # warnings of other calls would bury the table

        def features(file):
            keydance("features", file, "--npy", table, "--force")
            return np.load(table).astype(np.float64)

        sums = dict.fromkeys(("true", "false", "clips"), 0)
        for name in names:
            file = given.data / name
            clip = features(file)
            keyframes = range(FIRST, len(clip), given.spacing)
            frames = ",".join(map(str, keyframes))
            clip = clip[keyframes[0] : keyframes[-1] + 1]
            sums["clips"] += measured(clip, clip)
            for refined in ("true", "false"):
                option = f"model.velocity_refinement={refined}"
                words = ("--motion", file, "--keyframes", frames, "--set", option, "--out", motion)
                keydance("generate", given.run, *words, "--force")
                sums[refined] += measured(features(motion), clip)

    print(f"{len(names)} clips, keyframes every {given.spacing} frames")
    print(f"{'':20} {'factors':>9} {'missed by':>10} {'acceleration':>13} {'distance':>9}")
    print(f"{'':20} {'cm/frame':>9} {'cm/frame':>10} {'cm/frame^2':>13} {'cm':>9}")
    for title, key in (("with refinement", "true"), ("without", "false"), ("the clips", "clips")):
        factors, missed, acceleration, distance = sums[key][:, 0] / sums[key][:, 1]
        print(f"{title:20} {factors:9.2f} {missed:10.2f} {acceleration:13.2f} {distance:9.1f}")


if __name__ == "__main__":
    main()
