"""A mesh far from the origin keeps its shape: in memory, in files, through every codec, and in what is measured."""

from __future__ import annotations

import dataclasses
import json
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from odd_headers import first_payload
from sequences import grid, waving

import gvpipe
from gvpipe.coding.registry import codec_ids
from gvpipe.container import mp4
from gvpipe.container.bitstream import Bitstream, unpack_payload
from gvpipe.foundation.errors import CorruptFile, InputError
from gvpipe.model.origin import LOSS, choose_origin, narrow, rounding
from gvpipe.model.sequence import MeshSequence
from gvpipe.rendering.error_map import ErrorMap

FAR = np.array([5.2e6, 0.25, -5e5])
Run = Callable[..., Any]


def positions(offset: np.ndarray = FAR) -> np.ndarray:
    """``(40, 100, 3) float64``, size about 1.4, with digits that float32 does not hold."""
    near = np.asarray(waving(10).positions, np.float64)
    moved: np.ndarray = near + np.random.default_rng(1).normal(0, 1e-9, near.shape) + offset
    return moved


FACES = waving(10).faces


@pytest.fixture
def far_npz(tmp_path: Path) -> Path:
    np.savez(tmp_path / "far.npz", vertices=positions(), faces=FACES, fps=24.0)
    return tmp_path / "far.npz"


def sheet(offset: np.ndarray) -> MeshSequence:
    return MeshSequence(positions(offset), FACES, 24.0, name="sheet")


# in memory


def test_shape_survives_in_memory() -> None:
    far = sheet(FAR)
    assert far.origin.dtype == np.float64 and np.asarray(far.positions).dtype == np.float32
    assert len(np.unique(positions().astype(np.float32).reshape(-1, 3), axis=0)) < 1000  # of 4000: what it was before
    assert len(np.unique(far.read(0, 40).reshape(-1, 3), axis=0)) == len(np.unique(positions().reshape(-1, 3), axis=0))
    assert np.abs(far.read(3, 5) + far.origin - positions()[3:5]).max() < 2e-7
    assert np.array_equal(far.read_absolute(0, 40), positions())
    assert np.abs(far.read_exact(0, 40) + far.origin - positions()).max() < 2e-9


def test_infinite_positions_are_rounded_in_silence() -> None:
    """Readers refuse them afterwards, in one line; a warning of NumPy would be a second."""
    exact = np.array([[[np.inf, 0.1, 1e300]]])
    assert rounding(exact, narrow(exact, np.zeros(3)), np.zeros(3)) >= 0


def test_the_origin_is_round_and_only_where_it_matters() -> None:
    assert sheet(FAR).origin.tolist() == [5200001, 0, -500000]  # the sheet drifts along x; y is near enough
    assert sheet(np.zeros(3)).origin.tolist() == [0, 0, 0]
    assert np.array_equal(sheet(np.zeros(3)).read(0, 40), positions(np.zeros(3)).astype(np.float32))


def test_what_float32_holds_is_left_alone() -> None:
    as_float32 = positions().astype(np.float32)
    for held in (as_float32, as_float32.astype(np.float64)):
        found = MeshSequence(held, FACES)
        assert not found.origin.any() and np.array_equal(found.read(0, 40), as_float32)
    point = MeshSequence(np.full((2, 3, 3), 1 / 3), np.array([[0, 1, 2]]))
    assert not point.origin.any() and np.array_equal(point.read(0, 2), np.full((2, 3, 3), 1 / 3, np.float32))


def test_integers_count_too() -> None:
    corners = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]]) + (1 << 30) + 1
    assert np.array_equal(MeshSequence(corners, np.array([[0, 1, 2]], np.int32)).read_absolute(0, 1), corners)


