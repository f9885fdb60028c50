"""A flag on a pole: two parts, quads, a texture, seams, hard edges, and the cloth's strain as a field. The clip loops.

It shows all that an asset may have beside moving positions, in a small file.
"""

from __future__ import annotations

import io

import numpy as np
import numpy.typing as npt
from PIL import Image as Pillow

import gvpipe

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

FPS = 24.0
N_FRAMES = 48
N_ACROSS, N_DOWN = 30, 20  # quads of the cloth
WIDTH, HEIGHT = 1.5, 1.0  # m
RADIUS, LENGTH, N_SIDES = 0.03, 2.2, 12  # of the pole, m
WAVES = ((0.09, 4.0, 1), (0.025, 9.0, 2), (0.008, 15.0, 3))  # amplitude m, wave number 1/m, turns per loop
GRID = 2.0**-13  # m; rounded vertices compress
TEXELS = 64  # side of the texture


def make_flag() -> gvpipe.MeshSequence:
    """Return the flag: 48 frames of two parts."""
    cloth, cloth_quads, cloth_uv = make_cloth()
    pole, pole_polygons, pole_uv, pole_normals = make_pole()
    n_cloth = cloth.shape[1]
    polygons = [*cloth_quads, *([corner + n_cloth for corner in polygon] for polygon in pole_polygons)]
    fan = cut_polygons([len(polygon) for polygon in polygons])  # (T, 3) corners of polygons
    faces = np.concatenate([np.array(polygon) for polygon in polygons])[fan].astype(np.int32)
    n_flag = 2 * len(cloth_quads)  # triangles
    uv = np.concatenate([cloth_uv[np.array(cloth_quads)].reshape(-1, 2), pole_uv])[fan.reshape(-1)]
    normals = np.concatenate([smooth_normals(cloth[0], faces[:n_flag])[np.array(cloth_quads)].reshape(-1, 3), pole_normals])
    still = np.broadcast_to(pole, (N_FRAMES, *pole.shape))
    return gvpipe.MeshSequence(
        (np.round(np.concatenate([cloth, still], axis=1) / GRID) * GRID + 0.0).astype(np.float32),
        faces,
        FPS,
        {"uv": share(uv, faces, "uv"), "normal": share(normals[fan.reshape(-1)], faces, "normal")},
        name="flag",
        fields={"strain": gvpipe.Field(np.pad(strain(cloth), ((0, 0), (0, len(pole)))), unit="%")},
        parts=(
            gvpipe.Part("flag", (0, n_cloth), (0, n_flag), 0),
            gvpipe.Part("pole", (n_cloth, n_cloth + len(pole)), (n_flag, len(faces)), 1),
        ),
        polygons=np.array([len(polygon) for polygon in polygons]),
        materials=(
            gvpipe.Material("cloth", base_color_texture=gvpipe.Texture(0), double_sided=True),
            gvpipe.Material("steel", (0.55, 0.57, 0.6, 1.0), metallic=1.0, roughness=0.4),
        ),
        images=(gvpipe.Image("flag.png", "image/png", paint()),),
        metadata=gvpipe.Metadata("y", 1.0, source="gvpipe samples/flag.py"),
    )


def make_cloth() -> tuple[Floats, list[list[int]], Floats]:
    """Return vertices (F, V, 3), quads, and uv (V, 2) of a sheet that waves, held along x = 0."""
    down, across = np.divmod(np.arange((N_DOWN + 1) * (N_ACROSS + 1)), N_ACROSS + 1)
    x, y = WIDTH * across / N_ACROSS, HEIGHT * (1 - down / N_DOWN)
    time = np.arange(N_FRAMES)[:, None] / N_FRAMES
    swing = sum(amplitude * np.sin(number * x + 0.8 * y - 2 * np.pi * turns * time) for amplitude, number, turns in WAVES) * (
        1 - np.exp(-3 * x)
    )
    sag = 0.06 * x**2 * (1 + 0.2 * np.sin(2 * np.pi * time))
    vertices = np.stack([RADIUS + x - 0.25 * swing**2, LENGTH - HEIGHT - 0.05 + y - sag, swing], axis=2)
    first = np.flatnonzero((across < N_ACROSS) & (down < N_DOWN))
    quads = np.stack([first, first + N_ACROSS + 1, first + N_ACROSS + 2, first + 1], axis=1)
    return vertices, quads.tolist(), np.stack([across / N_ACROSS, 1 - down / N_DOWN], axis=1)


