"""What stands still in the source stands still in the file, bit for bit: vertices, whole frames, vertices that coincide."""

from __future__ import annotations

import dataclasses
from itertools import product
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest
from folders import DATA
from sequences import awkward, held, partly_still, waving

import gvpipe
from gvpipe.coding.codec import GroupReader, LevelReader
from gvpipe.coding.registry import codec_class, encode_sequence, open_reader
from gvpipe.coding.repeated_frames import RepeatedFrames, find_repeated_frames, read_repeated_frames
from gvpipe.foundation.errors import CorruptFile
from gvpipe.model.sequence import MeshSequence
from gvpipe.testing import Subject
from gvpipe.testing.promises import coincident_vertices, held_frames, still_vertices
from gvpipe.trajectory.still_vertices import find_still

AWKWARD = awkward()
MORPH_WAVE = DATA / "morph_wave.npz"
PLAIN: list[tuple[str, dict[str, Any]]] = [
    ("pca", {}),
    ("pca", {"predictor": "lsp", "segment": 7}),
    ("pca", {"predictor": "rbf"}),
    ("laplacian", {}),
    ("laplacian", {"operator": "tutte", "delta_prediction": "none", "anchor_choice": "walk", "segment": 7}),
    ("pdct", {}),
    ("pdct", {"clusters": 3, "segment": 7}),
]
PICTURES: list[tuple[str, dict[str, Any]]] = [
    ("mcgv", {"placement": "tiles"}),
    ("mcgv", {"prediction": "affine"}),
]
MORE_PICTURES: list[tuple[str, dict[str, Any]]] = [  # in the slow run
    ("mcgv", {"placement": "charts", "image": "jpeg"}),
    ("mcgv", {"placement": "tiles", "profile": "precise"}),
    ("mcgv", {"prediction": "blended", "transform": "klt"}),
]
SLOW_PICTURES = [pytest.param(*each, marks=pytest.mark.slow) for each in MORE_PICTURES]


def with_each(name: str, values: tuple[Any, Any]) -> pytest.MarkDecorator:
    """All codecs, in several profiles, each with one of two values; with the other one in the slow run."""
    n_quick = len(PLAIN + PICTURES)
    cases = [
        pytest.param(codec, settings, value, marks=[] if i % 2 == j and i < n_quick else pytest.mark.slow)
        for (i, (codec, settings)), (j, value) in product(enumerate(PLAIN + PICTURES + MORE_PICTURES), enumerate(values))
    ]
    return pytest.mark.parametrize(("codec", "settings", name), cases, ids=str)


def encode(sequence: MeshSequence, folder: Path, codec: str, settings: dict[str, Any], **more: Any) -> gvpipe.Player:
    gvpipe.encode(sequence, folder / "a.mp4", codec, **settings, **more)
    return gvpipe.open(folder / "a.mp4")


@with_each("bound", (None, "0.2%"))
def test_still_vertices_stand_still(codec: str, settings: dict[str, Any], bound: str | None, tmp_path: Path) -> None:
    assert 70 < find_still(partly_still()).sum() < 90
    still_vertices(Subject(codec_class(codec)(**settings), tmp_path), bound)


@with_each("bound", (None, "0.2%"))
def test_coincident_vertices_coincide(codec: str, settings: dict[str, Any], bound: str | None, tmp_path: Path) -> None:
    coincident_vertices(Subject(codec_class(codec)(**settings), tmp_path), bound)


@with_each("bound", (None, "0.2%"))
def test_repeated_frames_are_identical(codec: str, settings: dict[str, Any], bound: str | None, tmp_path: Path) -> None:
    held_frames(Subject(codec_class(codec)(**settings), tmp_path), bound)


@with_each("target", ({"target_rmse": 1e-3}, {"max_error": "0.1%"}))
def test_repeated_frames_cost_nearly_nothing(
    codec: str, settings: dict[str, Any], target: dict[str, Any], tmp_path: Path
) -> None:
    few = waving(9, 12)
    once, twice = (gvpipe.encode(held(few, [n] * 12), tmp_path / f"{n}.mp4", codec, **settings, **target).bytes for n in (1, 2))
    assert twice < once + 100


@pytest.mark.parametrize(("codec", "settings"), [*PLAIN[:3], PLAIN[-1]])
def test_still_vertices_save_bytes(codec: str, settings: dict[str, Any]) -> None:
    sequence = partly_still()
    frames = np.asarray(sequence.positions[:]).copy()
    frames[1::2] += np.float32(1e-5)  # nothing stands still, and nothing else is new
    size = [
        sum(map(len, codec_class(codec)(**settings).encode(MeshSequence(f, sequence.faces)).bitstream.sections.values()))
        for f in (np.asarray(sequence.positions[:]), frames)
    ]
    assert size[0] < size[1]


