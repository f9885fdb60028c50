"""Archives of NumPy: exact, read by NumPy itself, and refused when damaged."""

from __future__ import annotations

import contextlib
import json
import os
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from assets import assert_same_attribute, assert_same_static, asset
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from mesh_files import FACES, POSITIONS, fast, grid, same_bits

from gvpipe import io
from gvpipe.asset.attribute import DOMAINS, Attribute
from gvpipe.asset.field import Field
from gvpipe.asset.part import Part
from gvpipe.foundation.errors import InputError
from gvpipe.model.sequence import MeshSequence


@fast
@given(POSITIONS, st.floats(0.5, 1000))
def test_npz_round_trip(tmp_path: Path, positions: Any, fps: float) -> None:
    io.write(MeshSequence(positions, FACES, fps), tmp_path / "a.npz")
    read = io.read(tmp_path / "a.npz")
    assert same_bits(read.positions, positions)
    assert same_bits(read.faces, FACES)
    assert read.fps == fps


def test_npz_attributes_and_numpy_reads_it(tmp_path: Path) -> None:
    sequence = grid()
    n, corners = sequence.n_vertices, 3 * len(sequence.faces)
    rng = np.random.default_rng(0)
    kept = {
        "uv": rng.random((corners, 2), np.float32),
        "normal": rng.random((n, 3), np.float32),
        "color": rng.integers(0, 256, (n, 4), np.uint8),
    }
    io.write(grid(attributes=kept), tmp_path / "a.npz")
    read = io.read(tmp_path / "a.npz", fps=12)
    assert read.fps == 12
    assert all(same_bits(read.attributes[name], kept[name]) for name in kept)
    with np.load(tmp_path / "a.npz") as archive:
        assert set(archive.files) == {"vertices", "faces", "fps", *kept}
    first = (tmp_path / "a.npz").read_bytes()
    io.write(grid(attributes=kept), tmp_path / "b.npz")
    assert (tmp_path / "b.npz").read_bytes() == first


