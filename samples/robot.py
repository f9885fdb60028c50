"""A robot arm that picks something up and sets it down: rigid parts on six joints, in a loop."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from animation import Animation

Floats = npt.NDArray[np.float64]
Faces = npt.NDArray[np.int32]

FPS = 30.0
N_FRAMES = 120
N_AROUND = 24  # vertices of a cylinder's rim
KEYS = np.deg2rad(  # joint angles at equal times: waist, shoulder, elbow, wrist roll, wrist pitch, fingers
    [
        [0, -20, 70, 0, 40, 20],
        [-60, 10, 60, 0, 20, 20],
        [-60, 35, 50, 90, 5, 20],
        [-60, 35, 50, 90, 5, -5],
        [-20, -15, 80, 45, 25, -5],
        [70, 20, 60, 0, 10, -5],
        [70, 38, 45, 0, 7, -5],
        [70, 38, 45, 0, 7, 20],
    ]
)
LINKS = (  # of each joint: its axis, its place on the link before, m, and the parts that it turns
    ("y", (0, 0.10, 0), (("cylinder", (0.11, 0.06), (0, 0.03, 0)), ("box", (0.14, 0.16, 0.10), (0, 0.13, 0)))),
    ("x", (0, 0.18, 0), (("cylinder", (0.07, 0.16), (0, 0, 0)), ("box", (0.08, 0.42, 0.09), (0, 0.22, 0)))),
    ("x", (0, 0.44, 0), (("cylinder", (0.06, 0.14), (0, 0, 0)), ("box", (0.06, 0.32, 0.07), (0, 0.17, 0)))),
    ("y", (0, 0.34, 0), (("cylinder", (0.045, 0.08), (0, 0.03, 0)),)),
    ("x", (0, 0.09, 0), (("cylinder", (0.04, 0.09), (0, 0, 0)), ("box", (0.08, 0.05, 0.05), (0, 0.05, 0)))),
)
FINGER = ("box", (0.012, 0.09, 0.03), (0, 0.045, 0))


def make_robot() -> Animation:
    """Return 120 frames of 13 rigid parts."""
    angles = keyed(KEYS, N_FRAMES)  # (F, 6)
    pieces, faces, n = [], [], 0
    turn = np.broadcast_to(np.eye(3), (N_FRAMES, 3, 3))
    place = np.zeros((N_FRAMES, 3))

    def add(part: tuple[str, tuple[float, ...], tuple[float, ...]], turn: Floats, place: Floats) -> None:
        nonlocal n
        kind, size, middle = part
        points, triangles = box(size[0], size[1], size[2]) if kind == "box" else cylinder(size[0], size[1])
        pieces.append(np.einsum("fij,vj->fvi", turn, points + middle) + place[:, None])
        faces.append(triangles + n)
        n += len(points)

    add(("cylinder", (0.16, 0.10), (0, 0.05, 0)), turn, place)
    for k, (axis, offset, parts) in enumerate(LINKS):
        place = place + turn @ np.array(offset)
        turn = turn @ rotation(axis, angles[:, k])
        for part in parts:
            add(part, turn, place)
    for side in (-1, 1):
        place_of = place + turn @ np.array([side * 0.025, 0.075, 0])
        add(FINGER, turn @ rotation("z", -side * angles[:, 5]), place_of)
    return Animation(np.concatenate(pieces, axis=1), np.concatenate(faces).astype(np.int32), FPS)


def keyed(keys: Floats, n_frames: int) -> Floats:
    """Values between keys at equal times in a loop, resting at each: ``(F, joints)``."""
    time = np.arange(n_frames) * len(keys) / n_frames
    before = time.astype(int)
    share = (time - before)[:, None]
    eased = share**2 * (3 - 2 * share)
    values: Floats = keys[before] * (1 - eased) + keys[(before + 1) % len(keys)] * eased
    return values


def rotation(axis: str, angle: Floats) -> Floats:
    """Rotations ``(F, 3, 3)`` about an axis, rad."""
    first, second = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    made = np.zeros((len(angle), 3, 3))
    made[:, range(3), range(3)] = 1
    made[:, first, first] = made[:, second, second] = np.cos(angle)
    made[:, first, second], made[:, second, first] = -np.sin(angle), np.sin(angle)
    return made


def box(width: float, height: float, depth: float, n: int = 5) -> tuple[Floats, Faces]:
    """A box about the origin, each side of n x n squares with vertices of its own; hard edges."""
    u, v = np.meshgrid(np.linspace(-0.5, 0.5, n), np.linspace(-0.5, 0.5, n))
    side = np.stack([u.ravel(), v.ravel(), np.full(n * n, 0.5)], axis=1)
    corner = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    own = np.concatenate([np.c_[corner, corner + 1, corner + n + 1], np.c_[corner, corner + n + 1, corner + n]])
    turns = [np.roll(side, k, axis=1) * sign for k in range(3) for sign in (1, -1)]
    faces = [own[:, ::sign] + k * n * n for k, sign in enumerate([1, -1] * 3)]
    return np.concatenate(turns) * [width, height, depth], np.concatenate(faces).astype(np.int32)


def cylinder(radius: float, length: float) -> tuple[Floats, Faces]:
    """A cylinder about the axis y; its caps have vertices of their own."""
    angle = 2 * np.pi * np.arange(N_AROUND) / N_AROUND
    rim = np.stack([radius * np.cos(angle), np.zeros(N_AROUND), -radius * np.sin(angle)], axis=1)
    half = np.array([0, length / 2, 0])
    points = np.concatenate([rim - half, rim + half, rim - half, rim + half, [-half, half]])
    a, b = np.arange(N_AROUND), (np.arange(N_AROUND) + 1) % N_AROUND
    sides = np.concatenate([np.c_[a, b, b + N_AROUND], np.c_[a, b + N_AROUND, a + N_AROUND]])
    low = np.c_[b, a, np.full(N_AROUND, 2 * N_AROUND)] + 2 * N_AROUND
    high = np.c_[a + N_AROUND, b + N_AROUND, np.full(N_AROUND, 2 * N_AROUND + 1)] + 2 * N_AROUND
    return points, np.concatenate([sides, low, high]).astype(np.int32)
