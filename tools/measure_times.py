"""Times of `mcgv`: encoding as a whole command, opening, decoding, playing: python tools/measure_times.py SEQUENCE [--torus].

Prints a table. The sequence (samba in the documentation) is encoded at default settings by ``gvpipe encode``; then the file is
opened, decoded whole and played in order, in one process. ``--torus`` encodes a torus of waves made here, too: 102,400 vertices
in 30 frames, at default settings and with ``prediction=affine``. Kernels are compiled before; medians of ``--times`` runs.
"""

from __future__ import annotations

import argparse
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

import gvpipe

SIDE, FRAMES, FPS = 320, 30, 30.0  # of the torus


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sequence", type=Path)
    parser.add_argument("--torus", action="store_true", help="a torus of waves, too")
    parser.add_argument("--times", type=int, default=3, help="runs of each")
    given = parser.parse_args()
    print("| what | median | least | most |\n| --- | --- | --- | --- |")
    with tempfile.TemporaryDirectory() as folder:
        video, torus = Path(folder, "video.mp4"), Path(folder, "torus.npz")
        encode(given.sequence, video)  # compiles
        seconds(f"encode {given.sequence.stem}", given.times, partial(encode, given.sequence, video))
        gvpipe.decode(video)
        milliseconds("open it and show frame 0", given.times, lambda: show(video))
        frames = len(gvpipe.read(given.sequence))
        rates("decode it whole", given.times, frames, lambda: gvpipe.decode(video))
        with gvpipe.open(video) as player:
            rates("play it in order, once open", given.times, frames, lambda: [player[k] for k in range(frames)])
        if given.torus:
            gvpipe.write(make_torus(), torus)
            for settings in ([], ["--set", "prediction=affine"]):
                seconds(" ".join(["encode the torus", *settings]), given.times, partial(encode, torus, video, *settings))


def encode(source: Path, target: Path, *options: str) -> None:
    """Run the command."""
    subprocess.run([sys.executable, "-m", "gvpipe", "encode", "--quiet", source, target, *options], check=True)


def show(path: Path) -> None:
    """Open a file, and decode its first frame."""
    with gvpipe.open(path) as player:
        player[0]


def seconds(what: str, times: int, run: Callable[[], object]) -> None:
    """Print seconds."""
    show_row(what, [f"{value:.1f} s" for value in spread(measured(run, times))])


def milliseconds(what: str, times: int, run: Callable[[], object]) -> None:
    """Print milliseconds."""
    show_row(what, [f"{1000 * value:.0f} ms" for value in spread(measured(run, times))])


def rates(what: str, times: int, frames: int, run: Callable[[], object]) -> None:
    """Print frames per second."""
    show_row(what, [f"{value:.0f} frames/s" for value in spread([frames / taken for taken in measured(run, times)])])


def measured(run: Callable[[], object], times: int) -> list[float]:
    """Seconds of each run."""
    taken = []
    for _ in range(times):
        started = time.perf_counter()
        run()
        taken.append(time.perf_counter() - started)
    return taken


def spread(values: list[float]) -> tuple[float, float, float]:
    """Median, least and most."""
    return statistics.median(values), min(values), max(values)


def show_row(what: str, cells: list[str]) -> None:
    """Print a row of the table."""
    print(f"| {what} | {' | '.join(cells)} |", flush=True)


def make_torus() -> gvpipe.MeshSequence:
    """A torus over which waves run."""
    around, along = (2 * np.pi * axis / SIDE for axis in np.meshgrid(np.arange(SIDE), np.arange(SIDE), indexing="ij"))
    frames = []
    for t in 2 * np.pi * np.arange(FRAMES) / FRAMES:
        radius = 0.4 + 0.05 * np.sin(3 * around + 2 * along + t) + 0.03 * np.sin(7 * along - 3 * t)
        ring = 1 + radius * np.cos(along)
        points = np.stack([ring * np.cos(around), ring * np.sin(around), radius * np.sin(along)], axis=-1)
        frames.append(points.reshape(-1, 3))
    corner = np.arange(SIDE * SIDE).reshape(SIDE, SIDE)
    across, beside = np.roll(corner, -1, axis=0), np.roll(corner, -1, axis=1)
    beyond = np.roll(across, -1, axis=1)
    halves = np.stack([corner, across, beyond], axis=-1), np.stack([corner, beyond, beside], axis=-1)
    faces = np.concatenate([half.reshape(-1, 3) for half in halves])
    return gvpipe.MeshSequence(np.array(frames, np.float32), faces.astype(np.int32), FPS)


if __name__ == "__main__":
    main()
