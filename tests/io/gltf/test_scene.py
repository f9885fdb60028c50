"""The order of a scene, its parts, its attributes, and what is left out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from gltf_files import CORNERS, TRIANGLE, File

import gvpipe
from gvpipe.foundation.errors import InputError


def test_nodes_become_parts_in_their_order(tmp_path: Path) -> None:
    file = File()
    file.add("materials", {"name": "red"})
    file.mesh(file.square(), name="m")
    shared = file.square()
    file.mesh({**shared, "material": 0}, {**shared, "indices": file.array(TRIANGLE)}, name="two")
    file.add("nodes", {"name": "car", "translation": [1, 2, 3], "children": [1, 3]})
    file.add("nodes", {"name": "wheel", "mesh": 0, "scale": [-1, 1, 1], "children": [2]})
    file.add("nodes", {"mesh": 0})
    file.add("nodes", {"mesh": 1, "matrix": np.diag([2, 2, 2, 1]).T.ravel().tolist()})
    read = gvpipe.read(file.write(tmp_path / "a.glb"))
    assert [(part.name, part.parent, part.material) for part in read.parts] == [
        ("wheel", "car", None), ("m", "wheel", None), ("two", "car", 0), ("two", "car", None)
    ]  # fmt: skip
    assert [part.vertices for part in read.parts] == [(0, 4), (4, 8), (8, 12), (8, 12)]
    assert [part.triangles for part in read.parts] == [(0, 2), (2, 4), (4, 6), (6, 7)]
    mirrored = CORNERS * [-1, 1, 1] + [1, 2, 3]
    np.testing.assert_allclose(read.read(0, 1)[0], np.concatenate([mirrored, mirrored, 2 * CORNERS + [1, 2, 3]]), atol=1e-6)
    assert read.faces[0].tolist() == [2, 1, 0] and read.faces[4].tolist() == [8, 9, 10]


def test_the_default_scene_is_read(tmp_path: Path) -> None:
    file = File()
    file.mesh(file.square())
    file.tree["nodes"] = [{"mesh": 0, "translation": [i, 0, 0]} for i in range(2)]
    file.tree |= {"scenes": [{"nodes": [0]}, {"nodes": [1]}], "scene": 1}
    assert gvpipe.read(file.write(tmp_path / "a.glb"))[0][0].tolist() == [1, 0, 0]


@pytest.mark.parametrize(("mode", "faces"), [(5, [[0, 1, 2], [1, 3, 2]]), (6, [[0, 1, 2], [0, 2, 3]]), (4, [[0, 1, 2]])])
def test_strips_and_fans_without_indices(tmp_path: Path, mode: int, faces: list[list[int]]) -> None:
    file = File()
    file.mesh({"attributes": {"POSITION": file.floats(CORNERS)}, "mode": mode}, {"attributes": {"POSITION": 0}, "mode": 1})
    file.add("nodes", {"mesh": 0})
    read = gvpipe.read(file.write(tmp_path / "a.glb"))
    assert read.faces.tolist() == faces
    assert read.not_carried == ("points and lines",)


def test_attributes_that_some_meshes_lack(tmp_path: Path) -> None:
    file = File()
    color = file.array(np.full((4, 3), 7, np.uint8), normalized=True)
    normal = file.floats([[1, 0, 0]] * 4)
    file.mesh(file.square(COLOR_0=color, NORMAL=normal, TEXCOORD_1=file.floats(CORNERS[:, :2]), _A=file.floats([1, 2, 3, 4])))
    file.mesh(file.square(COLOR_0=file.array(np.full((4, 4), 300, np.uint16), normalized=True)))
    file.tree |= {"nodes": [{"mesh": 0}, {"mesh": 1}], "scenes": [{"nodes": [0, 1]}]}
    attributes = gvpipe.read(file.write(tmp_path / "a.glb")).attributes
    colors = np.asarray(attributes["color"])
    np.testing.assert_allclose(colors[[0, 4]], [[7 / 255] * 3 + [1], [300 / 65535] * 4], rtol=1e-6)
    assert np.asarray(attributes["normal"])[[0, 4]].tolist() == [[1, 0, 0], [0, 0, 1]]  # its own, and the surface's
    assert attributes["uv1"][5].tolist() == [0, 0] and attributes["A"][:, 0].tolist() == [1, 2, 3, 4, 0, 0, 0, 0]


def test_normals_follow_their_node(tmp_path: Path) -> None:
    file = File()
    tilted = np.array([0.6, 0, 0.8])
    file.mesh(file.square(NORMAL=file.floats([tilted] * 4), TANGENT=file.floats([[0.8, 0, -0.6, 1]] * 4)))
    file.add("nodes", {"mesh": 0, "scale": [-1, 1, 2]})
    attributes = gvpipe.read(file.write(tmp_path / "a.glb")).attributes
    expected = tilted / [-1, 1, 2]
    np.testing.assert_allclose(attributes["normal"][0], expected / np.linalg.norm(expected), atol=1e-6)
    moved = np.array([-0.8, 0, -1.2])
    np.testing.assert_allclose(attributes["tangent"][0], [*(moved / np.linalg.norm(moved)), -1], atol=1e-6)


def test_deep_and_circular_trees(tmp_path: Path) -> None:
    file = File()
    file.mesh(file.square())
    n = 20_000
    file.tree["nodes"] = [{"children": [i + 1], "translation": [1, 0, 0]} for i in range(n)] + [{"mesh": 0}]
    assert gvpipe.read(file.write(tmp_path / "deep.glb"))[0][0].tolist() == [n, 0, 0]
    file.tree["nodes"] = [{"children": [1]}, {"children": [2]}, {"children": [1], "mesh": 0}]
    with pytest.raises(InputError, match="node 1 hangs on nodes 0 and 2"):
        gvpipe.read(file.write(tmp_path / "two.glb"))
    file.tree["nodes"] = [{"mesh": 0}, {"children": [2]}, {"children": [1]}]
    with pytest.raises(InputError, match="2 of its nodes are their own ancestors"):
        gvpipe.read(file.write(tmp_path / "circle.glb"))


@pytest.mark.parametrize("tree", [{}, {"nodes": [{}]}, {"nodes": [{"mesh": 0}], "meshes": [{"primitives": []}]}])
def test_nothing_to_read(tmp_path: Path, tree: dict[str, object]) -> None:
    file = File()
    file.tree |= tree
    with pytest.raises(InputError, match="no triangle mesh in its scene"):
        gvpipe.read(file.write(tmp_path / "a.glb"))
