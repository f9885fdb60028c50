"""What repeats in a field is coded once, and comes back as it was: by polygon, by component, less an offset."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sequences import grid

import gvpipe
from gvpipe.asset_coding.directory import REDUCED, pack_directory, read_directory, unpack_directory
from gvpipe.asset_coding.reader import AssetReader
from gvpipe.asset_coding.reduction import Reduction
from gvpipe.coding.registry import open_reader
from gvpipe.container.json_object import pack_json, unpack_json
from gvpipe.foundation.errors import CorruptFile, InputError, SettingError
from gvpipe.io.frames.column_types import field_type

N, F = 9, 12
SIDE = np.arange(N * N).reshape(N, N)
QUADS = np.stack([SIDE[:-1, :-1], SIDE[1:, :-1], SIDE[1:, 1:], SIDE[:-1, 1:]], -1).reshape(-1, 4)
FACES = QUADS[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3).astype(np.int32)
POINTS = np.stack([SIDE // N, SIDE % N, np.zeros_like(SIDE)], -1).reshape(-1, 3).astype(np.float32)
TIME = np.arange(F)[:, None]


def quads(**fields: Any) -> gvpipe.MeshSequence:
    """A sheet of quads that waves."""
    positions = np.repeat(POINTS[None], F, 0)
    positions[:, :, 2] = np.sin(POINTS[:, 0] / 3 + TIME / 4)
    return gvpipe.MeshSequence(positions, FACES, 25, fields=fields, polygons=np.full(len(QUADS), 4), name="sheet")


def by_cell() -> np.ndarray:
    rng = np.random.default_rng(1)
    waves = np.sin(POINTS[QUADS].mean(axis=1)[:, 0] / 2 + TIME / 3)
    return np.asarray(waves + 0.05 * rng.normal(size=(F, len(QUADS))), np.float32)


def size_of(path: Path, name: str) -> int:
    return int(next(each["bytes"] for each in gvpipe.info(path).fields if each["name"] == name))


def largest_error(given: gvpipe.MeshSequence, found: gvpipe.MeshSequence, name: str) -> float:
    error = gvpipe.compare(given, found).fields[name]["max"]
    assert error is not None
    return error


def test_cells_have_one_value(tmp_path: Path) -> None:
    """Of a quad, both triangles have the same number, and a quad is coded once."""
    cells = by_cell()
    given = quads(cells=gvpipe.Field(np.repeat(cells, 2, axis=1), "triangle"))
    gvpipe.encode(given, tmp_path / "a.mp4", "pca", fields={"cells": 0.01})
    with gvpipe.open(tmp_path / "a.mp4") as video:
        found = video.fields["cells"]
        assert found.shape == (F, 2 * len(QUADS))
        assert found.is_by_polygon
        assert np.array_equal(found[:][:, ::2], found[:][:, 1::2])
        assert largest_error(given, video.sequence(), "cells") <= 0.01
        gvpipe.write(video.sequence(), tmp_path / "out.pvd")
    again = gvpipe.read(tmp_path / "out.pvd")
    assert again.polygons is not None
    assert np.array_equal(again.polygons, np.full(len(QUADS), 4))
    uneven = np.repeat(cells, 2, axis=1)
    uneven[F - 1, 7] += 0.5
    gvpipe.encode(quads(cells=gvpipe.Field(uneven, "triangle")), tmp_path / "b.mp4", "pca", fields={"cells": 0.01})
    assert size_of(tmp_path / "a.mp4", "cells") < 0.65 * size_of(tmp_path / "b.mp4", "cells")
    with gvpipe.open(tmp_path / "b.mp4") as video:
        assert not video.fields["cells"].is_by_polygon
        assert largest_error(quads(cells=gvpipe.Field(uneven, "triangle")), video.sequence(), "cells") <= 0.01


def test_velocity_of_cells_follows_from_positions(tmp_path: Path) -> None:
    sheet = quads()
    velocity = 25 * np.gradient(sheet.read(0, F).astype(np.float64), axis=0)[:, QUADS].mean(axis=2)
    given = quads(v=gvpipe.Field(np.repeat(velocity, 2, axis=1).astype(np.float32), "triangle"))
    gvpipe.encode(given, tmp_path / "a.mp4", "pca", fields={"v": "1%"})
    with gvpipe.open(tmp_path / "a.mp4") as video:
        bound = gvpipe.info(tmp_path / "a.mp4").fields[0]["bound"]
        assert largest_error(given, video.sequence(), "v") <= bound


def test_tensors_have_six_components(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    six = rng.normal(size=6) * np.sin(POINTS[:, :1] / 3 + TIME[:, :, None] / 4) + 0.1 * rng.normal(size=(F, N * N, 6))
    tensor = six[..., [0, 1, 2, 1, 3, 4, 2, 4, 5]].astype(np.float32)
    given = quads(stress=gvpipe.Field(tensor))
    gvpipe.encode(given, tmp_path / "a.mp4", "pca", fields={"stress": 0.01})
    tensor = tensor.copy()
    tensor[F - 1, 4, [3, 6, 7]] += 0.01
    gvpipe.encode(quads(stress=gvpipe.Field(tensor)), tmp_path / "b.mp4", "pca", fields={"stress": 0.01})
    assert size_of(tmp_path / "a.mp4", "stress") < 0.75 * size_of(tmp_path / "b.mp4", "stress")
    with gvpipe.open(tmp_path / "a.mp4") as video:
        assert largest_error(given, video.sequence(), "stress") <= 0.01
        block = video.fields["stress"][3]
        assert np.array_equal(block[:, 1], block[:, 3])


def test_absolute_pressure_keeps_its_digits(tmp_path: Path) -> None:
    """101325 +- 1 Pa in float64: float32 would leave 0.008 Pa."""
    pressure = 101325 + np.sin(POINTS[:, 0] / 3 + TIME / 4)
    given = quads(p=gvpipe.Field(pressure, unit="Pa"))
    assert given.fields["p"].dtype == np.float64
    gvpipe.encode(given, tmp_path / "a.mp4", "pca", fields={"p": 1e-4})
    info = gvpipe.info(tmp_path / "a.mp4").fields[0]
    assert info["type"] == "float64"
    assert info["range"] == [pressure.min(), pressure.max()]
    with gvpipe.open(tmp_path / "a.mp4") as video:
        assert video.fields["p"][3].dtype == np.float64
        assert largest_error(given, video.sequence(), "p") <= 1e-4
        for name in ("out.pvd", "out.npz", "out.vtkhdf"):
            gvpipe.write(video.sequence(), tmp_path / name)
            assert np.array_equal(gvpipe.read(tmp_path / name).fields["p"][:], video.fields["p"][:])
    with pytest.raises(InputError, match=r"field 'p' is float64, and float32 rounds it .* give it a bound of"):
        gvpipe.encode(given, tmp_path / "b.mp4", "pca", fields={"p": "exact"})
    assert not (tmp_path / "b.mp4").exists()


def test_holes_of_an_offset_field(tmp_path: Path) -> None:
    pressure = 101325 + np.sin(POINTS[:, 0] / 3 + TIME / 4)
    pressure[4, 7] = pressure[:, 11] = np.nan
    gvpipe.encode(quads(p=gvpipe.Field(pressure)), tmp_path / "a.mp4", "pca", fields={"p": "0.001,nan=keep"})
    with gvpipe.open(tmp_path / "a.mp4") as video:
        found = video.sequence()
    assert largest_error(quads(p=gvpipe.Field(pressure)), found, "p") <= 1e-3


def test_float64_that_float32_holds_stays_small(tmp_path: Path) -> None:
    class Lazy:
        shape, dtype = (F, N * N), np.dtype(np.float64)

        def __getitem__(self, key: slice) -> np.ndarray:
            return np.sin(POINTS[:, 0] / 3 + TIME / 4)[key]

    gvpipe.encode(quads(p=gvpipe.Field(Lazy())), tmp_path / "a.mp4", "pca")
    assert gvpipe.info(tmp_path / "a.mp4").fields[0]["type"] == "float32"


def test_files_keep_float64_where_float32_does_not_do(tmp_path: Path) -> None:
    """An initial state of one value says nothing: later frames are looked at, too."""
    first, last = np.full(5, 101325.25), 101325.25 + np.arange(5) / 1000
    assert field_type([first, last]) == np.float64
    assert field_type([first, first + 1000 * np.arange(5)]) == np.float32
    pressure = 101325.25 + np.sin(POINTS[:, 0] / 3) * TIME / 100
    gvpipe.write(quads(p=gvpipe.Field(pressure)), tmp_path / "a.pvd")
    gvpipe.write(quads(p=gvpipe.Field(pressure)), tmp_path / "a.vtkhdf")
    for name in ("a.pvd", "a.vtkhdf"):
        assert np.array_equal(gvpipe.read(tmp_path / name).fields["p"][:], pressure)
    still = np.repeat(pressure[-1:], F, axis=0)
    gvpipe.write(quads(p=gvpipe.Field(still)), tmp_path / "b.pvd")  # no attribute could hold it
    assert np.array_equal(gvpipe.read(tmp_path / "b.pvd").fields["p"][:], still)


def test_bounds_by_length(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    velocity = rng.normal(size=(F, N * N, 3)).astype(np.float32)
    given = quads(v=gvpipe.Field(velocity))
    gvpipe.encode(given, tmp_path / "a.mp4", "pca", fields={"v": "1%,by=length"})
    with gvpipe.open(tmp_path / "a.mp4") as video:
        back = video.sequence()
        order = [int(np.argmin(np.abs(back.read(0, 1)[0] - p).sum(axis=1))) for p in given.read(0, 1)[0]]
        off = np.linalg.norm(back.fields["v"][:][:, order] - velocity, axis=2).max()
    longest = np.linalg.norm(velocity, axis=2).max()
    assert 0.3 * longest / 100 < off <= longest / 100
    with pytest.raises(SettingError, match="behind a comma, nan=keep or by=length is needed"):
        gvpipe.encode(given, tmp_path / "b.mp4", "pca", fields={"v": "1%,by=magnitude"})


@pytest.mark.parametrize(
    "changes",
    [
        {"columns": [0, 0, 1]},
        {"columns": [0] * 8 + [70]},
        {"offsets": [1.0]},
        {"offsets": ["1"] * 6},
        {"offsets": [1e60] * 6},
        {"polygons": True},
        {"polygons": 3},
    ],
)
def test_wrong_members(changes: dict[str, Any], tmp_path: Path) -> None:
    six = np.sin(np.arange(6) + POINTS[:, :1] / 3 + TIME[:, :, None] / 4)
    gvpipe.encode(quads(s=gvpipe.Field(six[..., [0, 1, 2, 1, 3, 4, 2, 4, 5]])), tmp_path / "a.mp4", "pca")
    with gvpipe.open(tmp_path / "a.mp4") as video:
        directory = read_directory(video.bitstream)
        assert directory.fields[0].coding == REDUCED
        values = unpack_json(pack_directory(directory, N * N), "asset", 1 << 20).plain
        n_vertices = video.bitstream.n_vertices
        values["fields"][0]["reduced"].update(changes)
        with pytest.raises(CorruptFile, match="section 'asset'"):
            unpack_directory(pack_json(values), n_vertices)


def test_a_row_per_polygon_needs_polygons(tmp_path: Path) -> None:
    points, faces = grid(5)
    field = gvpipe.Field(np.zeros((3, len(faces))) + np.arange(len(faces)), "triangle")
    sequence = gvpipe.MeshSequence(np.repeat(points[None], 3, 0), faces, 25, fields={"a": field})
    gvpipe.encode(sequence, tmp_path / "a.mp4", "pca")
    with gvpipe.open(tmp_path / "a.mp4") as video:
        directory = read_directory(video.bitstream)
        listed = dataclasses.replace(directory.fields[0], coding=REDUCED, reduced=Reduction(True))
        section = pack_directory(dataclasses.replace(directory, fields=(listed,)), video.bitstream.n_vertices)
        changed = dataclasses.replace(video.bitstream, sections={**video.bitstream.sections, "asset": section})
    with pytest.raises(CorruptFile, match="has a row per polygon, and there are triangles alone"):
        _ = AssetReader(changed, open_reader(changed)).fields["a"][0]
