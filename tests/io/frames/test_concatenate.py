"""The meshes of one file as one mesh: ranges shift, and attributes that only some have are filled."""

from __future__ import annotations

import numpy as np

from gvpipe.asset.attribute import Attribute
from gvpipe.asset.part import Part
from gvpipe.io.frames.concatenate import concatenate
from gvpipe.io.mesh import Mesh

FACES = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
POINTS = np.arange(12.0).reshape(4, 3)


def test_two_meshes() -> None:
    seam = Attribute(np.eye(5, 2, dtype=np.float32), "corner", "uv", np.array([0, 1, 2, 3, 4, 1], np.int32))
    first = Mesh(POINTS, FACES, {"uv": seam}, ("a",), np.array([4], np.int32), (Part("a", (0, 4), (0, 2), 1),))
    colors = np.full((4, 3), 7, np.uint8)
    second = Mesh(POINTS + 1, FACES, {"uv": np.ones((4, 2), np.float32), "color": colors}, ("a",))
    joined = concatenate([first, second])
    assert joined.faces.tolist() == [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]] and joined.notes == ("a",)
    assert joined.polygons is not None and joined.polygons.tolist() == [4, 3, 3]
    assert joined.parts == (Part("a", (0, 4), (0, 2), 1), Part("", (4, 8), (2, 4)))
    uv, color = joined.attributes["uv"], joined.attributes["color"]
    assert uv.domain == "corner" and np.asarray(uv)[:6].tolist() == np.asarray(seam).tolist()
    assert np.asarray(uv)[6:].tolist() == [[1, 1]] * 6
    assert uv.indices[[1, 5]].tolist() == [1, 1] and uv.indices[0] != uv.indices[3]
    assert color.domain == "vertex" and color.tolist() == [[255] * 3] * 4 + [[7] * 3] * 4


def test_colours_of_two_types_become_floats() -> None:
    bytes_ = Mesh(POINTS, FACES, {"color": np.full((4, 4), 51, np.uint8)})
    floats = Mesh(POINTS, FACES, {"color": np.full((4, 3), 0.5, np.float32)})
    color = concatenate([bytes_, floats]).attributes["color"]
    np.testing.assert_allclose(np.asarray(color)[[0, 4]], [[0.2] * 4, [0.5, 0.5, 0.5, 1]], rtol=1e-6)


def test_one_mesh_stays_itself() -> None:
    mesh = Mesh(POINTS, FACES)
    assert concatenate([mesh]) is mesh
