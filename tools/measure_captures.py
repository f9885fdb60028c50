"""Seconds to write a capture of many short shots in each format, and to read it back: a shot for each frame.

    python tools/measure_captures.py [FRAMES...]

It prints a Markdown table.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np

import gvpipe
from gvpipe.model.sequence import MeshSequence

OUTPUTS = ("obj/%04d.obj", "ply/%04d.ply", "stl/%04d.stl", "a.usdc", "a.abc", "a.glb", "a.vtkhdf", "a.pvd")


def sheet(side: int, height: float) -> MeshSequence:
    """One frame of a square of ``side`` x ``side`` vertices."""
    place = np.stack(np.meshgrid(np.arange(side), np.arange(side), indexing="ij"), axis=-1).reshape(-1, 2)
    points = np.column_stack([place, np.full(len(place), height)]).astype(np.float32)
    corner = (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).reshape(-1)
    quads = corner[:, None] + np.array([0, side, side + 1, 1])
    return MeshSequence(points[None], np.concatenate([quads[:, :3], quads[:, [0, 2, 3]]]).astype(np.int32), 25.0)


def main() -> None:
    """Print a row for each format, with two columns for each number of frames."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("counts", nargs="*", type=int, default=[100, 300], metavar="FRAMES")
    counts = parser.parse_args().counts
    print("| format | " + " | ".join(f"write {n} | read {n}" for n in counts) + " |")
    print("| --- |" + " --- | --- |" * len(counts))
    for output in OUTPUTS:
        row = []
        for n_frames in counts:
            capture = gvpipe.Capture([sheet(5 + frame % 3, 0.1 * frame) for frame in range(n_frames)])
            with tempfile.TemporaryDirectory() as folder:
                path = Path(folder) / output
                started = time.perf_counter()
                gvpipe.write(capture, path)
                written = time.perf_counter()
                found = gvpipe.read_capture(path.parent if "%" in output else path)
                read = time.perf_counter()
                assert found.lengths == (1,) * n_frames
            row += [f"{written - started:.1f}", f"{read - written:.1f}"]
        print(f"| {Path(output).suffix} | " + " | ".join(row) + " |", flush=True)


if __name__ == "__main__":
    main()