@given(st.floats(-1e9, 1e9), st.floats(1e-3, 1e3), st.integers(0, 9))
def test_narrowing_keeps_a_millionth_of_the_size(offset: float, size: float, seed: int) -> None:
    points = np.random.default_rng(seed).random((2, 20, 3)) * size + offset
    origin = choose_origin(points)
    diagonal = np.linalg.norm(np.ptp(points[0], axis=0))
    assert np.abs(narrow(points, origin) + origin - points).max() <= LOSS * diagonal + 2 * np.spacing(abs(offset) + size)
    assert np.array_equal(origin, choose_origin(points))
    if origin.any():
        assert np.abs(points.astype(np.float32) - points).max() > LOSS * diagonal


def test_derived_sequences_keep_it() -> None:
    far, order = sheet(FAR), np.random.default_rng(0).permutation(100)
    faces = np.argsort(order)[FACES].astype(np.int32)
    for derived, wanted in (
        (far.part(3, 9), positions()[3:9]),
        (far.reordered(order, faces), positions()[:, order]),
        (far.reordered(order, faces).part(3, 9), positions()[3:9, order]),
        (far.with_fps(60.0), positions()),
    ):
        assert np.array_equal(derived.origin, far.origin)
        assert np.array_equal(derived.read_absolute(0, len(derived)), wanted)
        assert np.abs(derived.read(0, len(derived)) + far.origin - wanted).max() < 2e-7
    assert not far.local().origin.any() and np.array_equal(far.local().read(0, 40), far.read(0, 40))


def test_replaced_positions_are_not_measured_by_the_old_ones() -> None:
    far = sheet(FAR)
    moved = dataclasses.replace(far, positions=np.asarray(far.positions) + np.float32(0.5))
    assert np.allclose(moved.read_exact(0, 40) - far.read_exact(0, 40), 0.5, atol=1e-6)


def test_positions_relative_to_an_origin_that_is_given() -> None:
    given = MeshSequence(positions(np.zeros(3)), FACES, origin=FAR)
    assert np.array_equal(given.origin, FAR) and gvpipe.compare(given, sheet(FAR)).max < 1e-8
    both = MeshSequence(positions(FAR), FACES, origin=-FAR)
    assert np.abs(both.read_absolute(0, 40) - positions(np.zeros(3))).max() < 1e-8


def test_datasets_of_float64(tmp_path: Path) -> None:
    """What slices like an HDF5 dataset is as exact as the array in it, and loads no more than it is asked for."""

    class Dataset:
        def __init__(self, values: np.ndarray) -> None:
            self.values, self.shape, self.dtype, self.asked = values, values.shape, values.dtype, 0

        def __getitem__(self, key: slice) -> np.ndarray:
            assert isinstance(key, slice)
            self.asked = max(self.asked, len(range(*key.indices(40))))
            return self.values[key].copy()

    data = Dataset(positions())
    lazy = MeshSequence(data, FACES, 24.0)
    assert data.asked == 1 and lazy.origin.tolist() == [5200000, 0, -500000]
    assert np.array_equal(lazy.read_absolute(3, 7), positions()[3:7]) and data.asked == 4
    assert np.abs(lazy[:] + lazy.origin - positions()).max() < 4e-7 and 0 < lazy.rounding < 4e-7
    assert gvpipe.compare(lazy, sheet(FAR)).max == 0
    gvpipe.encode(lazy, tmp_path / "lazy.mp4", "pca")
    found = gvpipe.compare(lazy.part(2, 30), gvpipe.decode(tmp_path / "lazy.mp4", 2, 30))
    assert found.rmse_diag is not None and found.rmse_diag < 1e-3
    moved = MeshSequence(Dataset(positions(np.zeros(3))), FACES, origin=FAR)
    assert np.array_equal(moved.origin, FAR) and gvpipe.compare(moved, sheet(FAR)).max < 1e-8
    with pytest.raises(InputError, match="shape"):
        MeshSequence(Dataset(np.zeros((0, 3, 3))), FACES)
    broken = MeshSequence(Dataset(np.where(np.arange(40)[:, None, None] == 5, np.nan, positions())), FACES)
    for read in (broken.read, broken.read_exact, broken.read_absolute):
        with pytest.raises(InputError, match="frame 5, vertex 0"):
            read(0, 40)


