"""Adaptive positions and orders: every awkward mesh comes back, repetition costs next to nothing, and no bytes do harm."""

from __future__ import annotations

import time
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sequences import grid

from gvpipe.connectivity import welded_mesh
from gvpipe.connectivity.adaptive_mesh import decode_adaptive_mesh, encode_adaptive_mesh
from gvpipe.connectivity.adaptive_order import decode_adaptive_order
from gvpipe.connectivity.candidate_order import decode_candidate_order, encode_candidate_order
from gvpipe.connectivity.welded_mesh import ADAPTIVE_MESH, FITTED_MESH, decode_points, encode_points
from gvpipe.foundation.errors import CorruptFile

FLAT = np.array([[0, 1, 2], [0, 0, 1], [1, 1, 1], [0, 1, 2]])  # doubled and collapsed triangles


def sheets(count: int, side: int = 7) -> tuple[np.ndarray, np.ndarray]:
    """So many bent sheets beside each other, alike."""
    places, faces = grid(side)
    places = np.rint(100 * np.column_stack([places[:, :2], np.sin(3 * places[:, 0]) + 1])).astype(np.int64)
    places -= places.min(axis=0)
    return (
        np.concatenate([places + np.array([200 * k, 0, 0]) for k in range(count)]),
        np.concatenate([faces.astype(np.int64) + k * len(places) for k in range(count)]),
    )


@pytest.mark.parametrize(
    "mesh", [sheets(1), sheets(9), (np.arange(12).reshape(4, 3), FLAT), (np.ones((3, 3), np.int64), FLAT[:0])]
)
@pytest.mark.parametrize("is_fitted", [False, True])
def test_meshes_come_back(mesh: tuple[np.ndarray, np.ndarray], is_fitted: bool) -> None:
    points, faces = mesh
    stream, permutation, own = encode_adaptive_mesh(points, faces, is_fitted)
    decoded, triangles = decode_adaptive_mesh(stream, is_fitted=is_fitted)
    assert np.array_equal(decoded, points[permutation])
    assert np.array_equal(triangles, own)
    assert sorted(map(sorted, permutation[triangles].tolist())) == sorted(map(sorted, faces.tolist()))


def test_what_recurs_costs_next_to_nothing() -> None:
    one, nine = (len(encode_adaptive_mesh(*sheets(count))[0]) for count in (1, 9))
    assert nine < 4 * one
    (points, faces), draw = sheets(9), np.random.default_rng(1)
    shuffled = np.concatenate([49 * k + draw.permutation(49) if not k else 49 * k + np.arange(49) for k in range(9)])
    assert len(encode_candidate_order(np.arange(len(points)), np.arange(len(points)), faces)) < 60
    stream = encode_candidate_order(shuffled, np.arange(len(points)), faces)
    assert np.array_equal(decode_candidate_order(stream, np.arange(len(points)), faces), shuffled)


@pytest.mark.parametrize("reorder", [False, True])
def test_welded_meshes_choose_what_is_smaller(reorder: bool) -> None:
    points, faces = sheets(9)
    vertices = np.arange(len(points))
    coded, mesh = encode_points(points, faces, vertices, reorder)
    plain, _ = encode_points(points, faces, vertices, reorder, adaptive=False)
    assert coded.is_adaptive and len(coded.mesh) + len(coded.order) < len(plain.mesh) + len(plain.order)
    decoded = decode_points(coded.mesh, coded.order)
    assert np.array_equal(decoded.lattice, mesh.lattice)
    assert np.array_equal(decoded.faces, mesh.faces)
    assert np.array_equal(decoded.lattice[decoded.point], points[coded.permutation])
    with pytest.raises(CorruptFile, match="flags 8 are unknown"):
        decode_points(b"\x08" + coded.mesh[1:], coded.order)
    with pytest.raises(CorruptFile, match="flags 5 are unknown"):
        decode_points(b"\x05" + coded.mesh[1:], coded.order)


def test_a_forecast_is_taken_where_it_is_worth_its_time(monkeypatch: pytest.MonkeyPatch) -> None:
    points, faces = sheets(4, 12)
    sizes = [len(encode_adaptive_mesh(points, faces, is_fitted)[0]) for is_fitted in (False, True)]
    assert 0.9 * sizes[0] < sizes[1] < sizes[0]  # less than a tenth
    for few, flag in ((1000, FITTED_MESH), (0, ADAPTIVE_MESH)):
        monkeypatch.setattr(welded_mesh, "FEW_FITTED", few)
        assert encode_points(points, faces, np.arange(len(points)), reorder=True)[0].mesh[0] == flag


