"""Compares what keydance hears with librosa 0.11, and the CPU seconds of both, song by song.

Usage: python scripts/compare_librosa.py --keydance target/release/keydance SONG..

Needs librosa, numpy and soundfile. One core: librosa's threads are limited, and its functions are
compiled on the first song before any time is taken.
"""

import argparse
import json
import os
import resource
import subprocess
import tempfile
import time
from pathlib import Path

for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ[threads] = "1"

import librosa  # noqa: E402
import numpy as np  # noqa: E402

RATE, HOP, WINDOW = 22_050, 735, 2048


def librosa_hears(song):
    samples, _ = librosa.load(song, sr=RATE)
    frames = len(samples) // HOP
    spectrum = librosa.stft(samples, n_fft=WINDOW, hop_length=HOP)[:, : frames + 1]
    power = np.abs(spectrum) ** 2
    mel = librosa.power_to_db(librosa.feature.melspectrogram(S=power, sr=RATE, n_mels=128))
    frame = {"sr": RATE, "hop_length": HOP}
    onset = librosa.onset.onset_strength(S=mel, n_fft=WINDOW, **frame)
    chroma = librosa.feature.chroma_stft(S=power, n_fft=WINDOW, tuning=0.0, **frame)
    mfcc = librosa.feature.mfcc(S=mel, n_mfcc=20)
    tempo, beats = librosa.beat.beat_track(onset_envelope=onset, start_bpm=100, **frame)
    peaks = librosa.onset.onset_detect(onset_envelope=onset, **frame)
    features = {"mel": mel, "onset": onset[None], "chroma": chroma, "mfcc": mfcc}
    features = {name: value[:, :frames].T for name, value in features.items()}
    heard = {
        "tempo": float(np.atleast_1d(tempo)[0]),
        "beats": [int(beat) for beat in beats],
        "peaks": [int(peak) for peak in peaks],
    }
    return features, heard


def keydance_hears(keydance, song):
    """Features and beats, and the CPU seconds of the one run that has neither cache nor output."""
    command = [keydance, "music", song, "--no-cache"]
    with tempfile.TemporaryDirectory() as folder:
        arrays = {}
        for features in ("mel128", "fact35"):
            npy, beats = Path(folder, f"{features}.npy"), Path(folder, f"{features}.json")
            written = ["--npy", npy, "--features", features, "--json", beats]
            subprocess.run(command + written, check=True, stdout=subprocess.DEVNULL)
            arrays[features] = np.load(npy)
            json_text = beats.read_text()
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    fact35, beats = arrays["fact35"], json.loads(json_text)
    features = {
        "mel": arrays["mel128"],
        "onset": fact35[:, :1],
        "mfcc": fact35[:, 1:21],
        "chroma": fact35[:, 21:33],
    }
    heard = {
        "tempo": beats["tempo_bpm"],
        "beats": beats["beats"],
        "peaks": beats["onset_peaks"],
    }
    return features, heard, seconds


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--keydance", required=True)
    parser.add_argument("songs", nargs="+")
    arguments = parser.parse_args()
    librosa_hears(arguments.songs[0])
    totals = np.zeros(2)
    for song in arguments.songs:
        start = time.process_time()
        their_features, theirs = librosa_hears(song)
        their_seconds = time.process_time() - start
        our_features, ours, our_seconds = keydance_hears(arguments.keydance, song)
        totals += our_seconds, their_seconds
        print(song)
        for name, value in their_features.items():
            print(f"  {name:<7} largest difference {np.abs(our_features[name] - value).max():.1e}")
        for name, value in theirs.items():
            print(f"  {name:<7} {'equal' if ours[name] == value else 'DIFFERENT'}")
        print(f"  CPU seconds: keydance {our_seconds:.2f}, librosa {their_seconds:.2f}")
    print(f"CPU seconds in all: keydance {totals[0]:.2f}, librosa {totals[1]:.2f}")


if __name__ == "__main__":
    main()