@pytest.mark.parametrize("origin", [[0, 0], [np.nan, 0, 0], [0, np.inf, 0], [1e39, 0, 0], ["a", "b", "c"], None])
def test_bad_origins(origin: Any) -> None:
    with pytest.raises(InputError, match="origin"):
        MeshSequence(positions(), FACES, origin=origin)


def test_frames_beyond_float32_are_refused_still() -> None:
    with pytest.raises(InputError, match="float32 can hold"):
        MeshSequence(np.full((1, 3, 3), 1e300) * [[[1], [2], [3]]], np.array([[0, 1, 2]], np.int32))


# through files


@pytest.mark.parametrize("codec", codec_ids())
def test_every_codec_is_as_good_there_as_here(codec: str, tmp_path: Path) -> None:
    """Measured from the decoded file by hand, in float64; and `compare` says the same."""
    errors = []
    for offset in (np.zeros(3), FAR):
        gvpipe.encode(sheet(offset), tmp_path / "a.mp4", codec)
        decoded = gvpipe.decode(tmp_path / "a.mp4")
        distance = np.linalg.norm(decoded.read_absolute(0, 40) - positions(offset), axis=2)
        found = gvpipe.compare(sheet(offset), gvpipe.read(tmp_path / "a.mp4"))
        assert abs(found.max - distance.max()) < 2e-9
        assert abs(found.rmse - np.sqrt((distance**2).mean(axis=1)).mean()) < 2e-9
        assert [frame["max"] for frame in found.frames] == pytest.approx(distance.max(axis=1), abs=2e-9)
        errors.append(found.rmse)
    assert errors[1] == pytest.approx(errors[0], rel=0.1)


def test_float64_is_measured_in_float64_near_the_origin_too(tmp_path: Path) -> None:
    near = sheet(np.zeros(3))
    rounded = MeshSequence(positions(np.zeros(3)).astype(np.float32), FACES)
    wanted = np.linalg.norm(positions(np.zeros(3)) - np.asarray(rounded.positions), axis=2).max()
    assert gvpipe.compare(near, rounded).max == pytest.approx(wanted, rel=1e-9) and wanted > 0


def test_origins_that_differ_are_compared_in_float64() -> None:
    """The same mesh twice, its positions relative to other points; and an object moved by 1e-5 at five millions."""
    there = MeshSequence(np.asarray(sheet(FAR).positions), FACES, origin=sheet(FAR).origin)
    shifted = MeshSequence(np.asarray(there.positions) - np.float32(0.5), FACES, origin=there.origin + 0.5)
    assert gvpipe.compare(there, shifted).max < 2e-7
    moved = MeshSequence(positions(FAR + np.array([1e-5, 0, 0])), FACES)
    assert gvpipe.compare(sheet(FAR), moved).max == pytest.approx(1e-5, abs=2e-9)
    assert gvpipe.compare(sheet(FAR), sheet(np.zeros(3))).rmse == pytest.approx(np.linalg.norm(FAR), rel=1e-12)


def test_reordered_vertices_are_matched_there(tmp_path: Path) -> None:
    gvpipe.encode(sheet(FAR), tmp_path / "free.mp4", reorder=True)
    video = gvpipe.read(tmp_path / "free.mp4")
    error = gvpipe.compare(sheet(FAR), video).rmse_diag
    assert error is not None and error < 3e-3
    errors = ErrorMap(sheet(FAR), video, range(40)).errors(5)
    assert 0 < errors.max() < 3


@pytest.mark.slow
def test_a_bound_is_kept_there(tmp_path: Path) -> None:
    report = gvpipe.encode(sheet(FAR), tmp_path / "bound.mp4", max_error=1e-4)
    decoded = gvpipe.decode(tmp_path / "bound.mp4").read_absolute(0, 40)
    assert np.linalg.norm(decoded - positions(), axis=2).max() <= 1e-4
    assert report.tried[-1]["max_diag"] is not None


