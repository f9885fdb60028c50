"""Frames a second that the rasterizer draws, plain and with materials if there are any.

python tools/measure_render.py FILE [SIZE]
"""

from __future__ import annotations

import argparse
import time

import gvpipe
from gvpipe.rasterizer.camera import framing

ROUNDS = 5  # the best of which counts: other work only ever slows one down


def main() -> None:
    """Measure, and print a line per number of samples."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", metavar="FILE", help="a sequence or a geometry video")
    parser.add_argument("size", metavar="SIZE", nargs="?", type=int, default=512, help="pixels [default: 512]")
    options = parser.parse_args()
    measure(options.file, options.size)


def measure(path: str, size: int) -> None:
    """Draw the first frames of a sequence with 1, 4 and 9 samples per pixel, pictures of ``size`` pixels a side."""
    sequence = gvpipe.read(path)
    frames = sequence.read(0, min(len(sequence), 50))
    camera = framing(sequence)
    print(f"{path}: {sequence.n_vertices} vertices, {len(sequence.faces)} triangles, {size}x{size}, smooth")
    kinds = {"plain": True, "materials": False} if sequence.materials else {"plain": True}
    for samples in (1, 2, 3):
        for name, plain in kinds.items():
            renderer = gvpipe.Renderer.of(sequence, (size, size), samples=samples, plain=plain)
            renderer.draw(frames[0], camera)  # loads or compiles
            wall, work = [], []
            for _ in range(ROUNDS):
                started, worked = time.perf_counter(), time.process_time()
                for positions in frames:
                    renderer.draw(positions, camera)
                wall.append((time.perf_counter() - started) / len(frames))
                work.append((time.process_time() - worked) / len(frames))
            core = 1000 * min(work)
            print(
                f"{samples}x{samples} samples a pixel, {name}: {1 / min(wall):.0f} frames/s, {core:.1f} ms of one core a frame"
            )


if __name__ == "__main__":
    main()
