"""Values that follow from positions cost next to nothing, and keep their bound."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from waves import EXACT, MESH, SHEET, SHEET_FACES, encode

from gvpipe.fields import derived, head
from gvpipe.fields.encoder import encode_field
from gvpipe.fields.mesh import FieldMesh
from gvpipe.fields.reader import FieldReader
from gvpipe.fields.values import FieldBound
from gvpipe.foundation.arrays import Array, Float32
from gvpipe.foundation.errors import CorruptFile, InputError

F = 24


def positions(noise: float = 0.0) -> Float32:
    """A sheet that swings, ``(F, V, 3)``."""
    t = np.arange(F)[:, None]
    rng = np.random.default_rng(2)
    swing = np.stack(
        [0.2 * np.sin(t / 3 + SHEET[:, 1]), 0.1 * np.cos(t / 5 + SHEET[:, 0]), np.sin(t / 4 - SHEET[:, 0])], axis=2
    )
    points = np.pad(SHEET, ((0, 0), (0, 3 - SHEET.shape[1]))) + swing + rng.normal(0, 1e-9, (F, len(SHEET), 3))
    return np.asarray(points + noise * rng.normal(size=points.shape), np.float32)


def reader_of(points: Array) -> Callable[[int, int], Array]:
    return lambda start, stop: points[start:stop]


def fields() -> dict[str, Float32]:
    points = positions().astype(np.float64)
    moved = points - points[3]  # a reference other than frame 0
    change = points[np.minimum(np.arange(F) + 1, F - 1)] - points[np.maximum(np.arange(F) - 1, 0)]
    return {
        "displacement": np.asarray(moved / 30, np.float32),
        "elevation": np.asarray(5 - moved[:, :, 2:] / 10, np.float32),
        "velocity": np.asarray(change * 12, np.float32),
        "both": np.asarray(change[:, :, :2] * 12 + moved[:, :, 1:], np.float32),
        "magnitude": np.asarray(np.linalg.norm(points - points[0], axis=2, keepdims=True), np.float32),
    }


@pytest.mark.parametrize("name", list(fields()))
@pytest.mark.parametrize("frames", [500, 7])
def test_what_follows_costs_little(name: str, frames: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(head, "FRAMES", frames)
    monkeypatch.setattr(derived, "CHUNK", 5 * len(SHEET))
    values = fields()[name]
    bound = FieldBound(1e-3 * float(np.ptp(values)))
    points = reader_of(positions())
    section = encode_field(reader_of(values), F, MESH, bound, positions=points)
    assert len(section) < 0.75 * len(encode(values, bound))
    reader = FieldReader(section, F, MESH, "field", points)
    assert np.abs(reader.read(0, F).astype(np.float64) - values).max() <= bound.largest
    assert np.array_equal(reader.read(5, 6), reader.read(0, F)[5:6])
    with pytest.raises(InputError, match="give its reader the positions"):
        FieldReader(section, F, MESH, "field").read(0, F)


def test_positions_with_errors_and_held_frames() -> None:
    values = np.repeat(fields()["displacement"][::2], 2, axis=0)
    bound = FieldBound(5e-3 * float(np.ptp(values)))
    points = reader_of(positions(noise=0.002))
    section = encode_field(reader_of(values), F, MESH, bound, positions=points, modes=("derived",))
    back = FieldReader(section, F, MESH, "field", points).read(0, F)
    assert np.abs(back.astype(np.float64) - values).max() <= bound.largest
    assert np.array_equal(back[::2], back[1::2])


def test_triangles_follow_their_corners() -> None:
    mesh = FieldMesh(SHEET_FACES, len(SHEET), "triangle")
    points = positions()
    values = np.asarray((points - points[0])[:, SHEET_FACES].mean(axis=2) * 0.4, np.float32)
    bound = FieldBound(1e-3 * float(np.ptp(values)))
    section = encode_field(reader_of(values), F, mesh, bound, positions=reader_of(points))
    assert len(section) < 0.5 * len(encode(values, bound, mesh))
    back = FieldReader(section, F, mesh, "field", reader_of(points)).read(0, F)
    assert np.abs(back.astype(np.float64) - values).max() <= bound.largest


def test_what_does_not_follow_is_coded_as_ever() -> None:
    values = np.random.default_rng(0).normal(size=(F, len(SHEET), 1)).astype(np.float32)
    for bound in (FieldBound(0.05), EXACT):
        section = encode_field(reader_of(values), F, MESH, bound, positions=reader_of(positions()))
        assert section == encode(values, bound)


def test_positions_of_another_mesh_are_refused() -> None:
    values = fields()["displacement"]
    with pytest.raises(InputError, match=r"\(24, 81, 3\) is needed|have shape"):
        encode_field(reader_of(values), F, MESH, FieldBound(0.1), positions=reader_of(positions()[:, 1:]))


def test_damaged_derivations() -> None:
    values = fields()["displacement"]
    points = reader_of(positions())
    section = bytearray(encode_field(reader_of(values), F, MESH, FieldBound(0.001), positions=points))
    for at in range(len(section)):
        damaged = section.copy()
        damaged[at] ^= 255
        try:
            back = FieldReader(bytes(damaged), F, MESH, "field", points).read(0, F)
        except CorruptFile:
            continue
        assert back.shape == values.shape
