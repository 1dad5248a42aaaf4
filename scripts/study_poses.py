#!/usr/bin/env python3
"""What the clips alone say about how well poses can be predicted. Needs numpy.

    python scripts/study_poses.py --keydance target/release/keydance --data DANCE

Prints, on training clips of which every eleventh is set aside, the LRP (cm) of estimates of the frames between two keyframes that are
linear in the keyframes (src/models/pan2021/guess.rs), with and without a ridge regression on the controls; then, for each test clip,
how near the training frame is that is most like the true one (its median over the frames, as a distance of LRP's kind).
"""

import argparse
import pathlib
import subprocess
import tempfile

import numpy as np

BODY, ROOT, VELOCITY, FACTORS = slice(0, 69), slice(69, 72), slice(77, 146), slice(149, 154)
LENGTHS = (10, 50, 100, 150)
OFFSETS = (-20, -12, -7, -4, -2, 0, 2, 4, 7, 12, 20)
KEPT, TIME = 0.2, 8.0


def split(names):
    """The paper's split, as in src/data/split.rs."""
    numbered = sorted(f"{i}_{name}" for i, name in enumerate(sorted(names), 1))
    clips = [name.split("_", 1)[1] for name in numbered]
    return clips[:98], clips[98:]


def windows(clips, n, step):
    cut = [clip[s : s + n + 1] for clip in clips for s in range(0, len(clip) - n, step)]
    return np.stack(cut).astype(np.float64)


def likeness(d):
    return KEPT + (1 - KEPT) * (1 + abs(d) / TIME) * np.exp(-abs(d) / TIME)


def estimate(cut, n, t, mean, r):
    """Kriging from p^b and v^b of k1 and p^b of k2, all less the mean."""
    step = lambda d: r(d) - r(d + 1)
    given = np.array([[1, step(0), r(n)], [step(0), 2 * step(0), step(n)], [r(n), step(n), 1]])
    given += 1e-6 * np.diag(np.diag(given))
    w = np.linalg.solve(given, [r(t), step(t), r(n - t)])
    return w[0] * (cut[:, 0, BODY] - mean) + w[1] * cut[:, 0, VELOCITY] + w[2] * (cut[:, n, BODY] - mean)


def controls(cut, n, t, mean):
    near = [min(max(t + offset, 0), n) for offset in OFFSETS]
    path = cut[:, near, ROOT] - cut[:, t : t + 1, ROOT]
    path[..., 1] = cut[:, near, ROOT.start + 1] - 90
    parts = [path, cut[:, near, FACTORS], cut[:, 0, BODY] - mean, cut[:, n, BODY] - mean]
    return np.concatenate([np.ones((len(cut), 1))] + [p.reshape(len(cut), -1) for p in parts], 1)


def ridge(train, held, n, t, mean, penalty=3000.0):
    a, b = controls(train, n, t, mean), controls(held, n, t, mean)
    scale = a.std(0) + 1e-3
    a, b = a / scale, b / scale
    rest = train[:, t, BODY] - mean - estimate(train, n, t, mean, likeness)
    return b @ np.linalg.solve(a.T @ a + penalty * np.eye(a.shape[1]), a.T @ rest)


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--keydance", default="keydance")
    arguments.add_argument("--data", required=True, type=pathlib.Path)
    given = arguments.parse_args()
    train_names, test_names = split([path.name for path in given.data.glob("*.bvh")])
    clips = {}
    with tempfile.TemporaryDirectory() as folder:
        for name in train_names + test_names:
            file = pathlib.Path(folder, "features.npy")
            command = [given.keydance, "features", given.data / name, "--npy", file, "--force"]
            subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
            clips[name] = np.load(file)
    held_names = train_names[::11]
    train = [clips[name] for name in train_names if name not in held_names]
    held = [clips[name] for name in held_names]
    mean = np.concatenate([clip[:, BODY] for clip in train]).astype(np.float64).mean(0)

    lrp = lambda guess, truth: np.linalg.norm(guess - truth, axis=1).mean()
    print(f"LRP (cm) on {len(held)} training clips set aside, from the other {len(train)}")
    print(f"{'N':>4} {'mean pose':>10} {'lines':>7} {'kriging':>8} {'and ridge':>10}")
    for n in LENGTHS:
        cut, fitted = windows(held, n, -(-(n + 1) // 10)), windows(train, n, 5)
        rows = []
        for t in range(1, n, max(1, n // 10)):
            truth = cut[:, t, BODY] - mean
            line = (1 - t / n) * cut[:, 0, BODY] + t / n * cut[:, n, BODY] - mean
            kriging = estimate(cut, n, t, mean, likeness)
            helped = kriging + ridge(fitted, cut, n, t, mean)
            rows.append([lrp(guess, truth) for guess in (0 * truth, line, kriging, helped)])
        print(f"{n:>4} {'{:10.1f} {:7.1f} {:8.1f} {:10.1f}'.format(*np.mean(rows, 0))}")

    poses = np.concatenate([clips[name][:, BODY] for name in train_names])
    squares = (poses * poses).sum(1)
    print(f"\nDistance (cm) from a test frame to the nearest of {len(poses)} training frames")
    for name in test_names:
        some = clips[name][::15, BODY]
        distances = (some * some).sum(1)[:, None] + squares - 2 * some @ poses.T
        print(f"{name:28} {np.median(np.sqrt(np.maximum(distances, 0).min(1))):6.1f}")


if __name__ == "__main__":
    main()
