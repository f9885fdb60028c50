"""Normals that are turned with the surface: exact for rigid motion, the first frame's as they were."""

from __future__ import annotations

import numpy as np
import pytest
from scenes import FACES, scene
from scipy.spatial.transform import Rotation

from gvpipe.asset.attribute import Attribute
from gvpipe.io.normals.turned import TurnedNormals


@pytest.mark.parametrize("domain", ["vertex", "corner"])
def test_rigid_motion_turns_them_alike(domain: str) -> None:
    positions = scene().read(1, 2)[0] + np.array([0, 0.3, 0], np.float32)
    rng = np.random.default_rng(1)
    normals = rng.normal(size=(len(positions) if domain == "vertex" else FACES.size, 3))
    normals = (normals / np.linalg.norm(normals, axis=1, keepdims=True)).astype(np.float32)
    turned = TurnedNormals(Attribute(normals, domain, "normal"), positions, FACES)
    first = turned.of(positions)
    rotation = Rotation.from_rotvec([0.3, -1.2, 2.0])
    found = turned.of((rotation.apply(positions) + np.array([5, 0, 0])).astype(np.float32))
    assert np.allclose(found, rotation.apply(first), atol=1e-5)
    rows = first if turned.indices is None else first[turned.indices]
    assert np.array_equal(rows, normals)


def test_stretching_keeps_them_perpendicular() -> None:
    positions = np.array([[0, 0, 0], [1, 0, 1], [0, 1, 0]], np.float32)  # the plane z = x
    normal = np.array([[-1, 0, 1]], np.float32) / np.sqrt(2)
    turned = TurnedNormals(Attribute(np.repeat(normal, 3, 0), "vertex", "normal"), positions, np.array([[0, 1, 2]], np.int32))
    found = turned.of(positions * np.array([2, 1, 1], np.float32))
    assert np.allclose(found, np.array([-1, 0, 2]) / np.sqrt(5), atol=1e-6)


def test_triangles_that_collapse_keep_the_first_frame() -> None:
    positions = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    normals = np.tile(np.array([[0, 0, 1]], np.float32), (3, 1))
    turned = TurnedNormals(Attribute(normals, "vertex", "normal"), positions, np.array([[0, 1, 2]], np.int32))
    assert np.array_equal(turned.of(np.zeros((3, 3), np.float32)), normals)
