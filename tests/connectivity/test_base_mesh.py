"""Mesh streams: every awkward mesh comes back exactly, and no bytes do harm."""

from __future__ import annotations

from typing import NoReturn

import DracoPy
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gvpipe.connectivity import base_mesh
from gvpipe.connectivity.base_mesh import decode_base, encode_base
from gvpipe.foundation.arrays import Array, Int32
from gvpipe.foundation.errors import CorruptFile, InputError

TETRAHEDRON = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)]


def random_points(n_vertices: int, top: int = 4095, seed: int = 0) -> Int32:
    return np.random.default_rng(seed).integers(0, top + 1, (n_vertices, 3)).astype(np.int32)


def grid(n: int) -> tuple[Int32, Int32]:
    i = np.arange((n - 1) * n).reshape(n - 1, n)[:, :-1].ravel()
    faces = np.concatenate([np.c_[i, i + 1, i + n], np.c_[i + 1, i + n + 1, i + n]])
    x, y = np.divmod(np.arange(n * n), n)
    return np.c_[40 * x, 40 * y, (x * y) % 7].astype(np.int32), faces.astype(np.int32)


def shuffled(mesh: tuple[Int32, Int32], seed: int = 1) -> tuple[Int32, Int32]:
    points, faces = mesh
    order = np.random.default_rng(seed).permutation(len(points))
    return points[order], np.argsort(order)[faces].astype(np.int32)


def soup(n: int) -> tuple[Int32, Array]:
    random = np.random.default_rng(3)
    corners = np.concatenate([random.permutation(60)[:3] for _ in range(n)])
    return random_points(60)[corners], np.arange(3 * n).reshape(-1, 3)


def faces_of(*rows: tuple[int, int, int]) -> Int32:
    return np.array(rows, np.int32).reshape(-1, 3)