@pytest.mark.parametrize(
    ("name", "few"), [("far from the origin", "one stands"), *product(AWKWARD, ["one moves", "half stand"])]
)
@pytest.mark.parametrize(("codec", "settings"), [("pca", {}), ("laplacian", {}), ("pdct", {"clusters": 3})])
def test_awkward_inputs(codec: str, settings: dict[str, Any], name: str, few: str, tmp_path: Path) -> None:
    frames = np.asarray(AWKWARD[name].positions[:]).copy()
    stands = np.arange(frames.shape[1]) % 2 == 0 if few == "half stand" else np.arange(frames.shape[1]) == 2
    stands = ~stands if few == "one moves" else stands
    frames[:, stands] = frames[-1, stands]
    sequence = MeshSequence(frames, AWKWARD[name].faces)
    still = find_still(sequence)
    decoded = encode(sequence, tmp_path, codec, settings, quality=90)[:]
    assert (decoded[:, still] == decoded[:1, still]).all()
    extent = float(np.ptp(frames.astype(np.float64), axis=(0, 1)).max())
    assert np.abs(decoded.astype(np.float64) - frames).max() <= 0.02 * extent + 1e-6 * np.abs(frames).max()


@pytest.mark.slow
@pytest.mark.parametrize(("codec", "settings"), [*PICTURES, *SLOW_PICTURES])
def test_pictures_are_of_distinct_frames(codec: str, settings: dict[str, Any], tmp_path: Path) -> None:
    """The video lacks repeated frames, and corrections, segments and groups of pictures are of distinct ones."""
    lengths = [2, 1, 7, 1, 1, 3, 1, 1, 4]
    sequence = held(waving(9, len(lengths)), lengths)
    every = {"segment": 4, **({"gop": 3} if settings.get("image") != "jpeg" else {})}
    video = encode(sequence, tmp_path, codec, {**settings, **every}, max_error="0.2%")
    sections = {name: data for name, data in video.bitstream.sections.items() if name != "holds"}
    few = dataclasses.replace(video.bitstream, n_frames=len(lengths), sections=sections)
    distinct = open_reader(few)
    assert np.array_equal(video[:], np.repeat(distinct.read(0, len(lengths)), lengths, axis=0))
    assert gvpipe.info(tmp_path / "a.mp4").frames == len(video) == sum(lengths)
    with av.open(tmp_path / "a.mp4") as mp4:
        n_pictures = sum(1 for _ in mp4.decode(video=0))
    assert settings.get("transform") == "klt" or n_pictures == len(lengths)
    if isinstance(distinct, GroupReader):
        starts = [0, *np.cumsum(lengths).tolist()]
        reader = open_reader(video.bitstream)
        assert isinstance(reader, GroupReader)
        for d in range(len(lengths)):
            start, stop = distinct.group(d)
            assert reader.group(starts[d]) == reader.group(starts[d + 1] - 1) == (starts[start], starts[stop])


def test_mcgv_without_repeated_frames_is_as_without_holds() -> None:
    codec, sequence = codec_class("mcgv")(preset="fast"), partly_still()
    assert encode_sequence(codec, sequence).bitstream == codec.encode(sequence).bitstream


@pytest.mark.parametrize(("codec", "settings"), PLAIN)
def test_files_without_stillness_have_no_sections_of_it(codec: str, settings: dict[str, Any]) -> None:
    bitstream = encode_sequence(codec_class(codec)(**settings), waving(7, 9)).bitstream
    assert not {"still", "holds"} & set(bitstream.sections)


@pytest.mark.parametrize(("codec", "settings"), [*PLAIN, *PICTURES, *SLOW_PICTURES])
def test_nothing_moves_at_all(codec: str, settings: dict[str, Any], tmp_path: Path) -> None:
    """One distinct frame; and, where a codec is asked directly, nothing but still vertices."""
    sequence = held(waving(9, 1), [15])
    video = encode(sequence, tmp_path, codec, settings)
    assert len(video) == 15
    assert (video[:] == video[0]).all()
    bitstream = codec_class(codec)(**settings).encode(sequence).bitstream
    frames = open_reader(bitstream).read(2, 13)
    assert (frames == frames[0]).all()
    assert np.abs(frames - sequence.positions[:1]).max() < 0.01


