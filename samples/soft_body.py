"""A pudding that lands on a table, sways, twists and wobbles until it rests: five damped modes of an elastic solid."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from animation import Animation

Floats = npt.NDArray[np.float64]

FPS = 30.0
N_FRAMES = 90
N_RINGS, N_AROUND = 24, 40
HEIGHT, RADIUS = 0.12, 0.08  # m
DROP = 0.15  # s of free fall before it lands
GRAVITY = 9.81  # m/s^2


def make_soft_body() -> Animation:
    """Return 90 frames of 962 vertices, closed."""
    rest, faces = pudding()
    x, y, z = rest.T
    up = y / HEIGHT  # 0 at the table, 1 at the top
    since = np.arange(N_FRAMES)[:, None] / FPS - DROP  # (F, 1)
    falling = np.where(since < 0, 0.5 * GRAVITY * (DROP**2 - (since + DROP) ** 2), 0.0)
    squash = 0.35 * ring(since, 4.1, 2.4)
    sway = 0.45 * HEIGHT * ring(since, 2.6, 1.3), 0.25 * HEIGHT * ring(since - 0.05, 2.9, 1.5)
    twist = 0.5 * ring(since, 3.3, 1.7)  # rad at the top
    ripple = 0.10 * ring(since, 7.7, 3.5)
    width = 1 + up * (squash * 0.5 + ripple * np.sin(9 * up))
    angle = twist * up**2
    turned_x, turned_z = x * np.cos(angle) - z * np.sin(angle), x * np.sin(angle) + z * np.cos(angle)
    vertices = np.stack(
        [
            turned_x * width + sway[0] * up**1.5,
            y * (1 - 0.6 * squash * up) + falling,
            turned_z * width + sway[1] * up**1.5,
        ],
        axis=2,
    )
    return Animation(vertices, faces, FPS)


def ring(since: Floats, frequency: float, decay: float) -> Floats:
    """A mode that is struck at time 0: its deflection at times in seconds, Hz and 1/s given."""
    after = np.maximum(since, 0)
    deflection: Floats = np.sin(2 * np.pi * frequency * after) * np.exp(-decay * after)
    return deflection


def pudding() -> tuple[Floats, npt.NDArray[np.int32]]:
    """A ribbed solid of revolution: vertices (N_RINGS * N_AROUND + 2, 3), m, and triangles."""
    along = np.linspace(0, 1, N_RINGS)
    around = 2 * np.pi * np.arange(N_AROUND) / N_AROUND
    rounded = np.sqrt(np.clip(1 - np.clip((along - 0.8) / 0.2, 0, 1) ** 2, 0.2, 1))  # the upper edge
    radius = RADIUS * (1 - 0.35 * along[:, None]) * rounded[:, None] * (1 + 0.06 * np.cos(8 * around))
    height = np.broadcast_to(HEIGHT * along[:, None], radius.shape)
    rings = np.stack([radius * np.cos(around), height, -radius * np.sin(around)], axis=2).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(N_RINGS - 1), np.arange(N_AROUND), indexing="ij")
    a, b = i * N_AROUND + j, i * N_AROUND + (j + 1) % N_AROUND
    sides = np.concatenate([np.stack([a, b, b + N_AROUND], axis=2), np.stack([a, b + N_AROUND, a + N_AROUND], axis=2)])
    bottom, top = len(rings), len(rings) + 1
    rim, next_rim = np.arange(N_AROUND), (np.arange(N_AROUND) + 1) % N_AROUND
    last = (N_RINGS - 1) * N_AROUND
    caps = [np.stack([next_rim, rim, np.full(N_AROUND, bottom)], axis=1)]
    caps.append(np.stack([rim + last, next_rim + last, np.full(N_AROUND, top)], axis=1))
    faces = np.concatenate([sides.reshape(-1, 3), *caps]).astype(np.int32)
    return np.concatenate([rings, [[0, 0, 0], [0, HEIGHT, 0]]]), faces
