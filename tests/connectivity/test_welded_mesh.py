"""Meshes of points with their seams: every awkward mesh comes back, and no bytes do harm."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from sequences import awkward, grid, patched, same_triangles

from gvpipe.connectivity.base_mesh import encode_base
from gvpipe.connectivity.edge_seam_kernels import CONTEXTS, visit_corners
from gvpipe.connectivity.seam_corners import are_first, find_seam_corners
from gvpipe.connectivity.seams import decode_seams, encode_seams
from gvpipe.connectivity.welded_mesh import WeldedMesh, decode_points, encode_points
from gvpipe.container.cursor import varint
from gvpipe.entropy.integers import encode_integers
from gvpipe.foundation.errors import CorruptFile
from gvpipe.mesh.lattice import Lattice
from gvpipe.model.sequence import MeshSequence
from gvpipe.trajectory.welding import find_points

Ints = NDArray[Any]
Mesh = tuple[Ints, Ints, Ints]  # positions of points (P, 3), triangles over vertices (T, 3), the point of each vertex (V,)

both_orders = pytest.mark.parametrize("reorder", [False, True])


def welded(sequence: MeshSequence) -> Mesh:
    """A sequence's mesh, as an encoder sees it."""
    points = find_points(sequence)
    first = sequence.read(0, 1)[0][np.unique(points, return_index=True)[1]]
    return Lattice.over(first, 12).quantise(first), sequence.faces, points


def copied(most: int, seed: int = 0) -> Mesh:
    """A sheet whose corners use any of up to so many copies of their point; some copies no corner uses."""
    draw = np.random.default_rng(seed)
    places, faces = grid(7)
    counts = draw.integers(1, most + 1, len(places))
    starts = np.cumsum(counts) - counts
    order = draw.permutation(counts.sum())  # vertices come in no order
    own = starts[faces] + draw.integers(0, counts[faces])
    return np.rint(1000 * places).astype(np.int32), order[own], np.repeat(np.arange(len(places)), counts)[np.argsort(order)]


MESHES: dict[str, Mesh] = {
    **{name: welded(sequence) for name, sequence in awkward().items()},
    "patched": welded(patched()),
    "two copies": copied(2),
    "many copies": copied(60),
    "points at one lattice position": (np.zeros((49, 3), np.int32), *copied(3, 1)[1:]),
    "one point of many triangles": (np.zeros((1, 3), np.int32), np.arange(30).reshape(-1, 3), np.zeros(30, np.int64)),
    "triangles alike over points": (
        np.eye(3, dtype=np.int32),
        np.array([[0, 1, 2], [3, 4, 5], [4, 2, 0], [5, 4, 0]]),
        np.array([0, 1, 2, 0, 1, 2]),
    ),
}
both_codings = pytest.mark.parametrize("adaptive", [False, True], ids=["plain", "adaptive"])
each_mesh = pytest.mark.parametrize("mesh", MESHES.values(), ids=MESHES.keys())


def check_mesh(decoded: WeldedMesh) -> None:
    """Whatever the bytes: numbers in range, triangles over vertices that are those over points, no point without a vertex."""
    n_vertices, n_points = len(decoded.point), len(decoded.lattice)
    assert decoded.faces.shape == decoded.point_faces.shape == (len(decoded.faces), 3)
    assert decoded.faces.min(initial=0) >= 0 and decoded.faces.max(initial=-1) < n_vertices
    assert np.array_equal(np.unique(decoded.point), np.arange(n_points))
    assert np.array_equal(decoded.point[decoded.faces], decoded.point_faces)
    assert (decoded.point_faces[:, :1] <= decoded.point_faces).all()
    assert np.array_equal(decoded.point[decoded.members], np.arange(n_points))
    assert len(decoded.graph.starts) == n_points + 1