def test_what_deflating_saves_little_of_is_stored(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    noise = rng.random((4, 500, 3), np.float32)
    on_a_grid = np.round(4 * noise)
    faces = np.arange(498, dtype=np.int32).reshape(-1, 3)
    for first, others in ((noise, on_a_grid), (on_a_grid, noise)):
        positions = np.concatenate([first[:1], others[1:]])  # the first frame says nothing of the others
        fields = {"height": Field(others[:, :, 2])}
        io.write(MeshSequence(positions, faces, fields=fields), tmp_path / "a.npz")
        with zipfile.ZipFile(tmp_path / "a.npz") as archive:
            kinds = {entry.filename: entry.compress_type for entry in archive.infolist()}
        kind = zipfile.ZIP_STORED if others is noise else zipfile.ZIP_DEFLATED
        assert kinds["vertices.npy"] == kinds["field_height.npy"] == kind and kinds["faces.npy"] == zipfile.ZIP_DEFLATED
        read = io.read(tmp_path / "a.npz")
        assert same_bits(read.positions, positions) and same_bits(read.fields["height"].read(0, 4)[..., 0], others[:, :, 2])
    held = Field(np.zeros((10_000, 4), np.int8), "vertex")
    still = MeshSequence(np.repeat(noise[:1, :4], 10_000, axis=0), faces[:1], fields={"zero": held})
    io.write(still, tmp_path / "still.npz")
    assert (tmp_path / "still.npz").stat().st_size < still.n_frames * 4 * 12 / 50  # frames that repeat, of a small mesh
    io.write(MeshSequence(noise[:1], faces), tmp_path / "one.npz")
    assert same_bits(io.read(tmp_path / "one.npz").positions, noise[:1])


def test_npz_float64_and_no_fps(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", vertices=np.ones((2, 3, 3)) / 3, faces=FACES.astype(np.uint64))
    read = io.read(tmp_path / "a.npz")
    assert read.fps == 30
    assert same_bits(read.positions, np.full((2, 3, 3), 1 / 3, np.float32))


OK = {"vertices": np.zeros((2, 3, 3), np.float32), "faces": FACES}
BAD_ARCHIVES = {
    "no vertices": ({"faces": FACES}, "no array 'vertices' (it holds faces)"),
    "no faces": ({"vertices": OK["vertices"]}, "no array 'faces'"),
    "flat": ({**OK, "vertices": np.zeros((3, 3))}, "'vertices' has shape (3, 3)"),
    "text": ({**OK, "vertices": np.full((1, 3, 3), "a")}, "'vertices' has shape (1, 3, 3) and type <U1"),
    "objects": ({**OK, "vertices": np.full((1, 3, 3), None)}, "cannot be read as .npz: Object arrays"),
    "faces": ({**OK, "faces": FACES[:, :2]}, "faces have shape (3, 2)"),
    "no triangle": ({**OK, "faces": FACES[:0]}, "'faces' has no triangle; a mesh with triangles is needed"),
    "index": ({**OK, "faces": FACES + 1}, "vertex indices must lie in 0..2"),
    "fps": ({**OK, "fps": np.arange(3)}, "'fps' has shape (3,)"),
    "fps 0": ({**OK, "fps": 0}, "fps is 0"),
    "uv": ({**OK, "uv": np.zeros((3, 3))}, "'uv' has shape (3, 3)"),
    "uv rows": ({**OK, "uv": np.zeros((4, 2))}, "'uv' has 4 rows"),
    "nan": ({**OK, "vertices": np.full((2, 3, 3), np.nan)}, "frame 0, vertex 0 is [nan, nan, nan]"),
    "too large": ({**OK, "vertices": np.full((2, 3, 3), 1e300)}, "float32 can hold"),
}


@pytest.mark.parametrize(("arrays", "message"), BAD_ARCHIVES.values(), ids=BAD_ARCHIVES.keys())
def test_npz_errors(tmp_path: Path, arrays: Any, message: str) -> None:
    np.savez(tmp_path / "a.npz", **arrays)
    with pytest.raises(InputError) as error:
        io.read(tmp_path / "a.npz")
    assert message in str(error.value)
    assert str(tmp_path / "a.npz") in str(error.value)
    assert "\n" not in str(error.value)


def test_npz_damaged(tmp_path: Path) -> None:
    io.write(grid(2, 2), tmp_path / "a.npz")
    whole = (tmp_path / "a.npz").read_bytes()
    for stop in range(1, len(whole), 7):
        (tmp_path / "b.npz").write_bytes(whole[:stop])
        with pytest.raises(InputError, match=r"is not an .npz archive, or is cut short"):
            io.read(tmp_path / "b.npz")
    np.save(tmp_path / "c.npy", FACES)
    os.rename(tmp_path / "c.npy", tmp_path / "c.npz")
    with pytest.raises(InputError, match=r"is not an \.npz archive"):
        io.read(tmp_path / "c.npz")
    with pytest.raises(InputError, match="no such file"):
        io.read(tmp_path / "d.npz")


def test_npz_flipped_bytes(tmp_path: Path) -> None:
    io.write(grid(2, 2), tmp_path / "a.npz")
    whole = (tmp_path / "a.npz").read_bytes()
    for at in range(0, len(whole), 11):
        (tmp_path / "b.npz").write_bytes(whole[:at] + bytes([whole[at] ^ 255]) + whole[at + 1 :])
        with contextlib.suppress(InputError):  # a flip in a field that zip readers ignore does no harm
            assert same_bits(io.read(tmp_path / "b.npz").positions, grid(2, 2).positions)


def assert_same_asset(read: MeshSequence, given: MeshSequence) -> None:
    assert_same_static(read, given)
    assert read.metadata == given.metadata
    assert set(read.attributes) == set(given.attributes)
    for name, each in given.attributes.items():
        assert_same_attribute(read.attributes[name], each, given.faces)
    assert set(read.fields) == set(given.fields)
    for name, one in given.fields.items():
        other = read.fields[name]
        assert (other.domain, other.kind, other.unit, other.range, other.shape, other.dtype) == (
            one.domain, one.kind, one.unit, one.range, one.shape, one.dtype
        )  # fmt: skip
        assert same_bits(other.read(0, len(one)), one.read(0, len(one)))


def test_an_asset_comes_back_whole(tmp_path: Path) -> None:
    given = asset()
    assert io.write(given, tmp_path / "a.npz") == ()
    read = io.read(tmp_path / "a.npz")
    assert_same_asset(read, given)
    assert same_bits(read.fields["flow"][1:3], given.fields["flow"][1:3])
    io.write(read, tmp_path / "b.npz")
    assert (tmp_path / "b.npz").read_bytes() == (tmp_path / "a.npz").read_bytes()
    with np.load(tmp_path / "a.npz") as archive:
        assert archive["field_stress"].shape == (3, 9) and archive["attribute_id"].tolist() == [[i] for i in range(8)]
        assert archive["image_0"].tobytes() == given.images[0].data


NAMES = st.sampled_from(["uv", "normal", "color", "uv1", "a b", "mass", "attribute_x", "é"])
TYPES = st.sampled_from([np.float32, np.uint8, np.int16, np.int64, np.uint32])


@st.composite
def attributes(draw: st.DrawFn) -> Attribute:
    """Rows of any type on any domain of the test asset, with indices in half of the cases."""
    rows = {"vertex": 9, "corner": 24, "triangle": 8, "part": 2}
    domain = draw(st.sampled_from(DOMAINS))
    dtype, width = draw(TYPES), draw(st.integers(1, 4))
    if not draw(st.booleans()):
        return Attribute(draw(hnp.arrays(dtype, (rows[domain], width), elements=None, fill=None).filter(finite)), domain)
    values = draw(hnp.arrays(dtype, (draw(st.integers(1, 5)), width)).filter(finite))
    indices = draw(hnp.arrays(np.int32, rows[domain], elements=st.integers(0, len(values) - 1)))
    return Attribute(values, domain, indices=indices, unit=draw(st.sampled_from(["", "m/s", "\u00b0C"])))


def finite(values: Any) -> bool:
    return bool(np.isfinite(values).all())


@fast
@given(st.dictionaries(NAMES, attributes(), max_size=3), hnp.arrays(np.float32, (3, 8)), st.booleans())
def test_any_attributes_and_fields_come_back(tmp_path: Path, made: dict[str, Attribute], values: Any, with_parts: bool) -> None:
    changes: Any = {"parts": asset().parts if with_parts else ()}
    if not with_parts:
        made = {name: each for name, each in made.items() if each.domain != "part"}
    given = asset(attributes=made, fields={"f": Field(values, "triangle")}, **changes)
    io.write(given, tmp_path / "a.npz")
    read = io.read(tmp_path / "a.npz")
    assert_same_asset(read, given)
    io.write(read, tmp_path / "b.npz")
    assert (tmp_path / "b.npz").read_bytes() == (tmp_path / "a.npz").read_bytes()


@pytest.mark.parametrize("order", ["C", "F"])
def test_fields_load_some_frames_at_a_time(tmp_path: Path, order: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gvpipe.io.npz.fields.BLOCK_BYTES", 64)
    speed = np.random.default_rng(3).random((7, 3, 3), np.float32)
    units = "{'units': {'speed': 'm/s, true'}, 'dt': np.float64(0.5)}"
    held = np.asarray(speed, order=order)
    np.savez(tmp_path / "a.npz", vertices=np.zeros((7, 3, 3)), faces=FACES, field_speed=held, meta=units)
    read = io.read(tmp_path / "a.npz", 30)
    assert read.fields["speed"].unit == "m/s" and read.metadata.texts == {"meta": units}
    assert same_bits(read.fields["speed"][5:7], speed[5:7])
    assert same_bits(read.fields["speed"][0:6], speed[0:6])


BAD_ASSETS = {
    "no json": ({"asset": np.array("{")}, "'asset' is not JSON"),
    "list": ({"asset": np.array("[]")}, "'asset' is no description"),
    "newer": ({"asset": np.array('{"version": 2}')}, "written by a newer gvpipe"),
    "image": ({"asset": np.array('{"version": 1, "images": [{"name": "a"}]}')}, "image 0 has no bytes"),
    "no picture": (
        {"asset": np.array('{"version": 1, "images": [{"name": "a", "media_type": "b"}]}'), "image_0": np.zeros(3, np.uint8)},
        "is not a picture",
    ),
    "material": ({"asset": np.array('{"version": 1, "materials": [{"shine": 1}]}')}, "material has 'shine', which a Material"),
    "factor": ({"asset": np.array('{"version": 1, "materials": [{"metallic": "1"}]}')}, "metallic is '1'; a finite number"),
    "texture": ({"asset": np.array('{"version": 1, "materials": [{"emissive_texture": {}}]}')}, "lacks 'image'"),
    "part": ({"asset": np.array('{"version": 1, "parts": [{"name": "a", "vertices": [0]}]}')}, "vertices is [0]; 2 values"),
    "indices": ({"uv": np.zeros((9, 2), "f4"), "indices_uv": np.zeros(8, int)}, "'indices_uv' has shape (8,)"),
    "indices differ": ({"uv": np.eye(9, 2, dtype="f4"), "indices_uv": np.zeros(9, int)}, "one index to corners of different"),
    "nan": ({"attribute_a": np.full(3, np.nan)}, "attribute 'a': value 0 is [nan]"),
    "rows": ({"attribute_a": np.zeros(4)}, "attribute 'a' has 4 rows"),
    "two of a name": ({"uv": np.zeros((3, 2)), "attribute_uv": np.zeros(3)}, "two attributes of one name"),
    "polygons": ({"polygons": np.array([4])}, "the polygons' fans are not 3 triangles"),
    "field": ({"field_a": np.zeros(3)}, "'field_a' has shape (3,)"),
    "field rows": ({"field_a": np.zeros((2, 4))}, "field 'a' has shape (2, 4)"),
    "field text": ({"field_a": np.array([["a"]])}, "'field_a' has shape (1, 1) and type <U1"),
}


@pytest.mark.parametrize(("arrays", "message"), BAD_ASSETS.values(), ids=BAD_ASSETS.keys())
def test_npz_asset_errors(tmp_path: Path, arrays: Any, message: str) -> None:
    np.savez(tmp_path / "a.npz", **{**OK, **arrays})
    with pytest.raises(InputError) as error:
        io.read(tmp_path / "a.npz")
    assert message in str(error.value)
    assert "\n" not in str(error.value)


def test_ten_thousand_parts(tmp_path: Path) -> None:
    n = 10_000
    faces = np.arange(3 * n, dtype=np.int32).reshape(-1, 3)
    parts = tuple(Part(f"part {i}", (3 * i, 3 * i + 3), (i, i + 1)) for i in range(n))
    given = MeshSequence(np.zeros((1, 3 * n, 3), np.float32), faces, parts=parts)
    io.write(given, tmp_path / "a.npz")
    assert io.read(tmp_path / "a.npz").parts == parts


@pytest.mark.parametrize("order", ["C", "F"])
def test_a_damaged_field_is_refused_when_it_is_read(tmp_path: Path, order: Any) -> None:
    heat = np.asarray(np.random.default_rng(1).random((9000, 3), np.float32), order=order)
    np.savez(tmp_path / "a.npz", vertices=np.zeros((9000, 3, 3)), faces=FACES, field_heat=heat)
    whole = (tmp_path / "a.npz").read_bytes()
    at = whole.index(heat.tobytes(order)[:8]) + 90_000
    (tmp_path / "a.npz").write_bytes(whole[:at] + bytes([whole[at] ^ 1]) + whole[at + 1 :])
    read = io.read(tmp_path / "a.npz")
    with pytest.raises(InputError, match=r"a.npz: 'field_heat' cannot be read: Bad CRC-32 .*write it again"):
        read.fields["heat"].read(0, 2)
    with pytest.raises(InputError, match="'field_heat' cannot be read"):
        read.fields["heat"].read(0, 2)


def test_misspelt_members_are_noted(tmp_path: Path) -> None:
    """What means nothing is left out with a note: a misspelt field would be lost without a word."""
    described = {"version": 1, "atributes": {}, "attributes": {"gone": {"domain": "vertex", "kind": "scalar", "unit": ""}}}
    vertices, faces = np.eye(3)[None], np.array([[0, 1, 2]])
    odd_members: dict[str, Any] = {"Fps": 30, "feild_heat": np.zeros((1, 3))}
    np.savez(
        tmp_path / "a.npz",
        vertices=vertices,
        faces=faces,
        **odd_members,
        indices_heat=np.zeros(3, int),
        image_0=np.zeros(3, np.uint8),
        attribute_=[1, 2, 3],
    )
    read = io.read(tmp_path / "a.npz")
    odd = "'Fps', 'feild_heat', 'indices_heat', 'image_0', 'attribute_'"
    assert read.notes == (f"members of the archive mean nothing and were left out: {odd}; did you mean 'fps'?",)
    assert not read.fields and not read.attributes
    np.savez(tmp_path / "a.npz", vertices=vertices, faces=faces, asset=np.array(json.dumps(described)))
    assert io.read(tmp_path / "a.npz").notes == (
        "'asset' has keys that mean nothing: 'atributes'; did you mean 'attributes'?",
        "'asset' describes attributes that are not there: 'gone'",
    )


def test_damaged_lzma(tmp_path: Path) -> None:
    io.write(grid(1, 2), tmp_path / "a.npz")
    with zipfile.ZipFile(tmp_path / "a.npz") as plain, zipfile.ZipFile(tmp_path / "b.npz", "w", zipfile.ZIP_LZMA) as packed:
        for name in plain.namelist():
            packed.writestr(name, plain.read(name))
    data = bytearray((tmp_path / "b.npz").read_bytes())
    data[60:80] = bytes([0x55]) * 20
    (tmp_path / "b.npz").write_bytes(data)
    with pytest.raises(InputError, match=r"b\.npz cannot be read as \.npz: "):
        io.read(tmp_path / "b.npz")


def test_member_that_is_no_array(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", vertices=np.zeros((1, 3, 3)), faces=np.array([[0, 1, 2]]))
    with zipfile.ZipFile(tmp_path / "a.npz", "a") as archive:
        archive.writestr("fps.npy", b"30")
    with pytest.raises(InputError, match=r"a\.npz cannot be read as \.npz: its member 'fps' is no array; write it again"):
        io.read(tmp_path / "a.npz")