def test_info_and_player(run: Run, far_npz: Path, tmp_path: Path) -> None:
    assert run("encode", far_npz, tmp_path / "far.mp4").status == 0
    with gvpipe.open(tmp_path / "far.mp4") as video:
        assert video.origin.tolist() == [5200001, 0, -500000] == video.sequence().origin.tolist()
        assert np.abs(video[3]).max() < 3
    assert json.loads(run("info", tmp_path / "far.mp4", "--json").out)["origin"] == [5200001, 0, -500000]
    assert "relative to 5200001, 0, -500000" in run("info", tmp_path / "far.mp4").out
    values = json.loads(run("compare", far_npz, tmp_path / "far.mp4", "--json").out)
    wanted = np.linalg.norm(gvpipe.decode(tmp_path / "far.mp4").read_absolute(0, 40) - positions(), axis=2).max()
    assert abs(values["max"] - wanted) < 2e-9


def test_levels_of_detail_keep_it(tmp_path: Path) -> None:
    gvpipe.encode(sheet(FAR), tmp_path / "far.mp4", "pca")
    lod = len(gvpipe.open(tmp_path / "far.mp4").levels) - 1
    coarse = gvpipe.decode(tmp_path / "far.mp4", lod=lod)
    assert coarse.n_vertices < 100 and np.abs(coarse.read_absolute(0, 40).mean(axis=(0, 1)) - FAR).max() < 3


@pytest.mark.parametrize("name", ["out.npz", "out/%02d.obj", "out/%02d.off", "out/%02d.ply", "out/%02d.glb"])
def test_decoding_adds_it_where_the_format_can_hold_it(name: str, run: Run, far_npz: Path, tmp_path: Path) -> None:
    gvpipe.encode(far_npz, tmp_path / "far.mp4")
    decoded = gvpipe.decode(tmp_path / "far.mp4")
    assert run("decode", tmp_path / "far.mp4", tmp_path / name).status == 0
    read = gvpipe.read(tmp_path / name)
    assert np.abs(read.read_absolute(0, 40) - decoded.read_absolute(0, 40)).max() < 3e-7
    assert gvpipe.compare(read, decoded).max < 5e-7
    if name == "out.npz":
        with np.load(tmp_path / name) as archive:
            assert archive["vertices"].dtype == np.float64
            assert np.array_equal(archive["vertices"], decoded.read_absolute(0, 40))


def test_decoding_without_it(run: Run, far_npz: Path, tmp_path: Path) -> None:
    gvpipe.encode(far_npz, tmp_path / "far.mp4")
    refused = run("decode", tmp_path / "far.mp4", tmp_path / "out" / "%02d.stl")
    assert refused.status == 1 and "--local" in refused.err and "5200001" in refused.err and not (tmp_path / "out").exists()
    for name in ("local.npz", "stl/%02d.stl", "obj/%02d.obj"):
        ended = run("decode", tmp_path / "far.mp4", tmp_path / name, "--local")
        assert ended.status == 0 and "5200001, 0, -500000" in ended.err
        assert np.abs(gvpipe.read(tmp_path / name).read_absolute(0, 40)).max() < 3
    with np.load(tmp_path / "local.npz") as archive:
        assert archive["vertices"].dtype == np.float32


def test_text_frames_have_one(run: Run, tmp_path: Path) -> None:
    """An OBJ sequence at millions, as a simulation writes it: encoded and compared without loss of shape."""
    (tmp_path / "sim").mkdir()
    points, faces = grid(5)
    tail = "".join("f {} {} {}\n".format(*(face + 1)) for face in faces)
    frames = [points * 1.4 + FAR + np.array([0, 0.1 * i, 0.1]) for i in range(4)]
    for i, frame in enumerate(frames):
        (tmp_path / "sim" / f"{i}.obj").write_text("".join("v {!r} {!r} {!r}\n".format(*row) for row in frame.tolist()) + tail)
    read = gvpipe.read(tmp_path / "sim")
    assert read.origin.tolist() == [5200001, 0, -500000]
    assert np.abs(read.read(0, 4) + read.origin - np.stack(frames)).max() < 2e-7