def check_round_trip(mesh: Mesh, reorder: bool, adaptive: bool) -> None:
    lattice, faces, points = mesh
    coded = encode_points(lattice, faces, points, reorder, adaptive)[0]
    decoded = decode_points(coded.mesh, coded.order)
    check_mesh(decoded)
    source = coded.permutation  # the given vertex of each decoded one
    assert np.array_equal(np.sort(source), np.arange(len(points)))
    assert same_triangles(source[decoded.faces], faces)
    assert np.array_equal(decoded.lattice[decoded.point], lattice[points[source]])
    pairs = np.unique(np.c_[decoded.point, points[source]], axis=0)  # the same partition, with other numbers
    assert len(pairs) == len(lattice) == len(np.unique(pairs[:, 0])) == len(np.unique(pairs[:, 1]))
    if reorder:
        assert coded.order == b"" and (np.diff(decoded.point) >= 0).all()
    else:
        assert np.array_equal(source, np.arange(len(points)))


@each_mesh
@both_orders
@both_codings
def test_meshes_come_back(mesh: Mesh, reorder: bool, adaptive: bool) -> None:
    check_round_trip(mesh, reorder, adaptive)


@settings(max_examples=80, deadline=None)
@given(st.integers(1, 12), st.integers(0, 25), st.integers(0, 30), st.integers(0, 2**32 - 1), st.booleans(), st.booleans())
def test_any_triangles_come_back(n_points: int, others: int, n_faces: int, seed: int, reorder: bool, adaptive: bool) -> None:
    """Few points, so that triangles repeat, collapse and meet at every edge."""
    draw = np.random.default_rng(seed)
    points = draw.permutation(np.r_[np.arange(n_points), draw.integers(0, n_points, others)])
    faces = draw.integers(0, len(points), (n_faces, 3))
    check_round_trip((draw.integers(0, 3, (n_points, 3)).astype(np.int32), faces, points), reorder, adaptive)


def test_a_soup_costs_little_more_than_the_surface_that_it_draws() -> None:
    """Less than a bit a corner."""
    places, faces = grid(30)
    lattice = np.rint(4000 * places).astype(np.int32)
    whole = encode_points(lattice, faces, np.arange(len(places)), reorder=True)[0]
    soup = encode_points(lattice, np.arange(faces.size).reshape(-1, 3), faces.ravel(), reorder=True)[0]
    assert len(soup.mesh) < len(whole.mesh) + faces.size / 8


# hostile bytes


def decode_or_refuse(mesh: bytes, order: bytes) -> bool:
    """A mesh that makes sense, or one line of CorruptFile; whether it was refused."""
    try:
        decoded = decode_points(mesh, order)
    except CorruptFile as exc:
        assert "\n" not in str(exc)
        return True
    check_mesh(decoded)
    return False


HOSTILE = ["one triangle", "triangle soup", "non-manifold", "unreferenced vertices", "patched", "many copies", "no triangles"]


