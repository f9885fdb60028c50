"""The hierarchy of a mesh: each vertex comes after its causal neighbours."""

from __future__ import annotations

import hashlib

import numpy as np
import pytest
from sequences import random_mesh

from gvpipe.benchmark.torus import make_torus
from gvpipe.foundation.arrays import Array
from gvpipe.mesh.decimation import FAR
from gvpipe.mesh.hierarchy import build_hierarchy

WHEELS = [  # vertices of the rim; digests of a wheel, and of one with doubled, turned and wrong triangles
    (20, "a6c30d668d2fea98", "f9c07a22d92c802e"),
    (63, "5b6655e56777d366", "70426152e01465eb"),
    (64, "a760e52e4cd04f72", "7534a4eb14b01f70"),
    (65, "3649b93f2727f752", "5c331c075df2d0b4"),
    (130, "c841e86139be44c4", "acf40b772d7fefe7"),
    (257, "cc94a85a42d0eefb", "194b9989f44070e7"),
    (700, "91cbe19bc368a455", "efb2c4bc52976594"),
]
TORI = [(3_000, "0ab1b554f572cacf"), (70_000, "da2389f0f93a16f8")]  # of about so many vertices


@pytest.mark.parametrize("seed", range(25))
def test_hierarchy_orders_every_vertex_after_what_predicts_it(seed: int) -> None:
    faces, _ = random_mesh(seed)
    n_vertices = 60
    hierarchy = build_hierarchy(faces, n_vertices)
    assert np.array_equal(np.sort(hierarchy.order), np.arange(n_vertices))
    rank = np.argsort(hierarchy.order)
    owner = np.repeat(np.arange(n_vertices), np.diff(hierarchy.starts))
    assert (rank[hierarchy.neighbours] < owner).all()
    assert hierarchy.blocks[0] == 0 and hierarchy.blocks[-1] == n_vertices and (np.diff(hierarchy.blocks) > 0).all()


@pytest.mark.parametrize(("n_rim", "plain", "messy"), WHEELS)
def test_hierarchies_of_wheels_never_change(n_rim: int, plain: str, messy: str) -> None:
    """Files were written with these: hubs of all sizes, and places that are not manifold."""
    rim, after, n = np.arange(n_rim), np.roll(np.arange(n_rim), -1), n_rim + 2
    one, two = np.full(n_rim, n_rim), np.full(n_rim, n_rim + 1)
    wheel = _shuffled(np.concatenate([np.stack([rim, after, one], axis=1), np.stack([after, rim, two], axis=1)]), n)
    assert _digest(wheel, n) == plain
    assert _digest(np.concatenate([wheel, wheel[::5], wheel[::7, ::-1], (wheel[::3] + 1) % n]), n) == messy


@pytest.mark.parametrize(("size", "expected"), TORI)
def test_hierarchies_of_tori_never_change(size: int, expected: str) -> None:
    """Of small ones, and of those whose memory is asked for ahead."""
    torus = make_torus(size, 1)
    assert (torus.n_vertices > FAR) == (size > FAR)
    assert _digest(_shuffled(torus.faces, torus.n_vertices), torus.n_vertices) == expected


def _shuffled(faces: Array, n_vertices: int) -> Array:
    """Vertices and triangles in another order, without draws of luck."""
    order = np.arange(n_vertices) * 7919 % n_vertices
    return order[faces][np.arange(len(faces)) * 104_729 % len(faces)]


def _digest(faces: Array, n_vertices: int) -> str:
    found = build_hierarchy(faces.astype(np.int32), n_vertices)
    return hashlib.sha256(b"".join(np.ascontiguousarray(array).tobytes() for array in found)).hexdigest()[:16]
