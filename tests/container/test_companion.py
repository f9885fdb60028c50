"""Companion tracks: in every layout, apart from the geometry, and never its ruin."""

from __future__ import annotations

import io
from dataclasses import replace
from functools import cache
from pathlib import Path

import av
import numpy as np
import pytest
from folders import GOLDEN

from gvpipe.coding.registry import open_reader, segment_parts
from gvpipe.container import mp4
from gvpipe.container.bitstream import Bitstream
from gvpipe.container.companion import MOST, Companion
from gvpipe.container.mp4 import BOX_UUID
from gvpipe.container.stream_layout import INDEX_UUID
from gvpipe.container.track_boxes import boxes_in, shifted, tracks_of
from gvpipe.foundation.errors import CorruptFile, FormatError, InputError

LAYOUTS = ("plain", "stream", "bare")
FILES = ("pca-1-kalman", "mcgv-1-h264")
RATE = 48_000


def click(at: float, seconds: float = 1.0) -> bytes:
    """An MP4 file of one AAC track that is silent but for one sample, at a time in seconds."""
    samples = np.zeros((1, int(seconds * RATE)), np.float32)
    samples[0, int(at * RATE)] = 1
    file = io.BytesIO()
    with av.open(file, "w", format="mp4", options={"fflags": "+bitexact"}) as container:
        stream = container.add_stream("aac", rate=RATE, layout="mono")
        frame = av.AudioFrame.from_ndarray(samples, format="fltp", layout="mono")
        frame.sample_rate, frame.pts = RATE, 0
        for part in av.AudioResampler("fltp", "mono", RATE, 1024).resample(frame):
            container.mux(stream.encode(part))
        container.mux(stream.encode(None))
    return file.getvalue()


def loudest(file: bytes | Path) -> float:
    """When the first sound track of a file is loudest, seconds."""
    with av.open(io.BytesIO(file) if isinstance(file, bytes) else str(file), "r") as container:
        frames = [frame.to_ndarray()[0] for frame in container.decode(audio=0)]
    return float(np.abs(np.concatenate(frames)).argmax()) / RATE


@cache
def sound(at: float = 0.5) -> Companion:
    return Companion.of("sound", {"codec": "aac"}, click(at))


def written(name: str, layout: str, path: Path, *companions: Companion) -> Bitstream:
    """A golden file with companions; returns what was written."""
    bitstream = replace(mp4.read_file(GOLDEN / f"{name}.mp4"), companions=companions, is_bare=layout == "bare")
    if layout == "bare" and not name.startswith("mcgv"):
        bitstream = replace(bitstream, video=b"")
    mp4.write_file(bitstream, path, parts=segment_parts(bitstream) if layout == "stream" else None)
    return bitstream


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("name", FILES)
def test_every_layout_gives_companions_back(name: str, layout: str, tmp_path: Path) -> None:
    path = tmp_path / "a.mp4"
    before = written(name, layout, path, sound(), sound(0.25))
    found = mp4.read_file(path)
    assert found.layout == layout and found.lost == ()
    assert found.companions == before.companions
    assert [loudest(each.file()) for each in found.companions] == [0.5, 0.25]
    assert loudest(path) == 0.5  # an ordinary player plays the first
    parts = mp4.bytes_by_part(found, path.stat().st_size)
    assert parts["sound"] == sum(each.n_bytes for each in before.companions) and sum(parts.values()) == path.stat().st_size
    assert np.array_equal(open_reader(found).read(0, 5), open_reader(before).read(0, 5))
    assert mp4.load(found).companions == before.companions


@pytest.mark.parametrize("layout", LAYOUTS)
def test_files_without_companions_are_as_they_were(layout: str, tmp_path: Path) -> None:
    path, again = tmp_path / "a.mp4", tmp_path / "b.mp4"
    written("mcgv-1-h264", layout, path)
    written("mcgv-1-h264", layout, again, sound())
    for _ in range(2):  # a companion comes, and goes without a trace
        bitstream = replace(mp4.load(mp4.read_file(again)), companions=())
        mp4.write_file(bitstream, again, parts=segment_parts(bitstream) if layout == "stream" else None)
        assert again.read_bytes() == path.read_bytes()
    assert b"companions" not in path.read_bytes()