def test_what_no_origin_can_save_is_told(tmp_path: Path) -> None:
    """An object that flies a million times its size: in memory and as frame files."""
    points, faces = grid(5)
    flight = np.stack([points + np.array([0.3e6 * i + 0.001, 0, 0]) for i in range(4)])
    in_memory = MeshSequence(flight, faces)
    (tmp_path / "f").mkdir()
    tail = "".join("f {} {} {}\n".format(*(face + 1)) for face in faces)
    for i, frame in enumerate(flight):
        (tmp_path / "f" / f"{i}.obj").write_text("".join("v {!r} {!r} {!r}\n".format(*row) for row in frame.tolist()) + tail)
    for source in (in_memory, gvpipe.read(tmp_path / "f", 30.0)):
        (note,) = gvpipe.encode(source, tmp_path / "o.mp4", "pca").notes
        assert note.startswith("positions reach so far from the first frame's that float32 rounds them by up to 0.0")
    assert gvpipe.encode(sheet(FAR), tmp_path / "o.mp4", "pca").notes == []


# the bytes


def test_files_without_one_are_as_they_were() -> None:
    plain = Bitstream("mcgv", 1, 1, 1, 0, 30.0)
    assert b"origin" not in zlib.decompress(_header(first_payload(plain, {})))
    assert unpack_payload(first_payload(plain, {}))[0].origin == (0.0, 0.0, 0.0)


def test_the_field_goes_there_and_back() -> None:
    origin = (5200001.0, -0.1, 1e-300)
    payload = first_payload(Bitstream("mcgv", 1, 1, 1, 0, 30.0, origin=origin), {})
    assert unpack_payload(payload)[0].origin == origin


@pytest.mark.parametrize(
    "value", [None, 5, "far", [], [1, 2], [1, 2, 3, 4], [1, 2, "3"], [1, True, 3], [1e39, 0, 0], [10**400, 0, 0], {"x": 1}]
)
def test_a_hostile_field_is_refused(value: object) -> None:
    with pytest.raises(CorruptFile, match="origin"):
        unpack_payload(_with_origin(json.dumps(value)))


@pytest.mark.parametrize("text", ["[NaN,0,0]", "[Infinity,0,0]", "[1e999,0,0]"])
def test_numbers_that_are_none_are_refused(text: str) -> None:
    with pytest.raises(CorruptFile):
        unpack_payload(_with_origin(text))


def test_a_damaged_file_names_itself(far_npz: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    gvpipe.encode(far_npz, tmp_path / "far.mp4")
    found = mp4.read_file(tmp_path / "far.mp4")
    mp4.write_file(dataclasses.replace(found, origin=(1e39, 0.0, 0.0)), tmp_path / "bad.mp4")
    with pytest.raises(CorruptFile, match=r"bad\.mp4.*origin"):
        gvpipe.open(tmp_path / "bad.mp4")


def _header(payload: bytes) -> bytes:
    return payload[payload.index(b"\x78\xda") :]


def _with_origin(text: str) -> bytes:
    """A payload whose header holds this JSON text as its origin."""
    mark = 1.25
    payload = first_payload(Bitstream("mcgv", 1, 1, 1, 0, 30.0, origin=(mark, mark, mark)), {})
    old = zlib.decompress(_header(payload))
    new = zlib.compress(old.replace(b"[1.25,1.25,1.25]", text.encode()), 9)
    head = payload[: 8 + 4] + b"\x06header" + len(new).to_bytes(8, "little") + zlib.crc32(new).to_bytes(4, "little")
    return head + zlib.crc32(head).to_bytes(4, "little") + new
