"""The memory that encoding a long scene takes.

    python tools/measure_memory.py abc usdc [--codec pca] [--frames 2000] [--side 100] [--noise 0.001]

For each format: a waving sheet is written, ``gvpipe encode`` runs on it in a process of its own, and the largest resident
memory of that process is read from ``/proc`` (VmHWM; Linux alone), that of the largest process that it starts beside.

Status 1: an encode fails, or its process takes more than a gigabyte (1e9 bytes).
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import gvpipe
from gvpipe.foundation.arrays import Float32

MOST = 1e9  # bytes
WAVES = (
    (0.05, 1.0, 0.3, 0.11),
    (0.03, -0.7, 1.1, 0.07),
    (0.02, 2.1, 1.7, 0.19),
)  # height, turns per side (x, y), radians a frame
PAUSE = 0.1  # seconds between looks at the processes


class Sheet:
    """Frames of a waving sheet of `side` x `side` vertices, made when sliced: ``(F, V, 3) float32``."""

    def __init__(self, n_frames: int, side: int, noise: float) -> None:
        grid = np.linspace(0, 1, side)
        self._x, self._y = (each.reshape(-1) for each in np.meshgrid(grid, grid))
        self._noise = noise
        self.shape = (n_frames, side * side, 3)

    def __getitem__(self, key: slice) -> Float32:
        numbers = range(*key.indices(self.shape[0]))
        frames = np.array(numbers)[:, None]
        heights = sum(
            height * np.sin(2 * np.pi * (u * self._x + v * self._y) + speed * frames) for height, u, v, speed in WAVES
        )
        if self._noise:
            heights += self._noise * np.stack([np.random.default_rng(i).standard_normal(self.shape[1]) for i in numbers])
        block = np.empty((len(frames), *self.shape[1:]), np.float32)
        block[..., 0], block[..., 1], block[..., 2] = self._x, self._y, heights
        return block


def main() -> int:
    """Measure the formats that the command line names."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("formats", nargs="+", help="extensions of scenes: abc, usdc")
    parser.add_argument("--codec", default="mcgv", help="[default: mcgv]")
    parser.add_argument("--frames", type=int, default=2000, help="[default: 2000]")
    parser.add_argument("--side", type=int, default=100, help="vertices of a side of the sheet [default: 100]")
    parser.add_argument(
        "--noise", type=float, default=0.0, help="standard deviation of heights, sides of the sheet [default: 0]"
    )
    given = parser.parse_args()
    is_large = False
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        for suffix in given.formats:
            source, video = folder / f"sheet.{suffix}", folder / f"sheet-{suffix}.mp4"
            gvpipe.write(sheet(given.frames, given.side, given.noise), source)
            started = time.monotonic()
            status, own, other = peaks(
                [sys.executable, "-m", "gvpipe", "encode", str(source), str(video), "--codec", given.codec]
            )
            is_large |= status != 0 or own > MOST
            size = source.stat().st_size / 1e6
            taken = time.monotonic() - started
            most = f"{own / 1e6:.0f} MB, largest process beside it {other / 1e6:.0f} MB"
            print(f".{suffix} ({size:.0f} MB), {given.codec}: {most}, {taken:.0f} s, status {status}", flush=True)
    return int(is_large)


def sheet(n_frames: int, side: int, noise: float) -> gvpipe.MeshSequence:
    """The waving sheet, two triangles a square."""
    corner = (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).reshape(-1)
    faces = np.concatenate(
        [np.stack([corner, corner + 1, corner + side], 1), np.stack([corner + 1, corner + side + 1, corner + side], 1)]
    )
    return gvpipe.MeshSequence(Sheet(n_frames, side, noise), faces.astype(np.int32), 24.0)


def peaks(command: list[str]) -> tuple[int, int, int]:
    """Run a command; return its status, the largest memory of its process, and of any process below it, bytes."""
    process = subprocess.Popen(command)
    own = other = 0
    while process.poll() is None:
        own = max(own, peak(process.pid))
        other = max([other, *map(peak, below(process.pid))])
        time.sleep(PAUSE)
    return process.returncode, own, other


def peak(pid: int) -> int:
    """The largest resident memory that a process has had, bytes; 0 if it is gone."""
    try:
        lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    except OSError:
        return 0
    return next((int(line.split()[1]) * 1024 for line in lines if line.startswith("VmHWM:")), 0)


def below(pid: int) -> list[int]:
    """The processes that a process has started, and those below them."""
    found: list[int] = []
    for file in Path(f"/proc/{pid}/task").glob("*/children"):
        try:
            children = [int(each) for each in file.read_text().split()]
        except OSError:
            continue
        found += [each for child in children for each in (child, *below(child))]
    return found


if __name__ == "__main__":
    sys.exit(main())
