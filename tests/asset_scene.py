"""A small moving scene that has everything beside its positions."""

from __future__ import annotations

import io

import numpy as np
from PIL import Image as Pillow

from gvpipe.asset.attribute import Attribute
from gvpipe.asset.field import Field
from gvpipe.asset.material import Image, Material, Texture
from gvpipe.asset.metadata import Metadata
from gvpipe.asset.part import Part
from gvpipe.foundation.arrays import Array
from gvpipe.model.sequence import MeshSequence

N = 6  # quads along each side of each sheet
N_FRAMES = 10


def png(side: int = 32) -> bytes:
    """A picture of random pixels."""
    file = io.BytesIO()
    Pillow.fromarray(np.random.default_rng(2).integers(0, 255, (side, side, 3), np.uint8)).save(file, "PNG")
    return file.getvalue()


def scene(n_frames: int = N_FRAMES) -> MeshSequence:
    """Two sheets: one of quads, and one of which half the quads are cut; vertices are shuffled inside each part."""
    points, polygons = [], []
    rng = np.random.default_rng(5)
    side = N + 1
    for number in range(2):
        y, x = np.divmod(np.arange(side * side), side)
        first = np.flatnonzero((x < N) & (y < N))
        quads = np.stack([first, first + 1, first + side + 1, first + side], axis=1)
        order = rng.permutation(side * side)
        place = np.argsort(order)
        points.append(np.stack([x + 10 * number, y, 0 * x], axis=1)[order] / N)
        for quad in (place[quads] + number * side * side).tolist():
            is_cut = number == 1 and rng.random() < 0.5
            polygons += [quad[:3], [quad[0], *quad[2:]]] if is_cut else [quad]
    rest = np.concatenate(points)
    counts = np.array([len(polygon) for polygon in polygons])
    faces = np.array([[p[0], p[k], p[k + 1]] for p in polygons for k in range(1, len(p) - 1)], np.int32)
    n_first = 2 * N * N
    t = np.arange(n_frames)[:, None] / 5
    height = 0.3 * np.sin(3 * rest[:, 0] + t) * np.cos(2 * rest[:, 1] - t)
    positions = np.stack([rest[:, 0] + 0 * t, rest[:, 1] + 0.1 * height, height], axis=2).astype(np.float32)
    return MeshSequence(
        positions,
        faces,
        24.0,
        attributes=_attributes(rest, faces, rng),
        name="scene",
        fields={
            "stress": Field((100 * height + 50).astype(np.float32), unit="MPa"),
            "flow": np.gradient(positions, axis=0).astype(np.float32) if n_frames > 1 else np.zeros_like(positions),
            "state": (np.mean(height[:, faces], axis=2) > 0).astype(np.int16),
        },
        parts=(
            Part("left", (0, side * side), (0, n_first), 0),
            Part("right", (side * side, 2 * side * side), (n_first, len(faces)), 1, "left"),
        ),
        polygons=counts,
        materials=(Material("skin", base_color_texture=Texture(0)), Material("steel", (0.5, 0.5, 0.5, 1.0), metallic=1.0)),
        images=(Image("skin.png", "image/png", png()),),
        metadata=Metadata("y", 0.01, 0.5, "made here", {"author": "gvpipe"}),
    )


def _attributes(rest: Array, faces: Array, rng: np.random.Generator) -> dict[str, Attribute]:
    corners = faces.reshape(-1)
    centre = np.repeat(rest[faces].mean(axis=1), 3, axis=0)
    uv = np.where(centre[:, :1] > 0.5, rest[corners][:, :2] + 0.25, rest[corners][:, :2])  # a seam at x = 0.5
    keys, index = np.unique(np.concatenate([corners[:, None], uv], axis=1), axis=0, return_inverse=True)
    normal = np.stack([0.1 * rest[:, 0], 0.2 * rest[:, 1], np.ones(len(rest))], axis=1)
    return {
        "uv": Attribute(keys[:, 1:], "corner", "uv", index.reshape(-1).astype(np.int32)),
        "normal": Attribute(normal / np.linalg.norm(normal, axis=1, keepdims=True), "vertex", "normal"),
        "color": Attribute(rng.integers(0, 255, (len(rest), 4), np.uint8), "vertex", "color"),
        "mass": Attribute(rng.random(len(rest)), unit="kg"),
        "group": Attribute(rng.integers(-3, 3, len(faces)), "triangle"),
        "density": Attribute(np.array([1.5, 7.8]), "part", "scalar"),
    }