@pytest.mark.parametrize("name", HOSTILE)
@both_codings
def test_every_truncated_prefix_is_refused(name: str, adaptive: bool) -> None:
    coded = encode_points(*MESHES[name], reorder=False, adaptive=adaptive)[0]
    for cut in range(0, len(coded.mesh), 1 + len(coded.mesh) // 300):
        with pytest.raises(CorruptFile):
            decode_points(coded.mesh[:cut], b"")
    with pytest.raises(CorruptFile):
        decode_points(coded.mesh + b"\0", b"")
    for cut in range(1, len(coded.order), 1 + len(coded.order) // 60):
        decode_or_refuse(coded.mesh, coded.order[:cut])
    with pytest.raises(CorruptFile, match="order"):
        decode_points(coded.mesh, coded.order + b"\0")


@pytest.mark.parametrize("name", HOSTILE)
@both_codings
def test_changed_bytes_do_no_harm(name: str, adaptive: bool) -> None:
    coded = encode_points(*MESHES[name], reorder=False, adaptive=adaptive)[0]
    draw = np.random.default_rng(0)
    refused = 0
    for _ in range(200):
        for is_mesh in (True, False):
            data = bytearray(coded.mesh if is_mesh else coded.order)
            for at in draw.integers(0, len(data), draw.integers(1, 4)):
                data[at] = draw.integers(256)
            mesh, order = (bytes(data), coded.order) if is_mesh else (coded.mesh, bytes(data))
            refused += decode_or_refuse(mesh, order)
    assert refused > 50


@given(st.binary(max_size=120), st.binary(max_size=60), st.integers(0, 3))
def test_garbage_does_no_harm(data: bytes, order: bytes, flags: int) -> None:
    decode_or_refuse(data, order)
    base, head = encode_base(np.eye(3, dtype=np.int32), np.array([[0, 1, 2]]))[0], bytes([flags])
    decode_or_refuse(head + varint(len(base)) + base + data, order)
    counts = encode_integers(np.array([0, 2, 1]))
    decode_or_refuse(head + varint(len(base)) + base + varint(len(counts)) + counts + data, order)


@pytest.mark.parametrize("counts", [[-1, 1], [1 << 24, 1], [(1 << 23), (1 << 23)], [1 << 38, 1 << 38], [-(1 << 38), 0]])
def test_numbers_of_copies_out_of_range(counts: list[int]) -> None:
    with pytest.raises(CorruptFile, match="number of copies"):
        decode_seams(encode_integers(np.array(counts)), encode_integers(np.zeros(0, np.int64)), b"", np.zeros((0, 3), int), 2)


@pytest.mark.parametrize("rank", [-1, 3, 1 << 38])
def test_corners_of_copies_that_do_not_exist(rank: int) -> None:
    """Point 0 has three copies, and a corner's rank names one of those that it may use."""
    faces = np.tile([0, 1, 2], (2, 1))
    with pytest.raises(CorruptFile, match="a copy that does not exist"):
        decode_seams(encode_integers(np.array([2, 0, 0])), _ranks(faces, [rank]), b"", faces, 3)
    found, points = decode_seams(encode_integers(np.array([2, 0, 0])), _ranks(faces, [1]), b"", faces, 3)
    assert found.tolist() == [[0, 3, 4], [1, 3, 4]] and points.tolist() == [0, 0, 0, 1, 2]


def _ranks(faces: NDArray[np.int64], ranks: list[int]) -> bytes:
    """The ranks of corners that are not their point's first, in the contexts that a decoder will find."""
    seams = find_seam_corners(faces, np.array([3, 1, 1]))
    contexts = np.zeros(len(seams.corners), np.int64)
    visit_corners(seams, np.zeros(faces.size, np.int64), np.zeros_like(contexts), contexts, CONTEXTS)
    return encode_integers(np.array(ranks), contexts[~are_first(seams)])


def test_copies_are_numbered_by_first_use() -> None:
    """So that most differences are small; those that no corner uses come last."""
    faces = np.array([[3, 4, 5], [1, 4, 5], [3, 4, 5]])
    points = np.array([0, 0, 0, 0, 1, 2])
    coded = encode_seams(faces, points, points[faces], 3, reorder=True)
    assert coded.permutation.tolist() == [3, 1, 0, 2, 4, 5]
    found, _ = decode_seams(coded.counts, coded.corners, coded.order, points[faces], 3)
    assert found.tolist() == [[0, 4, 5], [1, 4, 5], [0, 4, 5]]


def test_soups_cost_hardly_more_than_their_points() -> None:
    """Each corner uses the next copy of its point: one number says so of all, as first corners have it too."""
    point_faces = np.array([(0, i, i + 1) for i in range(1, 400)])
    points = np.sort(point_faces.ravel())
    order = np.argsort(point_faces.ravel(), kind="stable")
    faces = np.argsort(order).reshape(-1, 3)
    coded = encode_seams(faces, points, point_faces, 401, reorder=True)
    assert len(coded.corners) < 30
    found, _ = decode_seams(coded.counts, coded.corners, coded.order, point_faces, 401)
    assert np.array_equal(found, faces)
