"""Triangles that a codec shuffled and turned get back their parts and polygons."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from sequences import grid

from gvpipe.attributes.triangle_order import decode_arrangement, encode_arrangement
from gvpipe.foundation.errors import CorruptFile, InputError

Ints = NDArray[Any]
Polygons = list[list[int]]


def fans(polygons: Polygons) -> Ints:
    rows = [(p[0], p[i], p[i + 1]) for p in polygons for i in range(1, len(p) - 1)]
    return np.array(rows, np.int32).reshape(-1, 3)


def sizes(polygons: Polygons) -> Ints:
    return np.array([len(p) for p in polygons], np.int64)


def shuffled(faces: Ints, seed: int = 0) -> Ints:
    """Triangles in another order, each turned anyhow."""
    random = np.random.default_rng(seed)
    faces = faces[random.permutation(len(faces))]
    turned = (random.integers(0, 3, (len(faces), 1)) + np.arange(3)) % 3
    return np.take_along_axis(faces, turned, axis=1)


def quads(n: int) -> Polygons:
    corner = np.arange(n * n).reshape(n, n)[:-1, :-1].ravel().tolist()
    return [[a, a + 1, a + n + 1, a + n] for a in corner]


def round_trip(
    polygons: Polygons, part_of: Ints, n_parts: int, with_polygons: bool = True, vertex_starts: Ints | None = None
) -> bytes:
    """Encode shuffled triangles, decode them, and compare parts, polygons and sources; return the bytes."""
    source, counts = fans(polygons), sizes(polygons)
    parts, decoded = np.repeat(part_of, counts - 2), shuffled(source)
    given_counts = counts if with_polygons else None
    data, arrangement, sources = encode_arrangement(
        decoded, source, polygons=given_counts, parts=parts, n_parts=n_parts, vertex_starts=vertex_starts
    )
    again = decode_arrangement(data, decoded, n_parts, vertex_starts)
    for name in ("faces", "part_starts", "polygons", "decoded", "first_corners"):
        assert np.array_equal(getattr(again, name), getattr(arrangement, name)), name
    assert np.array_equal(source.ravel()[sources.corners], again.faces.ravel())
    assert np.array_equal(sources.corners // 3, np.repeat(sources.triangles, 3))
    assert np.array_equal(np.sort(sources.corners), np.arange(source.size))
    own_parts = np.searchsorted(again.part_starts[1:], np.arange(len(source)), side="right")
    assert np.array_equal(own_parts, parts[sources.triangles])
    if with_polygons:
        assert again.polygons is not None
        first = np.cumsum(again.polygons - 2) - (again.polygons - 2)
        found = []
        for start, n in zip(first.tolist(), again.polygons.tolist(), strict=True):
            fan = again.faces[start : start + n - 2].tolist()
            assert fan == fans([[fan[0][0], *(row[1] for row in fan), fan[-1][2]]]).tolist()
            found.append((int(own_parts[start]), [fan[0][0], *(row[1] for row in fan), fan[-1][2]]))
        assert sorted(found) == sorted((int(part), list(p)) for part, p in zip(part_of, polygons, strict=True))
    return data


def of_one_part(polygons: Polygons) -> Ints:
    return np.zeros(len(polygons), np.int64)


def test_nothing_to_say_takes_no_byte() -> None:
    triangles = grid(9)[1].tolist()
    assert round_trip(triangles, of_one_part(triangles), 1, with_polygons=False) == b""
    assert round_trip([], np.zeros(0, np.int64), 3) != b""
    assert round_trip([], np.zeros(0, np.int64), 1, with_polygons=False) == b""
    apart = [[v + 81 * part for v in t] for part in range(7) for t in triangles]
    part_of = np.repeat(np.arange(7), len(triangles))
    assert round_trip(apart, part_of, 7, with_polygons=False, vertex_starts=81 * np.arange(8)) == b""


def test_a_grid_of_quads_takes_under_a_bit_a_quad() -> None:
    polygons = quads(40)
    assert len(round_trip(polygons, of_one_part(polygons), 1)) < len(polygons) / 8
    random = np.random.default_rng(1)
    turned = [np.roll(p, random.integers(4)).tolist() for p in polygons]
    assert len(round_trip(turned, of_one_part(turned), 1)) < 2.6 * len(turned) / 8


def test_parts_that_share_vertices_cost_their_borders() -> None:
    polygons = quads(30)
    polygons.sort(key=lambda p: p[0] % 30 > 12)
    part_of = np.array([int(p[0] % 30 > 12) for p in polygons])
    assert len(round_trip(polygons, part_of, 2, with_polygons=False)) < 150


def test_ten_thousand_parts() -> None:
    polygons = [[4 * i, 4 * i + 1, 4 * i + 2, 4 * i + 3] for i in range(10_000)]
    starts = 4 * np.arange(10_001)
    data = round_trip(polygons, np.arange(10_000), 10_000, vertex_starts=starts)
    assert len(data) < 4000
    shared = quads(101)
    round_trip(shared, np.arange(10_000), 10_000)


def test_large_polygons_and_mixtures() -> None:
    circle = list(range(3000))
    assert len(round_trip([circle], of_one_part([circle]), 1)) < 80
    random = np.random.default_rng(2)
    mixed: Polygons = []
    for p in quads(20):
        mixed += [p] if random.random() < 0.7 else [p[:3], [p[0], p[2], p[3]]]
    round_trip(mixed, of_one_part(mixed), 1)


@settings(max_examples=80, deadline=None)
@given(st.integers(0, 2**31), st.integers(0, 30), st.integers(1, 5), st.booleans())
def test_any_polygons_over_few_vertices_come_back(seed: int, n: int, n_parts: int, with_polygons: bool) -> None:
    """Repeated vertices, equal polygons, edges of many triangles."""
    random = np.random.default_rng(seed)
    polygons = [random.integers(0, 7, int(random.integers(3, 13))).tolist() for _ in range(n)]
    round_trip(polygons, np.sort(random.integers(0, n_parts, n)), n_parts, with_polygons)


def test_what_is_no_fan_or_no_part_is_refused() -> None:
    source = fans(quads(3))
    with pytest.raises(InputError, match="not those of the source"):
        encode_arrangement(source[:, ::-1].copy(), source)
    with pytest.raises(InputError, match="must be the same"):
        encode_arrangement(source[1:], source)
    with pytest.raises(InputError, match="not its fan"):
        encode_arrangement(source, source, polygons=np.array([3, 4, 4, 4, 3]))
    with pytest.raises(InputError, match="three corners"):
        encode_arrangement(source, source, polygons=np.array([4, 4]))
    with pytest.raises(InputError, match="not of one part"):
        encode_arrangement(source, source, polygons=np.full(4, 4), parts=np.repeat([0, 1], [3, 5]), n_parts=2)
    with pytest.raises(InputError, match="ascend"):
        encode_arrangement(source, source, parts=np.repeat([1, 0], 4), n_parts=2)


def test_truncated_and_foreign_bytes_are_corrupt() -> None:
    polygons = quads(8)
    source = fans(polygons)
    decoded = shuffled(source)
    parts = np.repeat(np.arange(7), 14)
    data, _, _ = encode_arrangement(decoded, source, polygons=sizes(polygons), parts=parts, n_parts=7)
    for end in range(1, len(data)):
        with pytest.raises(CorruptFile):
            decode_arrangement(data[:end], decoded, 7)
    for other in (data + b"\0", b"\0", b"\4"):
        with pytest.raises(CorruptFile):
            decode_arrangement(other, decoded, 7)
    with pytest.raises(CorruptFile, match="no part"):
        decode_arrangement(b"", decoded, 1, np.array([0, 5]))


@settings(max_examples=80, deadline=None)
@given(st.data())
def test_damaged_arrangements_are_corrupt_or_arrange_all_triangles(data: st.DataObject) -> None:
    random = np.random.default_rng(5)
    polygons = [random.integers(0, 9, int(random.integers(3, 13))).tolist() for _ in range(20)]
    source = fans(polygons)
    decoded, parts = shuffled(source), np.repeat(np.arange(4), [5] * 4).repeat(sizes(polygons) - 2)
    coded, _, _ = encode_arrangement(decoded, source, polygons=sizes(polygons), parts=parts, n_parts=4)
    damaged = bytearray(coded)
    for _ in range(data.draw(st.integers(1, 3))):
        damaged[data.draw(st.integers(0, len(damaged) - 1))] = data.draw(st.integers(0, 255))
    try:
        found = decode_arrangement(bytes(damaged), decoded, 4)
    except CorruptFile:
        return
    assert np.array_equal(np.sort(found.decoded), np.arange(len(decoded)))
    if found.polygons is not None:
        assert int((found.polygons - 2).sum()) == len(decoded)
