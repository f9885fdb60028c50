"""What every codec promises; a new codec joins by being registered, and by a line in `BOUNDS`."""

from __future__ import annotations

import dataclasses
import functools
import struct
from collections.abc import Callable
from itertools import pairwise, product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sequences import awkward, same_triangles, waving

import gvpipe
from gvpipe.coding.codec import Codec
from gvpipe.coding.registry import codec_class, codec_ids, open_reader
from gvpipe.container import bitstream as payloads
from gvpipe.container import mp4
from gvpipe.foundation.errors import (
    CorruptFile,
    FormatError,
    NewerVersion,
    NotGeometryVideo,
    SettingError,
    StrippedFile,
    TruncatedFile,
)
from gvpipe.metrics.comparison import compare
from gvpipe.model.sequence import MeshSequence

# the largest rmse, as a part of frame 0's diagonal, at the default quality: each codec's own statement
BOUNDS = {"laplacian": 1e-3, "mcgv": 2e-3, "pca": 1e-3, "pdct": 1e-3}
AWKWARD = awkward()

SETTINGS: dict[str, list[dict[str, Any]]] = {
    "laplacian": [
        {},
        {"operator": "cotangent", "delta_prediction": "rigid"},
        {"operator": "tutte", "delta_prediction": "none"},
    ],
    "mcgv": [
        {},
        {"image": "jpeg"},
        {"profile": "precise"},
        {"prediction": "blended"},
        {"placement": "halves"},
        {"prediction": "blended", "placement": "tiles"},
        {"prediction": "blended", "transform": "klt"},
    ],
    "pca": [{}, {"predictor": "rbf"}, {"predictor": "lsp"}, {"predictor": "navg"}],
    "pdct": [{}, {"clusters": 3, "fineness": 2.0}],
}
CHOSEN = {
    " ".join([codec, *(f"{k}={v}" for k, v in settings.items())]): (codec, settings)
    for codec in codec_ids()
    for settings in SETTINGS.get(codec, [{}])
}
VARIANTS = [pytest.param(*variant, id=name) for name, variant in CHOSEN.items()]
each_codec = pytest.mark.parametrize(("codec", "settings"), VARIANTS)
every_second = pytest.mark.parametrize(  # the others are left to the slow run
    ("codec", "settings"),
    [pytest.param(*v.values, id=v.id, marks=[] if i % 2 == 0 else pytest.mark.slow) for i, v in enumerate(VARIANTS)],
)
AWKWARD_CASES = [  # each variant meets every second input, in one of both orders; the others are left to the slow run
    pytest.param(
        *variant.values,
        reorder,
        name,
        id=f"{variant.id}-{'reorder' if reorder else ''}-{name}",
        marks=[] if (i + j) % 2 == 0 and reorder == (i // 2 + j // 2) % 2 else pytest.mark.slow,
    )
    for (i, variant), reorder, (j, name) in product(enumerate(VARIANTS), (False, True), enumerate(AWKWARD))
]


def make(codec: str, **settings: Any) -> Codec:
    chosen: Codec = codec_class(codec)(**settings)
    return chosen


@pytest.fixture(scope="session")
def encoded(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """The file of a codec variant, encoded when it is first asked for."""
    folder = tmp_path_factory.mktemp("encoded")

    @functools.cache
    def encode(variant: str) -> Path:
        codec, settings = CHOSEN[variant]
        path = folder / f"{len(list(folder.iterdir()))}.mp4"
        gvpipe.encode(waving(), path, codec, **settings)
        return path

    return encode


@pytest.fixture
def path(request: pytest.FixtureRequest, encoded: Callable[[str], Path]) -> Path:
    return encoded(str(request.param))


each_file = pytest.mark.parametrize("path", list(CHOSEN), indirect=True)


@each_file
def test_round_trip_keeps_order_and_connectivity(path: Path) -> None:
    sequence, decoded = waving(), gvpipe.decode(path)
    assert decoded.fps == sequence.fps
    assert same_triangles(decoded.faces, sequence.faces)
    measured = compare(sequence, decoded)
    assert measured.rmse_diag is not None
    assert measured.rmse_diag < BOUNDS[gvpipe.info(path).codec]


@every_second
def test_same_input_same_bytes(codec: str, settings: dict[str, Any], tmp_path: Path) -> None:
    for name in ("a.mp4", "b.mp4"):
        gvpipe.encode(waving(10, 20), tmp_path / name, codec, **settings)
    assert (tmp_path / "a.mp4").read_bytes() == (tmp_path / "b.mp4").read_bytes()


@every_second
def test_quality_is_monotone(codec: str, settings: dict[str, Any], tmp_path: Path) -> None:
    sequence = waving(16, 24)
    sizes, errors = [], []
    for quality in (20, 50, 75, 100):
        sizes.append(gvpipe.encode(sequence, tmp_path / "q.mp4", codec, quality=quality, **settings).bytes)
        errors.append(compare(sequence, gvpipe.decode(tmp_path / "q.mp4")).rmse)
    # where quality asks for nothing yet, a few bytes may move either way
    assert all(after >= before - 16 for before, after in pairwise(sizes))
    assert errors == sorted(errors, reverse=True)
    assert sizes[-1] > 1.15 * sizes[0]
    assert errors[-1] < 0.5 * errors[0]


@each_file
def test_random_access_equals_full_decode(path: Path) -> None:
    video = gvpipe.open(path)
    whole = gvpipe.open(path)[:]
    for k in np.random.default_rng(0).permutation(len(video)):
        assert np.array_equal(video[int(k)], whole[k])
    assert np.array_equal(video[7:33], whole[7:33])
    assert np.array_equal(video[30:3:-5], whole[30:3:-5])
    assert np.array_equal(video[-1], whole[-1])
    assert video[5:5].shape == (0, *whole.shape[1:])
    with pytest.raises(IndexError):
        video[len(video)]


@every_second
def test_segments_decode_alone(codec: str, settings: dict[str, Any], tmp_path: Path) -> None:
    """Cut into segments, the sequence comes back as well, and a frame needs no other segment's sections."""
    sequence = waving()
    gvpipe.encode(sequence, tmp_path / "s.mp4", codec, segment=11, **settings)
    error = compare(sequence, gvpipe.decode(tmp_path / "s.mp4")).rmse_diag
    assert error is not None and error < BOUNDS[codec]
    bitstream = mp4.read_file(tmp_path / "s.mp4")
    own = {name: data for name, data in bitstream.sections.items() if not name[-1].isdigit() or name.endswith(".2")}
    assert len(own) < len(bitstream.sections)
    alone = open_reader(dataclasses.replace(bitstream, sections=own))
    assert np.array_equal(alone.read(21, 29), gvpipe.open(tmp_path / "s.mp4")[21:29])


@every_second
def test_lazy_frames_give_the_same_bytes(codec: str, settings: dict[str, Any], tmp_path: Path) -> None:
    class Lazy:
        def __init__(self, frames: np.ndarray) -> None:
            self.frames, self.shape = frames, frames.shape

        def __getitem__(self, key: slice, /) -> np.ndarray:
            return self.frames[key].copy()

    sequence = waving(10, 20)
    lazy = MeshSequence(Lazy(np.asarray(sequence.positions[:])), sequence.faces, sequence.fps)
    gvpipe.encode(sequence, tmp_path / "a.mp4", codec, **settings)
    gvpipe.encode(lazy, tmp_path / "b.mp4", codec, **settings)
    assert (tmp_path / "a.mp4").read_bytes() == (tmp_path / "b.mp4").read_bytes()


@pytest.mark.parametrize(("codec", "settings", "reorder", "name"), AWKWARD_CASES)
def test_awkward_inputs(codec: str, settings: dict[str, Any], reorder: bool, name: str, tmp_path: Path) -> None:
    sequence = AWKWARD[name]
    gvpipe.encode(sequence, tmp_path / "a.mp4", codec, quality=90, reorder=reorder, **settings)
    decoded = gvpipe.decode(tmp_path / "a.mp4")
    assert np.asarray(decoded.positions[:]).shape == sequence.positions.shape
    assert len(decoded.faces) == len(sequence.faces)
    extent = float(np.ptp(np.asarray(sequence.positions[:], np.float64), axis=(0, 1)).max())
    if not reorder:
        assert same_triangles(decoded.faces, sequence.faces)
        error = np.abs(np.asarray(decoded.positions[:], np.float64) - sequence.positions[:]).max()
        assert error <= 0.02 * extent + 1e-6 * np.abs(sequence.positions[:]).max()
    else:  # the same triangles in space, whatever their order
        ours, theirs = (np.asarray(s.positions[:1])[0][s.faces].mean(axis=1) for s in (sequence, decoded))
        distance = np.linalg.norm(ours[:, None].astype(float) - theirs[None], axis=2)
        assert len(sequence.faces) == 0 or distance.min(axis=1).max() <= 0.02 * extent + 1e-6 * np.abs(ours).max()


@each_codec
def test_settings_are_checked(codec: str, settings: dict[str, Any]) -> None:
    for wrong in ({"quality": 101}, {"quality": -1}, {"quality": "high"}, {"segment": 0}, {"segment": 1.5}):
        with pytest.raises(SettingError, match=next(iter(wrong))):
            make(codec, **settings, **wrong)
    with pytest.raises(SettingError, match="quality"):
        codec_class(codec).from_texts({"qualty": "3"})
    assert codec_class(codec).from_texts({"quality": "30", "reorder": "true"}) == make(codec, quality=30.0, reorder=True)


@each_file
def test_every_truncated_prefix_is_refused(path: Path, tmp_path: Path) -> None:
    data = path.read_bytes()
    cuts = {*range(64), *range(len(data) - 64, len(data)), *np.linspace(64, len(data) - 1, 150, dtype=int).tolist()}
    for cut in sorted(cuts):
        (tmp_path / "cut.mp4").write_bytes(data[:cut])
        with pytest.raises((TruncatedFile, StrippedFile)) as caught:
            gvpipe.open(tmp_path / "cut.mp4")
        assert "cut.mp4" in str(caught.value)
        assert caught.type is TruncatedFile or cut == payload_start(data)


@each_file
def test_one_flipped_byte_in_each_section_is_refused(path: Path, tmp_path: Path) -> None:
    data = path.read_bytes()
    bitstream = mp4.read_file(path)
    targets = {name: data.index(section) for name, section in bitstream.sections.items() if section}
    targets["table"] = payload_start(data) + 24 + len(payloads.MAGIC) + 3
    targets["magic"] = payload_start(data) + 24
    targets["header"] = data.index(next(s for s in bitstream.sections.values() if s)) - 5
    targets["video"] = data.index(b"mdat") + 40
    for name, at in targets.items():
        changed = bytearray(data)
        changed[at] ^= 0x40
        (tmp_path / "flip.mp4").write_bytes(changed)
        with pytest.raises((CorruptFile, NewerVersion)) as caught:
            gvpipe.open(tmp_path / "flip.mp4")
        assert "flip.mp4" in str(caught.value), name


@each_file
def test_wrong_files_each_have_their_error(path: Path, tmp_path: Path) -> None:
    data = path.read_bytes()
    start = payload_start(data)
    version = start + 24 + len(payloads.MAGIC)
    newer = bytearray(data)
    newer[version : version + 2] = struct.pack("<H", payloads.VERSION + 1)
    wrong = {
        CorruptFile: [data + b"\0", data[: start + 24] + b"GVPIPE\r\n" + data[start + 32 :]],
        StrippedFile: [data[:start]],
        NewerVersion: [bytes(newer)],
        NotGeometryVideo: [b"\xff\xd8\xff\xe0 a JPEG", b"# not a video\n" * 40],
        TruncatedFile: [b"", data[: start - 1]],
    }
    for error, contents in wrong.items():
        for content in contents:
            (tmp_path / "wrong.mp4").write_bytes(content)
            with pytest.raises(error, match="wrong.mp4"):
                gvpipe.open(tmp_path / "wrong.mp4")


@each_file
def test_a_newer_codec_version_is_refused(path: Path) -> None:
    bitstream = mp4.read_file(path)
    with pytest.raises(NewerVersion, match="upgrade"):
        open_reader(dataclasses.replace(bitstream, version=codec_class(bitstream.codec).version + 1))
    with pytest.raises(NewerVersion, match="upgrade"):
        open_reader(dataclasses.replace(bitstream, codec="from-the-future"))


@each_file
def test_corrupt_sections_raise_format_errors_only(path: Path) -> None:
    """Past the checksums, a reader still treats its sections as hostile."""
    bitstream = mp4.read_file(path)
    rng = np.random.default_rng(1)
    for name, section in bitstream.sections.items():
        for _ in range(12 if section else 0):
            changed = bytearray(section)
            for at in rng.integers(0, len(section), 2):
                changed[at] = rng.integers(256)
            sections = {**bitstream.sections, name: bytes(changed[: rng.integers(1, len(changed) + 1)])}
            try:
                positions = open_reader(dataclasses.replace(bitstream, sections=sections)).read(0, 12)
            except FormatError:
                continue
            assert positions.shape == (12, bitstream.n_vertices, 3)


def payload_start(data: bytes) -> int:
    """Where the payload's box starts."""
    return data.index(mp4.BOX_UUID.bytes) - 8
