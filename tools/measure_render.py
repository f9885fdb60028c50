"""Frames a second that the painter makes, plain and with materials if there are any.

python tools/measure_render.py FILE [SIZE]
"""

from __future__ import annotations

import sys
import time

import gvpipe
from gvpipe.rasterizer.camera import framing

ROUNDS = 5  # the best of which counts: other work only ever slows one down


def main(path: str, size: int = 512) -> None:
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
    main(sys.argv[1], *map(int, sys.argv[2:3]))
