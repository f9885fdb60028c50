"""Files that are written while their frames come: they open at any moment, and end as ordinary files."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from clips import coded_stream
from file_server import serving
from sequences import waving

import gvpipe
from fuzz.live import join_live, split_live
from fuzz.videos import FILE
from gvcodecs.pdct import StreamReader
from gvcodecs.pdct.encoder import ClipCoder
from gvpipe.asset_coding.directory import UNFINISHED
from gvpipe.cli.commands import cli
from gvpipe.coding.registry import open_reader
from gvpipe.container import mp4
from gvpipe.container.bitstream import HEADER
from gvpipe.container.live_writer import LiveWriter
from gvpipe.container.stream_layout import INDEX_UUID, ROOM_UUID
from gvpipe.foundation.errors import CorruptFile, FormatError, InputError, OutputError, SettingError, TruncatedFile

CLIP, N_FRAMES = 4, 11
SEQUENCE = waving(6, N_FRAMES)


@pytest.fixture(scope="module")
def states(tmp_path_factory: pytest.TempPathFactory) -> list[bytes]:
    """A file as it is after each frame, and finished."""
    path, found = tmp_path_factory.mktemp("live") / "a.mp4", []
    with gvpipe.open_live(path, SEQUENCE.faces, SEQUENCE.fps, segment=CLIP) as live:
        for frame in SEQUENCE.read(0, N_FRAMES):
            live.append(frame)
            found.append(path.read_bytes())
        assert (live.n_frames, live.n_written) == (N_FRAMES, N_FRAMES // CLIP * CLIP)
    return [*found, path.read_bytes()]


@pytest.fixture(scope="module")
def streamed() -> np.ndarray:
    """The frames as they are in a stream of pdct, which codes the same clips."""
    return np.stack(list(StreamReader().feed(coded_stream(SEQUENCE, segment=CLIP))))


def test_loops_may_write_every_frame_into_one_array(tmp_path: Path) -> None:
    sheet = waving(4, 6)
    frame = np.zeros((16, 3), np.float32)
    with gvpipe.open_live(tmp_path / "a.mp4", sheet.faces) as live:
        for positions in sheet:
            frame[:] = positions
            live.append(frame)
    assert gvpipe.compare(sheet, gvpipe.open(tmp_path / "a.mp4")).max_diag == pytest.approx(0, abs=0.01)


def test_it_opens_up_to_its_last_whole_clip(states: list[bytes], streamed: np.ndarray, tmp_path: Path) -> None:
    path = tmp_path / "a.mp4"
    for count, state in enumerate(states[:-1], 1):
        path.write_bytes(state)
        if count < CLIP:
            with pytest.raises(TruncatedFile, match="no clip is in it yet"):
                gvpipe.open(path)
            continue
        with gvpipe.open(path) as video:
            assert len(video) == count // CLIP * CLIP
            assert np.array_equal(video[:], streamed[: len(video)])
            assert len(video.faces) == len(SEQUENCE.faces)
            assert video.bitstream.layout == "live" and "not finished" in video.notes[0]
    found = gvpipe.info(path)
    assert found.layout == "live" and "not finished" in found.notes[0] and sum(found.sections.values()) == found.bytes


def test_a_finished_file_is_an_ordinary_one(states: list[bytes], streamed: np.ndarray, tmp_path: Path) -> None:
    path = tmp_path / "a.mp4"
    path.write_bytes(states[-1])
    with gvpipe.open(path) as video:
        assert (video.bitstream.layout, video.bitstream.version, video.notes) == ("stream", 1, ())
        assert np.array_equal(video[:], streamed)
    assert gvpipe.info(path).sections["video"] > 0
    assert gvpipe.restream(path, tmp_path / "b.mp4").layout == "plain"
    assert gvpipe.restream(tmp_path / "b.mp4", tmp_path / "c.mp4").bytes < path.stat().st_size
    for other in ("b.mp4", "c.mp4"):
        assert np.array_equal(gvpipe.decode(tmp_path / other).read(0, N_FRAMES), streamed)


def test_nothing_that_was_written_moves(states: list[bytes]) -> None:
    first, last = states[CLIP - 1], states[-1]
    live = first.index(ROOM_UUID.bytes)
    assert last[: live + 16] == last[:live] + INDEX_UUID.bytes
    at = last.index(b"mdat")  # of the poster; clips follow
    assert last[at : len(first)] == first[at:]


def test_one_that_was_left_becomes_an_ordinary_file(states: list[bytes], streamed: np.ndarray, tmp_path: Path) -> None:
    (tmp_path / "a.mp4").write_bytes(states[-2] + b"part of a clip")
    for layout in ("stream", "plain"):
        assert gvpipe.restream(tmp_path / "a.mp4", tmp_path / "b.mp4", layout).layout == layout
        with gvpipe.open(tmp_path / "b.mp4") as video:
            assert np.array_equal(video[:], streamed[: N_FRAMES // CLIP * CLIP]) and not video.notes


def test_every_half_write_leaves_a_file_that_opens(
    streamed: np.ndarray, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever of the writes is missing, the file opens: as it was before, or with one clip more, or finished."""
    path, write, states = tmp_path / "a.mp4", LiveWriter._write, list[bytes]()

    def torn(self: LiveWriter, offset: int, data: bytes) -> None:
        for part in (data[: len(data) // 3], data[:-1], data):
            write(self, offset, part)
            states.append(path.read_bytes())

    monkeypatch.setattr(LiveWriter, "_write", torn)
    with gvpipe.open_live(path, SEQUENCE.faces, segment=CLIP) as live:
        for frame in SEQUENCE.read(0, N_FRAMES):
            live.append(frame)
    found = []
    for state in states[5:]:  # from the first clip on
        path.write_bytes(state)
        with gvpipe.open(path) as video:
            found.append((len(video), video.bitstream.layout))
            assert np.array_equal(video[:], streamed[: len(video)])
        if found[-1] == (N_FRAMES, "live"):
            assert gvpipe.restream(path, tmp_path / "b.mp4").layout == "stream"
    assert found == sorted(found)
    assert list(dict.fromkeys(found)) == [(4, "live"), (8, "live"), (11, "live"), (11, "stream")]


def test_cut_and_damaged_files_have_one_error(states: list[bytes], streamed: np.ndarray, tmp_path: Path) -> None:
    rng, path = np.random.default_rng(3), tmp_path / "a.mp4"
    for state in (states[-2], states[-1]):
        for at in rng.integers(0, len(state), 25).tolist() + rng.integers(len(state) - 13_000, len(state), 25).tolist():
            for data in (state[:at], state[:at] + bytes([state[at] ^ 4]) + state[at + 1 :]):
                path.write_bytes(data)
                try:
                    found = gvpipe.decode(path).read(0, 1)
                except FormatError as exc:
                    assert str(exc).startswith(str(path)) and "\n" not in str(exc)
                else:
                    assert np.array_equal(found, streamed[:1])


def test_a_reader_goes_on_while_the_file_grows(tmp_path: Path, streamed: np.ndarray) -> None:
    path = tmp_path / "a.mp4"
    live = gvpipe.open_live(path, SEQUENCE.faces, SEQUENCE.fps, segment=CLIP)
    frames = SEQUENCE.read(0, N_FRAMES)
    for frame in frames[: 2 * CLIP]:
        live.append(frame)
    with gvpipe.open(path) as video:
        for frame in frames[2 * CLIP :]:
            live.append(frame)
        assert np.array_equal(video[1], streamed[1])
        live.close()
        video.close()
        assert np.array_equal(video[CLIP], streamed[CLIP])
        path.write_bytes(path.read_bytes()[:1000])
        video.close()
        with pytest.raises(FormatError, match="has changed"):
            video[2]


def test_over_http(states: list[bytes], streamed: np.ndarray) -> None:
    with serving(states[-2]) as (url, served), gvpipe.open(url) as video:
        served.data, served.etag = states[-1], '"2"'
        assert np.array_equal(video[:], streamed[: len(video)]) and len(video) == 8
        served.data = served.data[:1000]
        video.close()


def test_what_cannot_be_appended(tmp_path: Path) -> None:
    path = tmp_path / "a.mp4"
    live = gvpipe.open_live(path, SEQUENCE.faces, segment=2)
    frame = SEQUENCE.read(0, 1)[0]
    for wrong in (frame[:4], np.zeros(3), np.full_like(frame, np.nan)):
        with pytest.raises(InputError, match="the frames: |frame 0 has"):
            live.append(wrong)
    assert not path.exists()
    live.append(frame)
    for wrong in (frame[:4], np.full_like(frame, np.inf), frame.astype(complex)):
        with pytest.raises(InputError, match="frame 1"):
            live.append(wrong)
    live.append(frame + np.float64(1))
    live.close()
    live.close()
    assert len(gvpipe.open(path)) == 2
    with pytest.raises(InputError, match="is finished"):
        live.append(frame)


def test_files_of_other_codecs_do_not_grow(states: list[bytes], tmp_path: Path) -> None:
    parts, path = split_live(states[-2]), tmp_path / "a.mp4"
    for codec in ("mcgv", "pca"):
        changed = {**json.loads(parts["header"]), "codec": codec, "version": 1}
        path.write_bytes(join_live({**parts, "header": json.dumps(changed).encode()})[FILE])
        with pytest.raises(CorruptFile, match=f"files of codec '{codec}' do not grow"):
            gvpipe.open(path)


def test_what_cannot_be_started(tmp_path: Path) -> None:
    with pytest.raises(SettingError, match="pdct codes them as they come"):
        gvpipe.open_live(tmp_path / "a.mp4", SEQUENCE.faces, codec="pca")
    with pytest.raises(SettingError, match="no setting"):
        gvpipe.open_live(tmp_path / "a.mp4", SEQUENCE.faces, clib=3)
    with pytest.raises(InputError, match=r"end its name in \.mp4"):
        gvpipe.open_live(tmp_path / "a.obj", SEQUENCE.faces)
    with pytest.raises(OutputError, match="no folder"):
        gvpipe.open_live(tmp_path / "none" / "a.mp4", SEQUENCE.faces)
    with gvpipe.open_live(tmp_path / "a.mp4", SEQUENCE.faces):
        pass
    assert not (tmp_path / "a.mp4").exists()


def test_clips_last_a_second_and_the_file_is_finished_whatever_happens(tmp_path: Path) -> None:
    path = tmp_path / "a.mp4"
    live = gvpipe.open_live(path, SEQUENCE.faces, fps=24)
    assert live.clip_frames == 24
    with pytest.raises(ZeroDivisionError), live:
        live.append(SEQUENCE.read(0, 1)[0])
        raise ZeroDivisionError
    assert len(gvpipe.open(path)) == 1


def test_an_older_file_stays(tmp_path: Path) -> None:
    """A capture that fails or is killed would have destroyed it; and two captures of one name are one too many."""
    path = tmp_path / "a.mp4"
    path.write_bytes(b"older")
    with pytest.raises(InputError, match=r"a\.mp4 is there already.*give a new name, or remove it"):
        gvpipe.open_live(path, SEQUENCE.faces)
    assert path.read_bytes() == b"older"
    path.unlink()
    first, second = (gvpipe.open_live(path, SEQUENCE.faces) for _ in range(2))
    first.append(SEQUENCE.read(0, 1)[0])
    with pytest.raises(InputError, match="is there already"):
        second.append(SEQUENCE.read(0, 1)[0])
    second.close()
    first.close()
    assert len(gvpipe.open(path)) == 1


@pytest.mark.parametrize("fps", [0, -3, float("nan"), float("inf"), True, "30", None])
def test_frame_rates_that_are_none(fps: Any, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"fps is .*; a positive number is needed"):
        gvpipe.open_live(tmp_path / "a.mp4", SEQUENCE.faces, fps)
    assert gvpipe.open_live(tmp_path / "a.mp4", SEQUENCE.faces, 1e9).clip_frames == 100_000


def test_positions_far_from_the_origin(tmp_path: Path) -> None:
    path, far = tmp_path / "a.mp4", np.array([4e6, 0.0, 0.0])
    with gvpipe.open_live(path, SEQUENCE.faces, segment=3) as live:
        for frame in SEQUENCE.read(0, 3):
            live.append(frame.astype(np.float64) + far)
    with gvpipe.open(path) as video:
        assert np.abs(video[1] + video.origin - SEQUENCE.read(1, 2)[0] - far).max() < 1e-2


def test_a_file_that_is_full(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ClipCoder, "most_clips", 2)
    with gvpipe.open_live(tmp_path / "a.mp4", SEQUENCE.faces, segment=1) as live:
        for frame in SEQUENCE.read(0, 2):
            live.append(frame)
        with pytest.raises(InputError, match="is full: 2 clips"):
            live.append(frame)
    assert len(gvpipe.open(tmp_path / "a.mp4")) == 2


def test_a_header_of_another_clip_length_is_refused(states: list[bytes], tmp_path: Path) -> None:
    (tmp_path / "a.mp4").write_bytes(states[-1])
    bitstream = mp4.read_file(tmp_path / "a.mp4")
    assert HEADER not in bitstream.sections
    for clip in (0, 100_001, 3):
        changed = type(bitstream)(**{**vars(bitstream), "header": {**bitstream.header, "clip": clip}})
        with pytest.raises(CorruptFile):
            open_reader(changed).read(0, N_FRAMES)


def test_a_clip_that_cannot_be_coded_is_left_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    live = gvpipe.open_live(tmp_path / "a.mp4", SEQUENCE.faces, segment=2)
    frames = SEQUENCE.read(0, N_FRAMES)
    for frame in frames[:3]:
        live.append(frame)
    with monkeypatch.context() as patch, pytest.raises(InputError, match="far from frame 0"):
        patch.setattr(ClipCoder, "encode", lambda *_: (_ for _ in ()).throw(InputError("far from frame 0")))
        live.append(frames[3])
    live.append(frames[4])
    live.close()
    assert len(gvpipe.open(tmp_path / "a.mp4")) == 3


@pytest.mark.parametrize("lod", [(), ("--lod", "0")])
def test_decoding_an_unfinished_file_says_so(lod: tuple[str, ...], states: list[bytes], tmp_path: Path) -> None:
    (tmp_path / "a.mp4").write_bytes(states[CLIP])
    words = ["decode", str(tmp_path / "a.mp4"), str(tmp_path / "a.npz"), "--json", *lod]
    assert json.loads(CliRunner().invoke(cli, words).stdout)["notes"] == [UNFINISHED]
