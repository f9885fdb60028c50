"""Default files against ``prediction=affine``, on sequences made here and on files: python tools/measure_held_out.py FILES.

Prints a table of bytes and errors (Karni and Gotsman) at quality 75. Made here: two robots of rigid parts, a walker whose
limbs bend, one whose limbs are rigid halves, a cloth, and a cloth as a triangle soup. Files are anything that gvpipe
reads; ``--soups`` measures them as triangle soups, too.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import gvpipe

FRAMES, FPS = 120, 30.0
Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="*", type=Path)
    parser.add_argument("--soups", action="store_true", help="files as triangle soups, too")
    parser.add_argument("--only", action="store_true", help="files alone, nothing made here")
    given = parser.parse_args()
    print("| sequence | F | V | default, bytes | KG | affine, bytes | KG | default / affine |\n| --- |" + " --- |" * 7)
    for name, sequence in ({} if given.only else made()).items():
        print(measure(name, sequence), flush=True)
    for path in given.files:
        sequence = shape_alone(gvpipe.read(path))
        print(measure(path.stem, sequence), flush=True)
        if given.soups:
            print(measure(f"{path.stem}, soup", soup(sequence)), flush=True)


def made() -> dict[str, gvpipe.MeshSequence]:
    """The sequences made here."""
    cloth = make_cloth(49)
    return {
        "robot, 13 boxes": make_robot(13, box(13)),
        "robot, 9 cylinders": make_robot(9, cylinder(48, 25)),
        "walker, limbs that bend": make_walker(bend_width=0.04),
        "walker, rigid halves": make_walker(bend_width=0.0),
        "cloth": make_cloth(65),
        "cloth, soup": soup(cloth),
    }


def measure(name: str, sequence: gvpipe.MeshSequence) -> str:
    """A row of the table."""
    cells, sizes = [], []
    for prediction in ("blended", "affine"):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "x.mp4"
            gvpipe.encode(sequence, path, "mcgv", prediction=prediction)
            sizes.append(path.stat().st_size)
            cells += [str(sizes[-1]), f"{gvpipe.compare(sequence, gvpipe.decode(path)).kg:.3f}"]
    counts = f"{sequence.n_frames} | {sequence.n_vertices}"
    return f"| {name} | {counts} | {' | '.join(cells)} | {100 * sizes[0] / sizes[1]:.0f} % |"


def shape_alone(sequence: gvpipe.MeshSequence) -> gvpipe.MeshSequence:
    """Positions and triangles without what lies beside them."""
    return gvpipe.MeshSequence(sequence.read(0, sequence.n_frames), sequence.faces, sequence.fps)


def soup(sequence: gvpipe.MeshSequence) -> gvpipe.MeshSequence:
    """Every triangle with three vertices of its own."""
    corners = sequence.faces.ravel()
    own = np.arange(len(corners), dtype=np.int32).reshape(-1, 3)
    return gvpipe.MeshSequence(sequence.read(0, sequence.n_frames)[:, corners], own, sequence.fps)


def make_cloth(side: int) -> gvpipe.MeshSequence:
    """A square cloth, flat at first, over which waves of three lengths grow."""
    x, z = (axis.ravel() / (side - 1) for axis in np.meshgrid(np.arange(side), np.arange(side), indexing="ij"))
    frames = []
    for t in np.arange(FRAMES) / FPS:
        swing = min(t, 1.0) * x
        y = swing * (
            0.15 * np.sin(7 * x - 5 * t) + 0.06 * np.sin(11 * z + 4 * t + 3 * x) + 0.03 * np.sin(23 * x + 9 * z - 8 * t)
        )
        frames.append(np.column_stack([x - 0.3 * swing * y, y, z + 0.05 * swing * np.sin(5 * z - 3 * t)]))
    return gvpipe.MeshSequence(np.array(frames, np.float32), grid(side, side).astype(np.int32), FPS)


def make_robot(n_parts: int, part: tuple[Floats, Ints]) -> gvpipe.MeshSequence:
    """An arm of rigid parts of several sizes, each turning at a joint at the end of the one before."""
    points, faces = part
    sizes = 0.4 + 0.6 * np.abs(np.cos(1.7 * np.arange(n_parts)))
    frames = []
    for t in np.arange(FRAMES) / FPS:
        turn, joint, parts = np.eye(3), np.zeros(3), []
        for k, size in enumerate(sizes):
            turn = turn @ rotation(0.5 * np.sin((1 + k % 3) * t + k), k % 3)
            parts.append(joint + size * points @ turn.T)
            joint = joint + size * 1.1 * turn[:, 1]
        frames.append(np.concatenate(parts))
    every = np.concatenate([faces + k * len(points) for k in range(n_parts)])
    return gvpipe.MeshSequence(np.array(frames, np.float32), every.astype(np.int32), FPS)


def make_walker(bend_width: float) -> gvpipe.MeshSequence:
    """Two legs, two arms, a body and a head that walk on; knees and elbows bend over a width of the limb, or sharply (0)."""
    limbs = [
        (-0.12, 0.0, 0.6, 0.4, 0.0),
        (0.12, 0.0, 0.6, 0.4, np.pi),
        (-0.28, 0.62, 0.5, -0.3, np.pi),
        (0.28, 0.62, 0.5, -0.3, 0.0),
    ]
    tube, tube_faces = capsule(32, 52)
    frames = []
    for k in range(FRAMES):
        phase = 2 * np.pi * k / 40
        parts = []
        for x, y, swing, bend, offset in limbs:
            half = 0.5 if y == 0 else 0.33
            down = tube * (0.09, -2 * half, 0.09)
            beyond = -down[:, 1:2] - half
            lower = 1 / (1 + np.exp(-beyond / bend_width)) if bend_width else (beyond > 0).astype(float)
            upper_turn = rotation(swing * np.sin(phase + offset), 0)
            lower_turn = upper_turn @ rotation(bend * (1 + np.sin(phase + offset + 1)), 0)
            joint = np.array([0.0, -half, 0.0])
            bent = (down - joint) @ lower_turn.T + upper_turn @ joint
            parts.append((1 - lower) * (down @ upper_turn.T) + lower * bent + (x, y, 0.0))
        parts.append(tube * (0.2, 0.65, 0.15) @ rotation(0.15 * np.sin(phase), 1).T)
        parts.append(tube * (0.12, 0.25, 0.12) @ rotation(0.1 * np.sin(2 * phase), 0).T + (0.0, 0.7, 0.0))
        frames.append(np.concatenate(parts) + np.array([0.0, 0.04 * np.cos(2 * phase), 1.2 * k / 40]))
    faces = np.concatenate([tube_faces + k * len(tube) for k in range(6)])
    return gvpipe.MeshSequence(np.array(frames, np.float32), faces.astype(np.int32), FPS)


def capsule(n_around: int, n_along: int) -> tuple[Floats, Ints]:
    """A tube of radius 1 around y, from 0 to 1, that narrows at both ends and bulges a little; its rings are closed."""
    angle, along = 2 * np.pi * np.arange(n_around) / n_around, np.linspace(0.0, 1.0, n_along)
    radius = np.sqrt(np.clip(1 - np.clip(np.abs(2 * along - 1) - 0.8, 0, 0.199) ** 2 / 0.04, 0, 1)) * (
        1 + 0.15 * np.sin(3 * along)
    )
    rings = [
        np.column_stack([r * np.cos(angle), np.full(n_around, y), r * np.sin(angle)])
        for r, y in zip(radius, along, strict=True)
    ]
    seam = np.arange(n_along)[:, None] * n_around
    corner = seam[:-1] + np.arange(n_around)
    beside = seam[:-1] + (np.arange(n_around) + 1) % n_around
    first = np.stack([corner, corner + n_around, beside], axis=-1)
    second = np.stack([beside, corner + n_around, beside + n_around], axis=-1)
    return np.concatenate(rings), np.concatenate([first.reshape(-1, 3), second.reshape(-1, 3)])


def box(side: int) -> tuple[Floats, Ints]:
    """A box with hard edges: six grids, each with vertices of its own; its base is at the origin, its height along y is 1."""
    u, v = (axis.ravel() / (side - 1) - 0.5 for axis in np.meshgrid(np.arange(side), np.arange(side), indexing="ij"))
    sheets = []
    for axis in range(3):
        for end in (-0.5, 0.5):
            across = (v, u) if end < 0 else (u, v)
            sheets.append(np.insert(np.column_stack(across), axis, end, axis=1))
    points = np.concatenate(sheets) * (0.5, 1, 0.3) + (0, 0.5, 0)
    faces = np.concatenate([grid(side, side)[:, :: 1 if k // 2 == 1 else -1] + k * side**2 for k in range(6)])
    return points, faces


def cylinder(n_around: int, n_along: int) -> tuple[Floats, Ints]:
    """A round part without caps: rings around y, from 0 to 1."""
    angle = 2 * np.pi * np.arange(n_around + 1) / n_around
    ring = np.column_stack([0.2 * np.cos(angle), 0 * angle, 0.2 * np.sin(angle)])
    rings = [ring + np.array([0, y, 0]) for y in np.linspace(0, 1, n_along)]
    return np.concatenate(rings), grid(n_along, n_around + 1)


def grid(rows: int, columns: int) -> Ints:
    """Triangles of a grid of vertices."""
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    return np.concatenate([corner[:, None] + (0, 1, columns), corner[:, None] + (1, columns + 1, columns)])


def rotation(angle: float, axis: int) -> Floats:
    """A rotation about an axis."""
    c, s = np.cos(angle), np.sin(angle)
    return np.roll(np.array([[1, 0, 0], [0, c, -s], [0, s, c]]), (axis, axis), (0, 1))


if __name__ == "__main__":
    main()