GRID_POINTS, GRID_FACES = grid(9)
MESHES: dict[str, tuple[Array, Array]] = {
    "tetrahedron": (random_points(4), faces_of(*TETRAHEDRON)),
    "single triangle": (random_points(3), faces_of((0, 1, 2))),
    "two components": (random_points(8), np.r_[faces_of(*TETRAHEDRON), faces_of(*TETRAHEDRON) + 4]),
    "many components": (
        random_points(4 * 200),
        (faces_of(*TETRAHEDRON) + 4 * np.arange(200)[:, None, None]).reshape(-1, 3),
    ),
    "open grid": grid(9),
    "shuffled grid": shuffled(grid(40)),
    "non-manifold edge": (random_points(5), faces_of((0, 1, 2), (1, 0, 3), (0, 1, 4))),
    "bow-tie vertex": (random_points(5), faces_of((0, 1, 2), (0, 3, 4))),
    "coinciding pair": (np.r_[random_points(3), random_points(3)], faces_of((0, 1, 2), (3, 5, 4))),
    "coinciding pair, same winding": (np.r_[random_points(3), random_points(3)], faces_of((0, 1, 2), (3, 4, 5))),
    "double-sided sheet": (np.r_[GRID_POINTS, GRID_POINTS], np.r_[GRID_FACES, GRID_FACES[:, ::-1] + 81]),
    "one point": (np.full((81, 3), 7), GRID_FACES),
    "coarse lattice": (GRID_POINTS // 100, GRID_FACES),
    "flat": (GRID_POINTS * [1, 1, 0], GRID_FACES),
    "triangle soup": soup(100),
    "unreferenced at the start": (random_points(7), faces_of(*TETRAHEDRON) + 3),
    "unreferenced at the end": (random_points(7), faces_of(*TETRAHEDRON)),
    "unreferenced between": (random_points(7), faces_of(*TETRAHEDRON) * 2),
    "unreferenced coinciding": (np.tile(random_points(4), (2, 1)), faces_of(*TETRAHEDRON) + 4),
    "duplicated faces": (GRID_POINTS, np.r_[GRID_FACES, GRID_FACES[:40], GRID_FACES[:3, [1, 2, 0]]]),
    "opposite duplicates": (GRID_POINTS, np.r_[GRID_FACES, GRID_FACES[:, ::-1]]),
    "degenerate faces": (GRID_POINTS, np.r_[GRID_FACES, faces_of((0, 0, 1), (3, 2, 3), (5, 5, 5), (8, 4, 4))]),
    "only degenerate faces": (random_points(3), faces_of((0, 0, 1), (2, 2, 2))),
    "random faces": (random_points(30), np.random.default_rng(5).integers(0, 30, (300, 3))),
    "random faces, few points": (random_points(30, top=1), np.random.default_rng(6).integers(0, 30, (300, 3))),
    "no faces": (random_points(6), faces_of()),
    "nothing": (random_points(0), faces_of()),
    "one vertex": (random_points(1), faces_of()),
    "large coordinates": (random_points(81, top=2**31 - 1), GRID_FACES),
    "20 bits": (random_points(81, top=2**20), GRID_FACES),
}
each_mesh = pytest.mark.parametrize(("points", "faces"), MESHES.values(), ids=MESHES.keys())


def sorted_faces(faces: Array) -> list[list[int]]:
    """Rows in one order, each rotated to its smallest rotation: equal if and only if set, count and winding are."""
    rotations = [faces.tolist(), faces[:, [1, 2, 0]].tolist(), faces[:, [2, 0, 1]].tolist()]
    return sorted(min(rows) for rows in zip(*rotations, strict=True))


def check_round_trip(points: Array, faces: Array) -> None:
    mesh, permutation, own = encode_base(points, faces)
    decoded = decode_base(mesh)
    assert decoded.points.dtype == decoded.faces.dtype == np.int32
    assert np.array_equal(decoded.points, own.points) and np.array_equal(decoded.faces, own.faces)
    assert sorted(permutation) == list(range(len(points)))
    assert np.array_equal(decoded.points, points[permutation])
    assert sorted_faces(permutation[decoded.faces]) == sorted_faces(faces)


@each_mesh
def test_round_trip(points: Array, faces: Array) -> None:
    check_round_trip(points, faces)


@each_mesh
def test_deterministic(points: Array, faces: Array) -> None:
    assert encode_base(points, faces)[0] == encode_base(points, faces)[0]


@given(st.integers(1, 12), st.integers(0, 30), st.integers(0, 5), st.integers(0, 2**32 - 1))
@settings(max_examples=300, deadline=None)
def test_round_trip_of_random_meshes(n_vertices: int, n_faces: int, top: int, seed: int) -> None:
    random = np.random.default_rng(seed)
    check_round_trip(random.integers(0, top + 1, (n_vertices, 3)), random.integers(0, n_vertices, (n_faces, 3)))


def fail(*_args: object, **_kwargs: object) -> NoReturn:
    raise DracoPy.EncodingFailedException("no")


@each_mesh
def test_round_trip_without_draco(points: Array, faces: Array, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(DracoPy, "encode", fail)
    check_round_trip(points, faces)


def test_draco_result_that_differs_is_not_trusted(monkeypatch: pytest.MonkeyPatch) -> None:
    honest = DracoPy.encode
    monkeypatch.setattr(DracoPy, "encode", lambda points, faces, **options: honest(points, faces[:, ::-1], **options))
    check_round_trip(*grid(9))
    monkeypatch.setattr(DracoPy, "encode", lambda points, faces, **options: honest(points + 1, faces, **options))
    check_round_trip(*grid(9))


@pytest.mark.parametrize("name", ["tetrahedron", "open grid", "triangle soup", "shuffled grid"])
def test_draco_carries_whole_ordinary_meshes(name: str) -> None:
    points, faces = MESHES[name]
    _, n_loose_points, n_loose_faces, _ = base_mesh.HEADER.unpack_from(encode_base(points, faces)[0])
    assert (n_loose_points, n_loose_faces) == (0, 0)


@pytest.mark.parametrize(
    ("points", "faces"),
    [
        (random_points(4) - 5000, faces_of(*TETRAHEDRON)),
        (random_points(4), faces_of((0, 1, 4))),
        (random_points(4), faces_of((0, 1, -1))),
        (np.zeros((4, 2)), faces_of()),
        (random_points(4), np.zeros((1, 4), int)),
    ],
)
def test_encode_refuses(points: Array, faces: Array) -> None:
    with pytest.raises(InputError, match=r"lattice coordinates|faces index|three columns"):
        encode_base(points, faces)


@pytest.mark.parametrize(
    "name", ["tetrahedron", "open grid", "triangle soup", "unreferenced between", "duplicated faces", "one vertex"]
)
def test_every_truncated_prefix_is_refused(name: str) -> None:
    points, faces = MESHES[name]
    mesh = encode_base(points, faces)[0]
    for n_bytes in range(len(mesh)):
        with pytest.raises(CorruptFile, match="corrupt|truncated"):
            decode_base(mesh[:n_bytes])
    with pytest.raises(CorruptFile, match="corrupt"):
        decode_base(mesh + b"\0")


def decode_or_refuse(mesh: bytes) -> None:
    """Anything is right for changed bytes (the container's checksums tell), but a valid mesh or a CorruptFile."""
    try:
        decoded = decode_base(mesh)
        points, faces = decoded.points, decoded.faces
    except CorruptFile:
        return
    assert points.shape[1:] == faces.shape[1:] == (3,)
    assert points.size == 0 or points.min() >= 0
    assert faces.size == 0 or (faces.min() >= 0 and faces.max() < len(points))


@pytest.mark.parametrize("name", ["tetrahedron", "open grid", "triangle soup", "duplicated faces", "unreferenced between"])
def test_changed_bytes_do_no_harm(name: str) -> None:
    points, faces = MESHES[name]
    mesh = encode_base(points, faces)[0]
    random = np.random.default_rng(0)
    for _ in range(400):
        data = bytearray(mesh)
        for at in random.integers(0, len(data), random.integers(1, 4)):
            data[at] = random.integers(256)
        decode_or_refuse(bytes(data))


@given(st.binary(max_size=200))
def test_garbage_does_no_harm(mesh: bytes) -> None:
    decode_or_refuse(mesh)
    decode_or_refuse(base_mesh.HEADER.pack(len(mesh) + 11, 0, 0, 0) + base_mesh.DRACO_PREFIX + mesh)


@pytest.mark.parametrize("counts", [(2**32 - 1, 0, 0, 0), (0, 2**32 - 1, 0, 8), (0, 0, 2**32 - 1, 0), (0, 0, 0, 2**32 - 1)])
def test_counts_are_refused_before_allocation(counts: tuple[int, int, int, int]) -> None:
    with pytest.raises(CorruptFile, match="corrupt|truncated"):
        decode_base(base_mesh.HEADER.pack(*counts) + bytes(8))


def test_draco_counts_are_refused_before_allocation() -> None:
    many = b"\xff\xff\xff\xff\x07"
    draco = base_mesh.DRACO_PREFIX + b"\0" + many + many + bytes(40)
    with pytest.raises(CorruptFile, match="vertices in Draco's stream; at most"):
        decode_base(base_mesh.HEADER.pack(len(draco), 0, 0, 0) + draco)


def test_many_triangles_in_few_bytes_are_allowed() -> None:
    """A regular mesh of two million triangles takes 1.7 kB."""
    header = base_mesh.DRACO_PREFIX + b"\0" + bytes.fromhex("c0843d80897a") + bytes(40)  # 1,000,000 and 2,000,000
    base_mesh.check_draco_header(header, 2_000_000)
    with pytest.raises(CorruptFile, match="2000000 faces in Draco's stream; at most 1999999"):
        base_mesh.check_draco_header(header, 1_999_999)
