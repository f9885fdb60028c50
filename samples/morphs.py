"""A face that blinks, smiles, frowns and speaks: six shapes over a rest pose. Half of its vertices never move."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from animation import Animation

Floats = npt.NDArray[np.float64]

FPS = 24.0
N_FRAMES = 96
N = 36  # vertices along each side of the sheet that the face is
KEYS = {  # weights of each shape: (second, weight); between keys they ease, outside they hold
    "blink": ((0.3, 0), (0.38, 1), (0.5, 0), (2.2, 0), (2.28, 1), (2.4, 0), (3.1, 0), (3.2, 1), (3.35, 0)),
    "smile": ((0.6, 0), (1.1, 1), (1.7, 1), (2.1, 0)),
    "jaw": ((1.0, 0), (1.2, 0.7), (1.35, 0.2), (1.5, 0.9), (1.7, 0), (2.6, 0), (2.8, 0.5), (3.0, 0)),
    "brows": ((0.8, 0), (1.0, 1), (1.4, 0), (2.5, 0), (2.7, -0.8), (3.2, -0.8), (3.6, 0)),
    "pucker": ((2.4, 0), (2.6, 1), (2.9, 0)),
    "sneer": ((2.9, 0), (3.1, 1), (3.4, 0)),
}
REACH = 2.4  # widths of a bump; beyond, nothing moves at all


def make_morphs() -> Animation:
    """Return 96 frames of a sheet of 1,296 vertices."""
    u, v = (each.ravel() for each in np.meshgrid(np.linspace(-1, 1, N), np.linspace(-1.25, 1.25, N)))
    depth = 0.9 * np.sqrt(1 - (u / 1.6) ** 2 - (v / 1.9) ** 2)
    depth += 0.30 * bump(u, v, 0, -0.05, 0.13, 0.28) + 0.10 * bump(u, v, 0, -0.6, 0.35, 0.16)
    for side in (-1, 1):
        depth += 0.06 * bump(u, v, side * 0.42, 0.45, 0.22, 0.09) - 0.10 * bump(u, v, side * 0.42, 0.25, 0.17, 0.10)
    rest = np.stack([u, v, depth], axis=1) * 0.1  # m
    time = np.arange(N_FRAMES) / FPS
    vertices = np.repeat(rest[None], N_FRAMES, axis=0)
    for name, shape in shapes(u, v).items():
        vertices += weights(time, KEYS[name])[:, None, None] * shape * 0.1
    corner = (np.arange(N - 1)[:, None] * N + np.arange(N - 1)).ravel()
    faces = np.concatenate([np.c_[corner, corner + 1, corner + N + 1], np.c_[corner, corner + N + 1, corner + N]])
    return Animation(vertices, faces.astype(np.int32), FPS)


def shapes(u: Floats, v: Floats) -> dict[str, Floats]:
    """The displacement of each vertex by each shape, ``(V, 3)``, in units of the sheet."""
    made = {name: np.zeros((len(u), 3)) for name in KEYS}
    for side in (-1, 1):
        lid, brow = bump(u, v, side * 0.42, 0.30, 0.16, 0.06), bump(u, v, side * 0.42, 0.50, 0.22, 0.09)
        corner = bump(u, v, side * 0.34, -0.60, 0.16, 0.12)
        made["blink"] += lid[:, None] * [0, -0.14, 0.05]
        made["brows"] += brow[:, None] * [0, 0.14, 0.03]
        made["smile"] += corner[:, None] * [side * 0.12, 0.12, -0.06]
        made["pucker"] += corner[:, None] * [-side * 0.14, 0, 0.12]
        made["sneer"] += bump(u, v, side * 0.2, -0.2, 0.1, 0.1)[:, None] * [side * 0.04, 0.08, 0.03]
    made["jaw"] += bump(u, v, 0, -0.95, 0.4, 0.22)[:, None] * [0, -0.30, -0.05]
    return made


def bump(u: Floats, v: Floats, at_u: float, at_v: float, wide: float, high: float) -> Floats:
    """A smooth bump of height 1, which is 0 at `REACH` of its widths and beyond."""
    squared = (((u - at_u) / wide) ** 2 + ((v - at_v) / high) ** 2) / REACH**2
    height: Floats = np.clip(1 - squared, 0, 1) ** 4
    return height


def weights(time: Floats, keys: tuple[tuple[float, float], ...]) -> Floats:
    """The weight at each time, s: eased between keys."""
    times, values = np.array(keys).T
    k = np.clip(np.searchsorted(times, time, side="right") - 1, 0, len(times) - 2)
    share = np.clip((time - times[k]) / (times[k + 1] - times[k]), 0, 1)
    eased = share**2 * (3 - 2 * share)
    weight: Floats = values[k] * (1 - eased) + values[k + 1] * eased
    return weight
