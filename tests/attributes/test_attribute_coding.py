"""Attributes of every domain, kind and mesh come back exactly or within their bound, and no bytes do harm."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from attribute_meshes import each_surface, quilt, surfaces
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from sequences import grid
from shapes import ball

from gvpipe.attributes.attribute_coding import WELDED, decode_attribute, encode_attribute
from gvpipe.attributes.entry_layout import DOMAINS, count_values
from gvpipe.attributes.surface import Surface
from gvpipe.foundation.errors import CorruptFile, InputError

Values = NDArray[Any]


def directions(values: Values) -> Values:
    values = values[:, :3].astype(np.float64)
    length = np.linalg.norm(values, axis=1, keepdims=True)
    return np.asarray(values / np.where(length > 0, length, 1))


def angles(a: Values, b: Values) -> Values:
    """Degrees between rows."""
    chord = np.linalg.norm(directions(a) - directions(b), axis=1)
    return np.asarray(np.degrees(2 * np.arcsin(np.minimum(1, chord / 2))))


def round_trip(values: Values, surface: Surface, domain: str, kind: str, bound: float, indices: Values | None = None) -> bytes:
    """Encode and decode; check the bound; return the bytes."""
    data = encode_attribute(values, indices, surface, domain=domain, kind=kind, bound=bound)
    decoded, corners = decode_attribute(data, surface, "x", domain=domain)
    given = values if indices is None else values[indices]
    if domain == "corner":
        assert corners is not None
        decoded = decoded[corners]
    else:
        assert corners is None
    assert decoded.shape == given.shape
    if values.dtype.kind != "f" or bound == 0:
        assert decoded.dtype == values.dtype
        assert decoded.tobytes() == given.tobytes()
    elif kind in ("normal", "tangent"):
        assert angles(given, decoded).max(initial=0) <= bound
        assert np.array_equal(decoded[:, 3:], given[:, 3:])
    else:
        assert np.abs(given.astype(np.float64) - decoded).max(initial=0) <= bound
    return data


def some_values(n: int, seed: int = 0) -> list[tuple[str, Values, float]]:
    """Kind, values and bound of n values each."""
    random = np.random.default_rng(seed)
    normals = random.normal(size=(n, 3)).astype(np.float32)
    normals[n // 2 : n // 2 + 1] = 0
    axes = np.eye(3, dtype=np.float32)[random.integers(0, 3, n)] * random.choice([-1, 1], (n, 1)).astype(np.float32)
    tangents = np.c_[normals, random.choice([-1, 1], n)].astype(np.float32)
    special = np.array([0.0, -0.0, 1e-45, -1e-45, 3.4e38, -3.4e38, 1.0], np.float32)
    return [
        ("uv", random.random((n, 2)).astype(np.float32), 1 / 8192),
        ("uv", random.choice(special, (n, 2)), 0.0),
        ("normal", normals, 1.0),
        ("normal", axes, 5.0),
        ("normal", normals, 0.0),
        ("tangent", tangents, 2.0),
        ("tangent", normals, 1.0),
        ("color", random.integers(0, 256, (n, 4)).astype(np.uint8), 0.0),
        ("color", random.random((n, 3)).astype(np.float32), 0.01),
        ("scalar", (1e30 * random.normal(size=(n, 1))).astype(np.float32), 1e27),
        ("vector", random.normal(size=(n, 9)).astype(np.float32), 1e-9),
        ("vector", np.zeros((n, 0), np.float32), 0.1),
        ("label", random.choice([3, -7, 2**62, -(2**63)], (n, 1)), 0.0),
        ("label", random.permutation(n)[:, None].astype(np.uint64) << np.uint64(30), 0.0),
        ("label", random.integers(0, 3, (n, 2)).astype(np.int16), 0.0),
    ]


@each_surface
@pytest.mark.parametrize(
    "domain", [each if each == "corner" else pytest.param(each, marks=pytest.mark.slow) for each in DOMAINS]
)
def test_every_kind_comes_back(surface: Surface, domain: str) -> None:
    n = surface.faces.size if domain == "corner" else count_values(domain, surface)
    for kind, values, bound in some_values(n):
        indices = None if domain != "corner" else np.random.default_rng(1).permutation(n) // 4 * 2 % max(n, 1)
        round_trip(values, surface, domain, kind, bound, indices)


def test_an_attribute_that_follows_the_surface_takes_few_bits() -> None:
    points, faces = ball(40, 60)
    surface = Surface(faces, len(points), points)
    flat = points[:, :2] * np.float32(0.3)
    sheet = Surface(grid(40)[1], 1600, grid(40)[0].astype(np.float32))
    for positions in (sheet.positions, None):
        known = Surface(sheet.faces, 1600, positions)
        turned = grid(40)[0][:, :2] @ np.array([[0.6, 0.8], [-0.8, 0.6]])
        assert len(round_trip(turned.astype(np.float32), known, "vertex", "uv", 1e-4)) < 2.5 * 1600 / 8
    assert len(round_trip(points, surface, "vertex", "normal", 1.0)) < 2 * len(points) / 8
    assert len(round_trip(flat, surface, "vertex", "uv", 1e-3)) < 6 * len(points) / 8


def test_seams_and_equal_values_on_both_sides_are_cheap() -> None:
    """Where a mesh is split along seams, the second value at a position is that of the first."""
    surface, patch = quilt(30)
    assert surface.positions is not None
    random = np.random.default_rng(0)
    colours = random.integers(0, 256, (surface.n_vertices, 3)).astype(np.uint8)
    whole = len(round_trip(colours, surface, "vertex", "color", 0))
    pairs, split = np.unique(np.stack([surface.faces.ravel(), patch], axis=1), axis=0, return_inverse=True)
    apart = Surface(split.reshape(-1, 3).astype(np.int32), len(pairs), surface.positions[pairs[:, 0]])
    assert len(round_trip(colours[pairs[:, 0]], apart, "vertex", "color", 0)) < 1.02 * whole + 20


def test_labels_of_patches_cost_their_borders() -> None:
    surface, patch = quilt(30)
    labels = np.array([1 << 40, 7, -5, 100])[patch[::3]][:, None]
    assert len(round_trip(labels, surface, "triangle", "label", 0)) < len(labels) / 8


def test_the_decoder_needs_no_positions_that_the_encoder_had_none_of() -> None:
    surface = Surface(grid(5)[1], 25)
    values = np.random.default_rng(0).random((25, 2)).astype(np.float32)
    data = encode_attribute(values, None, surface, domain="vertex", kind="uv", bound=0.01)
    decoded, _ = decode_attribute(data, surface, "x", domain="vertex")
    assert np.abs(decoded - values).max() <= 0.01


@pytest.mark.parametrize(
    ("values", "kind", "message"),
    [
        (np.zeros((24, 2), np.float32), "uv", "25 are needed"),
        (np.zeros(25, np.float32), "uv", "table"),
        (np.zeros((25, 65), np.float32), "uv", "64 columns"),
        (np.full((25, 2), np.nan), "uv", "value 0 is"),
        (np.zeros((25, 1), np.float32), "label", "integers"),
        (np.full((25, 1), 2**63, np.uint64), "label", "at most"),
        (np.zeros((25, 2), np.float32), "texture", "kinds are"),
        (np.zeros((25, 2), np.complex64), "uv", "table"),
    ],
)
def test_bad_input_is_one_clear_error(values: Values, kind: str, message: str) -> None:
    surface = Surface(grid(5)[1], 25)
    with pytest.raises(InputError, match=message):
        encode_attribute(values, None, surface, domain="vertex", kind=kind)
    with pytest.raises(InputError, match="there are 3 values"):
        encode_attribute(np.zeros((3, 2), np.float32), np.full(25, 3), surface, domain="vertex", kind="uv")


def test_truncated_attributes_are_corrupt() -> None:
    """Missing words of a stream may go unnoticed, as decoders read zeros behind the end; most do not."""
    surface, patch = quilt(6)
    for kind, values, bound in some_values(4):
        data = encode_attribute(values, patch, surface, domain="corner", kind=kind, bound=bound)
        n_refused = 0
        for end in range(len(data)):
            try:
                decode_attribute(data[:end], surface, "x", domain="corner")
            except CorruptFile:
                n_refused += 1
        assert n_refused >= len(data) - 4
        with pytest.raises(CorruptFile):
            decode_attribute(data + b"\0", surface, "x", domain="corner")


@pytest.mark.slow
@settings(max_examples=150, deadline=None)
@given(st.data())
def test_damaged_attributes_are_corrupt_or_values(data: st.DataObject) -> None:
    surface = surfaces()["patched"]
    kind, values, bound = data.draw(st.sampled_from(some_values(surface.n_vertices)))
    damaged = bytearray(encode_attribute(values, None, surface, domain="vertex", kind=kind, bound=bound))
    for _ in range(data.draw(st.integers(1, 3))):
        damaged[data.draw(st.integers(0, min(len(damaged), 60) - 1))] = data.draw(st.integers(0, 255))
    try:
        decoded, _ = decode_attribute(bytes(damaged), surface, "x", domain="vertex")
    except CorruptFile:
        return
    assert len(decoded) == surface.n_vertices
    assert decoded.dtype.kind != "f" or not np.isnan(decoded).any() or kind in ("uv", "normal", "vector", "tangent")


def test_welded_vertices_need_their_corners() -> None:
    """Bytes of a mesh with seams do not decode on one without."""
    surface, patch = quilt(6)
    assert surface.positions is not None
    pairs, split = np.unique(np.stack([surface.faces.ravel(), patch], axis=1), axis=0, return_inverse=True)
    apart = Surface(split.reshape(-1, 3).astype(np.int32), len(pairs), surface.positions[pairs[:, 0]])
    colours = np.random.default_rng(0).integers(0, 256, (surface.n_vertices, 3)).astype(np.uint8)[pairs[:, 0]]
    data = round_trip(colours, apart, "vertex", "color", 0)
    assert data[0] == WELDED
    with pytest.raises(CorruptFile, match="cannot be"):
        decode_attribute(data, surface, "x", domain="vertex")
