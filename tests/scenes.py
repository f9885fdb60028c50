"""A scene with a bit of everything, for the tests of scene formats."""

from __future__ import annotations

import io

import numpy as np
from PIL import Image as Pillow

from gvpipe.asset.attribute import Attribute
from gvpipe.asset.field import Field
from gvpipe.asset.material import Image, Material, Texture
from gvpipe.asset.metadata import Metadata
from gvpipe.asset.part import Part
from gvpipe.model.sequence import MeshSequence

FACES = np.array([[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4], [6, 7, 8]], np.int32)  # two quads, and a triangle of its own
POLYGONS = np.array([4, 4, 3], np.int32)
N_FRAMES = 6


def scene() -> MeshSequence:
    """Two meshes, the first of two materials: 9 vertices, 5 triangles, 6 frames at 24 from 0.5 s."""
    rest = np.array(
        [[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0], [1, 1, 0], [2, 1, 0], [5, 0, 0], [6, 0, 0], [5, 1, 0]], np.float32
    )
    positions = np.repeat(rest[None], N_FRAMES, axis=0)
    positions[:, :6, 2] = np.sin(np.arange(N_FRAMES))[:, None] * rest[:6, 0]  # the second mesh stands still
    positions[2] = positions[1]  # a frame that repeats the one before
    rng = np.random.default_rng(5)
    uv = rng.random((8, 2)).astype(np.float32)
    attributes = {
        "uv": Attribute(uv, "corner", "uv", np.array([0, 1, 2, 0, 2, 3, 4, 5, 6, 4, 6, 7, 0, 1, 3], np.int32)),
        "uv1": Attribute(rng.random((9, 2)), "vertex", "uv"),
        "normal": Attribute(np.tile(np.array([[0, 0, 1]], np.float32), (9, 1)), "vertex", "normal"),
        "color": Attribute(rng.random((9, 4)).astype(np.float32), "vertex", "color"),
        "weight": Attribute(rng.random((9, 1)), "vertex", "scalar"),
        "group": Attribute(np.array([[3], [3], [1], [1], [2]], np.int32), "triangle", "label"),
    }
    fields = {
        "stress": Field(rng.random((N_FRAMES, 9)), kind="scalar"),
        "velocity": Field(rng.random((N_FRAMES, 9, 3)), kind="vector"),
    }
    texture = Texture(0, "uv1", wrap=("clamp", "repeat"), offset=(0.25, 0.5), rotation=0.5, tiling=(2.0, 3.0))
    materials = (
        Material("wood", (0.5, 0.25, 0.125, 1.0), metallic=0.25, roughness=0.75),
        Material(
            "1 cloth", (1.0, 0.5, 1.0, 1.0), texture, 0.0, 0.5, alpha_mode="mask", alpha_cutoff=0.25, emissive=(0.0, 0.5, 0.0)
        ),
    )
    parts = (
        Part("sheet", (0, 6), (0, 2), 0, "world/2 left"),
        Part("sheet", (0, 6), (2, 4), 1, "world/2 left"),
        Part("piece", (6, 9), (4, 5), 1, "world"),
    )
    return MeshSequence(
        positions,
        FACES,
        24,
        attributes,
        "scene",
        fields=fields,
        parts=parts,
        polygons=POLYGONS,
        materials=materials,
        images=(Image("check.png", "image/png", picture()),),
        metadata=Metadata("z", 0.01, 0.5, "scene"),
    )


def picture() -> bytes:
    """A PNG of 4 x 4 pixels."""
    stream = io.BytesIO()
    Pillow.fromarray(np.arange(64, dtype=np.uint8).reshape(4, 4, 4)).save(stream, "PNG")
    return stream.getvalue()


def assert_same(read: MeshSequence, given: MeshSequence) -> None:
    """Positions, triangles, polygons, parts, attributes and seams are the same; fields where ``read`` has any."""
    assert read.fps == given.fps
    assert np.array_equal(read.read(0, len(read)), given.read(0, len(given)))
    assert np.array_equal(read.faces, given.faces)
    assert read.polygons is not None
    assert given.polygons is not None
    assert np.array_equal(read.polygons, given.polygons)
    assert read.parts == given.parts
    assert set(read.attributes) == set(given.attributes)
    for name, attribute in given.attributes.items():
        found = read.attributes[name]
        assert (found.domain, found.kind) == (attribute.domain, attribute.kind), name
        assert np.allclose(np.asarray(found), np.asarray(attribute), rtol=0, atol=1e-6), name
    assert set(read.fields) == set(given.fields)
    for name, field in given.fields.items():
        assert (read.fields[name].kind, read.fields[name].domain) == (field.kind, field.domain)
        assert np.array_equal(read.fields[name][1:4], field[1:4])
    assert read.metadata.start_time == given.metadata.start_time
