#!/usr/bin/env python3
"""Trains a model on recorded dances and on dances that it made to their music, and scores it.

    train_regenerated.py RUN --data MUSIC_DANCE --out OUT [--count 5] [--threads 1]

What the method of Pu and Shan is for: RUN, a trained run of kind pu2022, makes new dances to the
music of each training clip (keydance regenerate), which stand beside the recorded ones in OUT/data;
OUT/run is trained on all of them by RUN's config, and scored on the same test clips. Stopped, it
goes on.
"""

import argparse
import json
import subprocess
import sys
from pathlib import Path

SOUNDS = (".wav", ".flac", ".mp3", ".ogg")


class Refused(Exception):
    pass


def link(path, target):
    path.unlink(missing_ok=True)
    path.symlink_to(target.resolve())


def sound_of(audio, name):
    for ending in SOUNDS:
        if (audio / f"{name}{ending}").is_file():
            return audio / f"{name}{ending}"
    raise Refused(f"{audio} has no sound file of {name}")


def keydance(arguments, *words):
    print("+", arguments.keydance, *words, flush=True)
    code = subprocess.run([arguments.keydance, *map(str, words)]).returncode
    if code:
        raise Refused(f"keydance {words[0]} ended with exit code {code}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("run", type=Path, help="trained run of kind pu2022")
    parser.add_argument("--data", type=Path, required=True, help="folder with motion, audio and split.json")
    parser.add_argument("--out", type=Path, required=True, help="folder for data and run")
    parser.add_argument("--count", type=int, default=5, help="new dances to each training clip")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--keydance", default="target/release/keydance")
    arguments = parser.parse_args()
    split = json.loads((arguments.data / "split.json").read_text())
    motion, audio = arguments.out / "data" / "motion", arguments.out / "data" / "audio"
    for folder in (motion, audio):
        folder.mkdir(parents=True, exist_ok=True)
    names = {part: list(split[part]) for part in ("train", "validation", "test")}
    for name in sum(names.values(), []):
        link(motion / f"{name}.bvh", arguments.data / "motion" / f"{name}.bvh")
        song = sound_of(arguments.data / "audio", name)
        link(audio / song.name, song)
    if (arguments.data / "novel.json").is_file():
        link(arguments.out / "data" / "novel.json", arguments.data / "novel.json")
    for name in split["train"]:
        clip, song = arguments.data / "motion" / f"{name}.bvh", sound_of(arguments.data / "audio", name)
        made = [f"{name}_{number:03}" for number in range(1, arguments.count + 1)]
        if not all((motion / f"{new}.bvh").is_file() for new in made):
            keydance(arguments, "regenerate", arguments.run, clip, "--music", song,
                     "--count", arguments.count, "--out", motion, "--force")
        for new in made:
            link(audio / f"{new}{song.suffix}", song)
        names["train"] += made
    lists = "".join(
        f"{part} = [{', '.join(json.dumps(name + '.bvh') for name in listed)}]\n"
        for part, listed in names.items()
    )
    config, run = arguments.out / "regenerated.toml", arguments.out / "run"
    config.write_text(
        f"base = {json.dumps(str((arguments.run / 'config.toml').resolve()))}\n"
        f'name = "regenerated"\n\n[data.split.list]\n{lists}'
    )
    begun = ["--resume"] if (run / "config.toml").is_file() else []
    if not (run / "weights.safetensors").is_file():
        keydance(arguments, "train", config, "--data", arguments.out / "data", "--out", run,
                 "--threads", arguments.threads, *begun)
    keydance(arguments, "evaluate", run, "--data", arguments.out / "data", "--threads", arguments.threads)


if __name__ == "__main__":
    try:
        main()
    except (Refused, OSError, KeyError, ValueError) as error:
        sys.exit(f"error: {error}")
