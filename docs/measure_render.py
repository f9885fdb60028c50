"""Frames a second that the painter makes: python docs/measure_render.py FILE [SIZE]."""

from __future__ import annotations

import sys
import time

import gvpipe
from gvpipe.rendering.camera import framing

ROUNDS = 5  # the best of which counts: other work only ever slows one down


def main(path: str, size: int = 512) -> None:
    sequence = gvpipe.read(path)
    frames = sequence.read(0, min(len(sequence), 50))
    camera = framing(sequence)
    print(f"{path}: {sequence.n_vertices} vertices, {len(sequence.faces)} triangles, {size}x{size}, smooth")
    for samples in (1, 2, 3):
        renderer = gvpipe.Renderer(sequence.faces, frames[0], (size, size), samples=samples)
        renderer.draw(frames[0], camera)  # loads or compiles
        best = float("inf")
        for _ in range(ROUNDS):
            started = time.perf_counter()
            for positions in frames:
                renderer.draw(positions, camera)
            best = min(best, time.perf_counter() - started)
        seconds = best / len(frames)
        print(f"{samples}x{samples} samples a pixel: {1 / seconds:.0f} frames/s, {1000 * seconds:.1f} ms a frame")


if __name__ == "__main__":
    main(sys.argv[1], *map(int, sys.argv[2:3]))