@pytest.mark.parametrize("is_fitted", [False, True])
def test_prefixes_and_longer_streams_are_refused(is_fitted: bool) -> None:
    points, faces = sheets(2, 5)
    stream = encode_adaptive_mesh(points, faces, is_fitted)[0]
    order = encode_candidate_order(np.random.default_rng(0).permutation(50), np.arange(50), faces)
    for wrong in [*(stream[:end] for end in range(len(stream))), stream + b"\0"]:
        with pytest.raises(CorruptFile):
            decode_adaptive_mesh(wrong, is_fitted=is_fitted)
    for wrong in (order[:1], order[:-2], order + b"\0"):
        with pytest.raises(CorruptFile):
            decode_candidate_order(wrong, np.arange(50), faces)


def test_orders_by_adaptive_ranks_are_still_read() -> None:
    """As encoders wrote them before there were candidates."""
    from gvpipe.connectivity.order_kernels import N_CONTEXTS, N_GROUPS, code_visits
    from gvpipe.connectivity.vertex_order import REACH, neighbour_lists
    from gvpipe.entropy.decision_kernels import finish, start_encoder
    from gvpipe.entropy.number_kernels import new_number_mixing

    faces, points = sheets(2, 5)[1], np.arange(50)
    visits, state, data = np.random.default_rng(0).permutation(50), start_encoder(), np.zeros(864, np.uint8)
    lists = neighbour_lists(np.c_[points, np.zeros((50, 2), np.int64)], faces)
    code_visits(lists, points, REACH, new_number_mixing(N_CONTEXTS, N_GROUPS), state, data, False, visits)
    order = data[: finish(state, data)].tobytes()
    assert np.array_equal(decode_adaptive_order(order, points, faces), visits)
    for wrong in (order[:-2], order + b"\0"):
        with pytest.raises(CorruptFile):
            decode_adaptive_order(wrong, points, faces)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(0, 3))
def test_any_order_comes_back(seed: int, kind: int) -> None:
    """Soups, seams, doubled and collapsed triangles, loose vertices; in order, shuffled, or row by row."""
    draw = np.random.default_rng(seed)
    n = int(draw.integers(1, 90))
    faces = draw.integers(0, n, (int(draw.integers(0, 150)), 3))
    points = draw.integers(0, max(n // 3, 1), n) if kind == 3 else np.arange(n)
    visits = np.argsort(draw.integers(0, 1 + n // 4, n), kind="stable") if kind == 2 else draw.permutation(n)
    visits = np.arange(n) if kind == 0 else visits
    order = encode_candidate_order(visits, points, faces)
    assert np.array_equal(decode_candidate_order(order, points, faces), visits)
    changed = bytearray(order)
    changed[1 + seed % (len(order) - 1)] ^= 1 + seed % 255
    with suppress(CorruptFile):
        assert sorted(decode_candidate_order(bytes(changed), points, faces)) == list(range(n))


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 400), st.integers(1, 255))
def test_no_byte_does_harm(place: int, change: int) -> None:
    points, faces = sheets(2, 5)
    stream = bytearray(encode_adaptive_mesh(points, faces)[0])
    stream[place % len(stream)] ^= change
    try:
        decoded, triangles = decode_adaptive_mesh(bytes(stream))
    except CorruptFile:
        return
    assert decoded.min() >= 0
    assert not len(triangles) or triangles.max() < len(decoded)


def test_hubs_take_no_longer_than_other_vertices() -> None:
    """Three vertices that are neighbours of all others: their lists are not searched for each vertex."""
    n = 12_000
    rim = np.arange(n - 4)
    hubs = np.concatenate([np.stack([rim, rim + 1, np.full_like(rim, n - 3 + k)], axis=1) for k in range(3)])
    strip = np.concatenate([np.stack([rim, rim + 1, rim + 2 + k], axis=1) for k in range(3)])
    seconds = []
    for faces in (strip, hubs, strip, hubs):
        started = time.process_time()
        encode_candidate_order(np.arange(n), np.arange(n), np.minimum(faces, n - 1))
        seconds.append(time.process_time() - started)
    assert min(seconds[1::2]) < 4 * min(seconds[::2]), seconds