def make_pole() -> tuple[Floats, list[list[int]], Floats, Floats]:
    """Return vertices (V, 3), polygons, and uv (C, 2) and normals (C, 3) of the polygons' corners, of a closed cylinder."""
    angle = 2 * np.pi * np.arange(N_SIDES) / N_SIDES
    ring = np.stack([RADIUS * np.cos(angle), 0 * angle, RADIUS * np.sin(angle)], axis=1)
    vertices = np.concatenate([ring, ring + np.array([0, LENGTH, 0])])
    polygons, uv, normals = [], [], []
    for side in range(N_SIDES):
        after = (side + 1) % N_SIDES
        polygons.append([side, side + N_SIDES, after + N_SIDES, after])
        left, right = side / N_SIDES, (side + 1) / N_SIDES  # the seam: 1 at the end, 0 at the start
        uv += [[left, 0], [left, 1], [right, 1], [right, 0]]
        normals += [ring[side] / RADIUS, ring[side] / RADIUS, ring[after] / RADIUS, ring[after] / RADIUS]
    around = list(range(N_SIDES))
    for cap, up in ((around, -1.0), ([corner + N_SIDES for corner in around[::-1]], 1.0)):
        polygons.append(cap)
        uv += (0.5 + vertices[cap][:, [0, 2]] / RADIUS / 2).tolist()
        normals += [np.array([0, up, 0])] * N_SIDES
    return vertices, polygons, np.array(uv), np.array(normals)


def cut_polygons(counts: list[int]) -> Ints:
    """Return the fans of polygons with so many corners each: (T, 3) corners, counted over all polygons."""
    starts = np.cumsum(counts) - counts
    fans = [[start, start + k, start + k + 1] for start, count in zip(starts, counts, strict=True) for k in range(1, count - 1)]
    return np.array(fans)


def share(rows: Floats, faces: npt.NDArray[np.int32], kind: str) -> gvpipe.Attribute:
    """Return the attribute of corners in which equal rows at one vertex are one value."""
    keys = np.concatenate([faces.reshape(-1, 1), np.round(rows, 6)], axis=1)
    first, index = np.unique(keys, axis=0, return_index=True, return_inverse=True)[1:]
    return gvpipe.Attribute(rows[first], "corner", kind, index.reshape(-1).astype(np.int32))


def smooth_normals(vertices: Floats, faces: npt.NDArray[np.int32]) -> Floats:
    """Return unit normals (V, 3), weighted by area."""
    a, b, c = vertices[faces[:, 0]], vertices[faces[:, 1]], vertices[faces[:, 2]]
    normals = np.zeros_like(vertices)
    for corner in range(3):
        np.add.at(normals, faces[:, corner], np.cross(b - a, c - a))
    return np.asarray(normals / np.linalg.norm(normals, axis=1, keepdims=True))


def strain(cloth: Floats) -> npt.NDArray[np.float32]:
    """Return how much longer the threads along x are than in the sheet at rest, percent (F, V)."""
    grid = cloth.reshape(len(cloth), N_DOWN + 1, N_ACROSS + 1, 3)
    threads = 100 * (np.linalg.norm(np.diff(grid, axis=2), axis=3) / (WIDTH / N_ACROSS) - 1)
    mean = (np.pad(threads, ((0, 0), (0, 0), (1, 0)), "edge") + np.pad(threads, ((0, 0), (0, 0), (0, 1)), "edge")) / 2
    return np.asarray(mean.reshape(len(cloth), -1), np.float32)


def paint() -> bytes:
    """Return a picture of stripes and a disc, as PNG."""
    y, x = np.mgrid[:TEXELS, :TEXELS]
    pixels = np.where((y // 8 % 2 == 0)[..., None], [200, 40, 40], [245, 240, 225])
    pixels[(x - TEXELS / 3) ** 2 + (y - TEXELS / 2) ** 2 < (TEXELS / 5) ** 2] = [30, 60, 140]
    file = io.BytesIO()
    Pillow.fromarray(pixels.astype(np.uint8)).save(file, "PNG", optimize=True)
    return file.getvalue()
