"""Sequences whose texture moves: a waving sheet whose pictures say, by their colour, of which frame they are."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

import gvpipe
from gvpipe.foundation.arrays import UInt8

SIDE = 9  # vertices of the sheet
STEP = 20  # levels between the reds of two frames


def sheet(n_frames: int = 6, **changes: Any) -> gvpipe.MeshSequence:
    """A sheet with texture coordinates; its whole image shows."""
    x, y = np.meshgrid(np.linspace(0, 1, SIDE), np.linspace(0, 1, SIDE))
    waves = [0.05 * np.sin(4 * x + frame / 2) for frame in range(n_frames)]
    positions = np.stack([np.stack([x, y, z], axis=-1).reshape(-1, 3) for z in waves]).astype(np.float32)
    i = np.arange(SIDE * SIDE).reshape(SIDE, SIDE)
    a, b, c, d = (each.ravel() for each in (i[:-1, :-1], i[:-1, 1:], i[1:, 1:], i[1:, :-1]))
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    uv = np.stack([x, y], axis=-1).reshape(-1, 2).astype(np.float32)
    return gvpipe.MeshSequence(positions, faces, 24, {"uv": uv}, **changes)


def colour(frame: int) -> tuple[int, int, int]:
    """Of a frame's picture."""
    return (20 + STEP * frame % 230, 235 - STEP * frame % 230, 128)


def pictures(n_frames: int = 6, size: tuple[int, int] = (48, 32)) -> UInt8:
    """``(F, height, width, 3)``."""
    width, height = size
    return np.stack([np.full((height, width, 3), colour(frame), np.uint8) for frame in range(n_frames)])


def save(rows: UInt8, folder: Path, name: str = "p_%03d.png", start: int = 0) -> Path:
    """Write pictures into a folder, which is returned."""
    folder.mkdir(exist_ok=True)
    for number, pixels in enumerate(rows, start):
        Image.fromarray(pixels).save(folder / (name % number))
    return folder


def is_of(pixels: UInt8, frame: int) -> bool:
    """Whether a picture, or a part of it, has a frame's colour, but for what the codec loses."""
    return bool(np.abs(pixels.reshape(-1, 3).mean(axis=0) - colour(frame)).max() < STEP / 3)
