"""Fields and assets in pages: what the exporter makes of them, read back here as the player reads it."""

from __future__ import annotations

import base64
import json
import re
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from asset_files import picture
from folders import SAMPLES
from sequences import waving

import gvpipe
from gvpipe import Field, Image, Material, Part, Texture
from gvpipe.asset_coding.directory import unpack_directory
from gvpipe.container.mp4 import read_file
from gvpipe.errors import InputError
from gvpipe.web import field_export
from gvpipe.web.field_export import CODING, COLOURS, HEAD, ORDERS, encode_web_field, find_parents

NO_FACES = np.zeros((0, 3), np.int32)


def restored(data: bytes, shape: tuple[int, int, int], faces: npt.NDArray[np.int32] = NO_FACES) -> npt.NDArray[np.float64]:
    """The values ``(F, R, C)`` of a section, by the module's formula."""
    parents = find_parents(shape[1], faces)
    size, low, step, _ = HEAD.unpack_from(data)
    n_groups = -(-shape[0] // size)
    lengths = np.frombuffer(data, "<u4", n_groups, HEAD.size)
    at, frames = HEAD.size + 4 * n_groups, []
    for g, length in enumerate(lengths):
        group = data[at : at + length]
        at += int(length)
        n = min(size, shape[0] - g * size)
        low_bytes, high_bytes = np.frombuffer(zlib.decompress(group[1:]), np.uint8).reshape(2, n, *shape[1:]).astype(np.int64)
        folded = low_bytes + 256 * high_bytes
        left = np.where(folded % 2, -(folded + 1) // 2, folded // 2)
        order, by_rows = group[0] % ORDERS, group[0] >= ORDERS
        for k in range(n):
            if by_rows or order == 0 or k == 0:
                for row in range(1, shape[1]):
                    left[k, row] += left[k, parents[row]]
            if order and k:
                left[k] += left[k - 1] if order == 1 or k == 1 else 2 * left[k - 1] - left[k - 2]
        levels = left & 65535
        frames.append(np.where(levels == 0, np.nan, low + step * (levels - 1.0)))
    assert at == len(data)
    return np.concatenate(frames)


def noise(shape: tuple[int, ...], seed: int = 0) -> npt.NDArray[np.float32]:
    return np.cumsum(np.random.default_rng(seed).normal(size=shape), axis=0).astype(np.float32)


@pytest.mark.parametrize("shape", [(1, 1, 1), (5, 7, 1), (70, 11, 3), (33, 1, 2)])
@pytest.mark.parametrize("scale", [1.0, 1e-30, 1e30])
def test_every_value_keeps_the_bound(shape: tuple[int, int, int], scale: float) -> None:
    values = noise(shape) * np.float32(scale)
    if shape[0] > 3:
        values[2:4, ::2] = np.nan
    coded = encode_web_field(Field(values), NO_FACES)
    found = restored(coded.data, shape)
    assert np.array_equal(np.isnan(found), np.isnan(values))
    span = float(np.nanmax(values)) - float(np.nanmin(values))
    assert np.nanmax(np.abs(found.astype(np.float32).astype(float) - values), initial=0.0) <= coded.bound
    assert coded.bound == pytest.approx(span / COLOURS, rel=1e-3)
    assert coded.range == (np.nanmin(values), np.nanmax(values))


def test_small_steps_on_large_numbers_keep_what_is_stated() -> None:
    """Where float32 itself is coarser than 1/1023 of the range, the bound says so."""
    values = (1e6 + noise((9, 20, 1)) / 50).astype(np.float32)
    coded = encode_web_field(Field(values), NO_FACES)
    found = restored(coded.data, (9, 20, 1)).astype(np.float32).astype(float)
    assert np.abs(found - values).max() <= coded.bound < 0.2


def test_a_coarser_bound_of_the_file_takes_fewer_bytes() -> None:
    field = Field(noise((40, 200)))
    fine, coarse = encode_web_field(field, NO_FACES), encode_web_field(field, NO_FACES, 1.0)
    assert coarse.bound == 1.0 and len(coarse.data) < 0.6 * len(fine.data)


def test_integers_are_exact() -> None:
    values = np.random.default_rng(1).integers(-3000, 60000, (4, 9, 2)).astype(np.int32)
    coded = encode_web_field(Field(values), NO_FACES)
    assert coded.bound == 0 and np.array_equal(restored(coded.data, values.shape), values)


def test_constant_fields_and_fields_of_holes_take_few_bytes() -> None:
    for value in (3.5, np.nan):
        values = np.full((64, 500), value, np.float32)
        coded = encode_web_field(Field(values), NO_FACES)
        assert len(coded.data) < 200
        assert np.array_equal(restored(coded.data, (64, 500, 1))[:, :, 0], values, equal_nan=True)
    assert coded.range is None


def test_frames_that_follow_each_other_take_fewer_bytes() -> None:
    rng = np.random.default_rng(0)
    smooth = np.sin(6 * rng.random(400) + np.arange(64)[:, None] / 50).astype(np.float32)
    shuffled = smooth[rng.permutation(64)]
    assert len(encode_web_field(Field(smooth), NO_FACES).data) < 0.5 * len(encode_web_field(Field(shuffled), NO_FACES).data)


def test_neighbours_predict_each_other() -> None:
    """Of a sheet in random order: neighbours lie anywhere among the rows."""
    sheet = waving(20, 8)
    field = Field(np.asarray(sheet.positions[0:8])[:, :, 2])
    faces = sheet.faces
    coded = encode_web_field(field, faces)
    assert len(coded.data) < 0.9 * len(encode_web_field(field, NO_FACES).data)
    assert np.abs(restored(coded.data, (8, 400, 1), faces)[:, :, 0] - field[0:8]).max() <= coded.bound


def test_a_field_too_large_for_a_browser_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(field_export, "MAX_VALUES", 99)
    with pytest.raises(InputError, match="100 values a frame; the web player shows up to 99"):
        encode_web_field(Field(np.zeros((2, 100))), NO_FACES)


def asset() -> gvpipe.MeshSequence:
    """Two sheets with a texture, and fields of every domain."""
    sheet = waving(8, 10)
    frames = np.concatenate([sheet.read(0, 10), sheet.read(0, 10) + np.array([2, 0, 0], np.float32)], axis=1)
    faces = np.concatenate([sheet.faces, sheet.faces + 64])
    return gvpipe.MeshSequence(
        frames,
        faces,
        24.0,
        attributes={"uv": frames[0, :, :2]},
        fields={"heat": Field(noise((10, 128)), unit="K"), "cell": Field(noise((10, len(faces), 2)), "triangle")},
        parts=(Part("a", (0, 64), (0, 98), 0), Part("b", (64, 128), (98, 196), 0)),
        materials=(Material("paper", base_color_texture=Texture(0)),),
        images=(Image("dots", "image/png", picture([[[9, 9, 9]]])),),
    )


@pytest.mark.parametrize("codec", ["mcgv", "pca"])
def test_pages_carry_the_asset(codec: str, tmp_path: Path) -> None:
    """As it is, or converted: fields within the sum of both bounds, of the triangle that they belong to."""
    gvpipe.encode(asset(), tmp_path / "a.mp4", codec)
    gvpipe.export_html(tmp_path / "a.mp4", tmp_path / "a.html")
    inside = tmp_path / "inside.mp4"
    inside.write_bytes(embedded(tmp_path / "a.html"))
    whole, shown = gvpipe.open(tmp_path / "a.mp4"), gvpipe.open(inside)
    bitstream = read_file(inside)
    directory = unpack_directory(bitstream.section("asset"), 128)
    assert [part.name for part in shown.parts] == ["a", "b"]
    assert shown.materials == whole.materials and shown.images[0].data == whole.images[0].data
    bound = 2 * directory.attributes[0].bound
    assert np.abs(np.asarray(shown.attributes["uv"]) - np.asarray(whole.attributes["uv"])).max() <= bound
    heat, cell = directory.fields
    assert heat.coding == cell.coding == CODING and (heat.unit, heat.components, cell.components) == ("K", 0, 2)
    source = asset()
    values = restored(bitstream.section(heat.section), (10, 128, 1), shown.faces)[:, :, 0]
    assert np.abs(values - source.fields["heat"].read(0, 10)[:, :, 0]).max() <= heat.bound
    rows = {tuple(sorted(face)): row for row, face in enumerate(source.faces.tolist())}
    order = [rows[tuple(sorted(face))] for face in shown.faces.tolist()]
    values = restored(bitstream.section(cell.section), (10, 196, 2))
    assert np.abs(values - source.fields["cell"].read(0, 10)[:, order]).max() <= cell.bound
    if codec == "mcgv":
        assert np.array_equal(shown[:], whole[:])  # positions are not coded again


def test_normals_of_frames_stay_behind(tmp_path: Path) -> None:
    """The player computes them; all else of the file is unchanged."""
    sheet = waving(6, 5)
    up = np.zeros((5, 36, 3), np.float32)
    up[:, :, 2] = 1
    sequence = gvpipe.MeshSequence(sheet.positions, sheet.faces, fields={"normal": Field(up, kind="normal")})
    gvpipe.encode(sequence, tmp_path / "a.mp4")
    gvpipe.export_html(tmp_path / "a.mp4", tmp_path / "a.html")
    (tmp_path / "inside.mp4").write_bytes(embedded(tmp_path / "a.html"))
    sections = read_file(tmp_path / "inside.mp4").sections
    assert "field.0" not in sections and "asset" in sections


def test_a_sample_with_all_of_it_becomes_a_page(tmp_path: Path) -> None:
    gvpipe.encode(SAMPLES / "flag.npz", tmp_path / "flag.mp4", preset="fast")
    report = gvpipe.export_html(tmp_path / "flag.mp4", tmp_path / "flag.html")
    assert report.converted == "" and report.bytes <= 1.4 * report.video_bytes + 1.5e6
    (tmp_path / "inside.mp4").write_bytes(embedded(tmp_path / "flag.html"))
    listing: Any = json.loads(zlib.decompress(read_file(tmp_path / "inside.mp4").section("asset")))
    assert [field["coding"] for field in listing["fields"]] == [CODING]


def embedded(page: Path) -> bytes:
    (text,) = re.findall(r'<script type="text/plain" id="video">(.*?)</script>', page.read_text("utf-8"))
    return base64.b64decode(text, validate=True)
