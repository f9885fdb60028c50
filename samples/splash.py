"""Two drops that meet, fly on as one, and part: a capture, whose vertices and triangles change from frame to frame.

The surface is the smooth union of two balls (`implicit`), cut into triangles on a grid that flies with the drops
(`polygonise`). So frames in which the drops keep their distance have the same triangles, and all others have their own.
Run it to write ``splash/splash_01.obj`` and so on; `gvpipe encode samples/splash splash.mp4` makes one file of all.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import numpy.typing as npt
from implicit import RoundCone, distance_to_body, project_to_body
from polygonise import surface_nets

Floats = npt.NDArray[np.float64]
Faces = npt.NDArray[np.int32]

FPS = 30.0
GAPS = (0.62, 0.62, 0.62, 0.54, 0.47, 0.41, 0.36, 0.36, 0.36, 0.44, 0.53, 0.62)  # m, between the balls' centres, by frame
RADII = (0.211, 0.187)  # m
BLEND = 0.137  # m; reach of the neck between them
CELL = 0.083  # m, of the grid; no multiple of it is a radius or a gap, so that no diagonals of a quad are equally long
REACH = (9, 5, 5)  # cells of the grid on either side of the middle
SPEED = np.array([0.9, 2.4, 0.3])  # m/s at the start
GRAVITY = np.array([0.0, -9.81, 0.0])  # m/s^2
TIP = 0.01  # m, length of a round cone that is nearly a ball
SHIFT = np.array([0.0127, 0.0219, 0.0071])  # m, of the grid


def drops(gap: float) -> list[RoundCone]:
    """The two balls, so far apart."""
    first, second = RADII
    left, right = -gap / 2, gap / 2
    return [
        RoundCone("left", (left, 0.0, 0.0), (left, TIP, 0.0), first, first, 0.0),
        RoundCone("right", (right, 0.0, 0.0), (right, -TIP, 0.0), second, second, BLEND),
    ]


def make_splash() -> list[tuple[Floats, Faces]]:
    """Return vertices ``(V, 3)``, m, and triangles ``(T, 3)`` of each frame."""
    axes = [CELL * np.arange(-n, n + 1) + shift for n, shift in zip(REACH, SHIFT, strict=True)]
    frames = []
    for number, gap in enumerate(GAPS):
        parts = drops(gap)
        points, faces = surface_nets(lambda places, parts=parts: distance_to_body(places, parts), axes)  # type: ignore[misc]
        time = number / FPS
        frames.append((project_to_body(points, parts) + SPEED * time + 0.5 * GRAVITY * time**2, faces))
    return frames


def write_splash(folder: Path) -> None:
    """Write ``splash_01.obj`` and so on, rounded to 1 mm."""
    folder.mkdir(parents=True, exist_ok=True)
    for number, (points, faces) in enumerate(make_splash(), start=1):
        vertices = "".join(f"v {x:.3f} {y:.3f} {z:.3f}\n" for x, y, z in (np.round(points, 3) + 0.0).tolist())
        triangles = "".join(f"f {a} {b} {c}\n" for a, b, c in (faces + 1).tolist())
        (folder / f"splash_{number:02d}.obj").write_bytes((vertices + triangles).encode("ascii"))


def main() -> None:
    """Write the frames to the folder given, by default ``splash`` beside this script."""
    parser = argparse.ArgumentParser(description="Make gvpipe's sample of a capture.")
    here = Path(__file__).resolve().parent
    parser.add_argument("output", nargs="?", type=Path, default=here / "splash", metavar="OUTPUT_FOLDER")
    write_splash(parser.parse_args().output)


if __name__ == "__main__":
    main()