@pytest.mark.parametrize(("name", "layout"), [("mcgv-1-h264", "plain"), ("mcgv-1-h264", "stream"), ("pca-1-kalman", "bare")])
def test_damage_costs_the_companion_alone(name: str, layout: str, tmp_path: Path) -> None:
    path = tmp_path / "a.mp4"
    written(name, layout, path, sound())
    data = path.read_bytes()
    whole = open_reader(mp4.read_file(path)).read(0, 5)
    moov = next(box for box in boxes_in(data, 0, data.index(b"moov") + 4096) if box.kind == b"moov")
    track = tracks_of(moov.of(data))[-1]
    tables = range(moov.start + track.content, moov.start + track.stop, 37)
    samples = data.index(mp4.read_file(path).companions[0].data())
    for place in (*tables, samples, samples + 100):
        path.write_bytes(data[:place] + bytes([data[place] ^ 4]) + data[place + 1 :])
        found = mp4.load(mp4.read_file(path))
        assert found.companions == () and len(found.lost) == 1
        assert "sound is damaged, or was re-encoded, and is left out" in found.lost[0]
        if place >= samples:
            assert np.array_equal(open_reader(found).read(0, 5), whole)


@pytest.mark.parametrize("layout", LAYOUTS)
def test_tracks_that_the_header_does_not_describe_are_refused(layout: str, tmp_path: Path) -> None:
    path, more = tmp_path / "a.mp4", tmp_path / "b.mp4"
    written("mcgv-1-h264", layout, path)
    written("mcgv-1-h264", layout, more, sound())
    front = INDEX_UUID.bytes if layout == "stream" else BOX_UUID.bytes
    data = more.read_bytes()[: more.read_bytes().index(front) - 8] + path.read_bytes()[path.read_bytes().index(front) - 8 :]
    more.write_bytes(data)
    with pytest.raises(FormatError):
        mp4.read_file(more)


def test_a_companion_that_is_gone_is_missed(tmp_path: Path) -> None:
    path = tmp_path / "a.mp4"
    written("mcgv-1-h264", "plain", path, sound())
    data = path.read_bytes()
    at = data.index(b"soun")
    start = data.rindex(b"trak", 0, at)
    size = int.from_bytes(data[start - 4 : start], "big")
    path.write_bytes(data[:start] + b"free".ljust(size - 4, b"\0") + data[start + size - 4 :])
    found = mp4.read_file(path)
    assert found.companions == () and "sound is no longer in the file" in found.lost[0]


def test_the_number_of_companions_is_limited(tmp_path: Path) -> None:
    path = tmp_path / "a.mp4"
    written("mcgv-1-h264", "plain", path, *[sound()] * (MOST + 1))
    with pytest.raises(CorruptFile, match="a list of at most 4"):
        mp4.read_file(path)


def test_what_is_no_track_is_refused() -> None:
    file = click(0.5)
    with pytest.raises(CorruptFile, match="no 'moov' or no 'mdat' box"):
        Companion.of("sound", {}, file[: file.index(b"moov") - 4])
    with pytest.raises(CorruptFile, match="cut short|impossible size|lies outside|2 are needed|does not hold"):
        Companion.of("sound", {}, file.replace(b"stco", b"stsz"))
    [moov] = [box.of(file) for box in boxes_in(file, 0, len(file)) if box.kind == b"moov"]
    trak = tracks_of(moov)[0].of(moov)
    with pytest.raises(CorruptFile, match="lies outside of it"):
        shifted(trak, -1000)
    for cut in range(8, len(trak), 31):
        with pytest.raises(CorruptFile):
            shifted(trak[:cut], 0)


def test_tables_cannot_name_places_behind_four_gibibytes(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("gvpipe.container.companion.LARGEST_PLACE", 2000)
    with pytest.raises(InputError, match="cannot hold a sound; leave it out"):
        written("mcgv-1-h264", "plain", tmp_path / "a.mp4", sound())
    assert not list(tmp_path.iterdir())
