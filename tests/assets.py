"""A small asset with something of everything, and what tests compare of two assets."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
from PIL import Image as Pillow

from gvpipe.asset.attribute import Attribute
from gvpipe.asset.field import Field
from gvpipe.asset.material import Image, Material, Texture
from gvpipe.asset.metadata import Metadata
from gvpipe.asset.part import Part
from gvpipe.model.sequence import MeshSequence

POINTS = np.array([[x, y, 0.25 * x * y] for y in range(3) for x in range(3)], np.float32)
QUADS = [[0, 1, 4, 3], [1, 2, 5, 4], [3, 4, 7, 6]]
LAST = [[4, 5, 8], [4, 8, 7]]


def picture(color: tuple[int, int, int] = (10, 200, 30), form: str = "PNG") -> bytes:
    """The bytes of a picture of 4 x 4 pixels."""
    file = io.BytesIO()
    Pillow.new("RGB", (4, 4), color).save(file, form)
    return file.getvalue()


def faces_of(polygons: list[list[int]]) -> Any:
    """The fans of polygons, ``(T, 3) int32``."""
    return np.array([[one[0], one[i], one[i + 1]] for one in polygons for i in range(1, len(one) - 1)], np.int32)


def asset(n_frames: int = 3, **changes: Any) -> MeshSequence:
    """A sheet of three quads and two triangles in two parts, with a seam, two materials, two images and two fields."""
    time = np.arange(n_frames, dtype=np.float32)
    positions = POINTS + time[:, None, None] * np.array([0, 0, 0.125], np.float32) * POINTS[:, :1]
    faces = faces_of(QUADS + LAST)
    table = np.concatenate([POINTS[:, :2] / 2, [[0.75, 0.125]]]).astype(np.float32)
    corners = faces.reshape(-1).copy()
    corners[-6:][corners[-6:] == 4] = 9  # the second part's corners at vertex 4 show a value of their own
    rng = np.random.default_rng(5)
    given: dict[str, Any] = {
        "attributes": {
            "uv": Attribute(table, "corner", "uv", corners),
            "color": rng.integers(0, 256, (9, 4), np.uint8),
            "weight": Attribute(rng.random((9, 1), np.float32), unit="kg"),
            "id": np.arange(8, dtype=np.int32)[:, None],
        },
        "fields": {
            "stress": Field(rng.random((n_frames, 9), np.float32), unit="MPa", range=(0.0, 1.0)),
            "flow": Field(rng.random((n_frames, 8, 3), np.float32), "triangle"),
        },
        "parts": (Part("cloth", (0, 8), (0, 6), 0), Part("patch", (4, 9), (6, 8), 1, "group")),
        "polygons": np.array([4, 4, 4, 3, 3], np.int32),
        "materials": (
            Material("red cloth", (0.5, 0.25, 0.125, 1.0), Texture(0), 0.25, 0.5, emissive=(0.0, 0.5, 0.0)),
            Material("glass", (1.0, 1.0, 1.0, 0.5), normal_texture=Texture(1, wrap=("clamp", "clamp")), alpha_mode="blend"),
        ),
        "images": (Image("cloth", "image/png", picture()), Image("bumps", "image/jpeg", picture((1, 2, 3), "JPEG"))),
        "metadata": Metadata("y", 0.01, 2.5, "a test", {"who": "nobody"}),
    }
    return MeshSequence(positions, faces, 24, **{**given, **changes})


def assert_same_static(read: MeshSequence, given: MeshSequence) -> None:
    """Parts, polygons, materials and images are equal."""
    assert (read.parts, read.materials, read.images) == (given.parts, given.materials, given.images)
    assert np.array_equal(read.faces, given.faces)
    if given.polygons is None:
        assert read.polygons is None
    else:
        assert read.polygons is not None and read.polygons.tolist() == given.polygons.tolist()


def assert_same_attribute(read: Attribute, given: Attribute, faces: Any) -> None:
    """Rows are equal, bit for bit, and the same corners of each vertex share a value."""
    assert (read.domain, read.kind, read.unit, read.dtype) == (given.domain, given.kind, given.unit, given.dtype)
    assert np.asarray(read).tobytes() == np.asarray(given).tobytes()
    if given.domain == "corner" and given.indices is not None and read.indices is not None:
        by_given = {*zip(faces.reshape(-1), given.indices, strict=True)}
        by_read = {*zip(faces.reshape(-1), read.indices, strict=True)}
        both = {*zip(faces.reshape(-1), read.indices, given.indices, strict=True)}
        assert len(both) == len(by_given) == len(by_read)