def test_still_vertices_have_one_position_on_all_levels_and_segments() -> None:
    sequence = partly_still()
    encoded = codec_class("pca")(segment=7).encode(sequence)
    reader = open_reader(encoded.bitstream)
    assert isinstance(reader, LevelReader)
    finest = reader.read(0, 20)
    placed = {row.tobytes() for row in finest[0, find_still(sequence)[encoded.permutation]]}
    for lod in range(1, len(reader.levels)):
        frames = reader.read(0, 20, lod=lod)
        is_still = (frames == frames[:1]).all(axis=(0, 2))
        assert is_still.any()
        assert {row.tobytes() for row in frames[19, is_still]} <= placed


def test_levels_and_groups_of_held_frames() -> None:
    lengths = [1, 4, 1, 2, 3, 1]
    sequence = held(waving(9, 6), lengths)
    reader = open_reader(encode_sequence(codec_class("pca")(), sequence).bitstream)
    assert isinstance(reader, LevelReader)
    coarse = reader.read(0, 12, lod=1)
    assert coarse.shape == (12, reader.levels[1], 3)
    assert (coarse[1] == coarse[4]).all()
    assert reader.read(5, 5).shape == (0, 81, 3)
    clips = open_reader(encode_sequence(codec_class("pdct")(segment=2), sequence).bitstream)
    assert isinstance(clips, GroupReader)
    assert [clips.group(frame) for frame in (0, 4, 5, 7, 8, 11)] == [(0, 5), (0, 5), (5, 8), (5, 8), (8, 12), (8, 12)]


def test_holds_across_chunks_and_lazily(monkeypatch: pytest.MonkeyPatch) -> None:
    lengths = [2, 1, 5, 1, 3]
    sequence = held(waving(4, 5), lengths)
    monkeypatch.setattr("gvpipe.model.sequence.CHUNK_BYTES", 12 * 16 * 2)
    holds = find_repeated_frames(sequence)
    assert holds is not None
    assert holds.lengths.tolist() == lengths
    assert np.array_equal(holds.distinct(sequence).read(1, 4), sequence.positions[:][[2, 3, 8]])
    assert find_repeated_frames(waving(4, 5)) is None


@pytest.mark.parametrize("lengths", [[5, 0, 5], [3, 4], [12, -2], [1] * 11, [1 << 38, 5]])
def test_wrong_holds_are_refused(lengths: list[int]) -> None:
    from gvpipe.coding.repeated_frames import add_repeated_frames

    bitstream = codec_class("pca")().encode(waving(4, 10)).bitstream
    wrong = add_repeated_frames(bitstream, RepeatedFrames(np.array(lengths)))
    with pytest.raises(CorruptFile, match="holds"):
        read_repeated_frames(type(bitstream)(**{**vars(wrong), "n_frames": 10}))


@pytest.mark.parametrize("codec", ["pca", "laplacian", "pdct", "mcgv"])
def test_damaged_sections_raise_format_errors_only(codec: str) -> None:
    from gvpipe.foundation.errors import FormatError

    bitstream = encode_sequence(codec_class(codec)(), held(partly_still(), [2, *[1] * 19])).bitstream
    assert {"still", "holds"} <= set(bitstream.sections)
    rng = np.random.default_rng(4)
    for name in ("still", "holds"):
        section = bitstream.sections[name]
        for trial in range(60):
            changed = bytearray(section)
            changed[rng.integers(len(section)) if trial else 0] ^= 1 << rng.integers(8)
            data = bytes(changed[: rng.integers(1, len(changed) + 1)]) if trial % 2 else bytes(changed)
            try:
                frames = open_reader(dataclasses.replace(bitstream, sections={**bitstream.sections, name: data})).read(0, 21)
            except FormatError:
                continue
            assert frames.shape == (21, bitstream.n_vertices, 3)


@pytest.mark.skipif(not MORPH_WAVE.exists(), reason="no ../shared/data")
def test_morph_wave(tmp_path: Path) -> None:
    """Half of its vertices never move."""
    sequence = gvpipe.read(MORPH_WAVE)
    still = find_still(sequence)
    assert still.sum() == 776
    for codec in ("pca", "laplacian", "pdct"):
        gvpipe.encode(sequence, tmp_path / "m.mp4", codec)
        frames = gvpipe.open(tmp_path / "m.mp4")[:]
        assert (frames[:, still] == frames[:1, still]).all(), codec
