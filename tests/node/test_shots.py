"""Captures in the player in Node: each frame of each shot is Python's, bit for bit; damage is one clear line in both."""

from __future__ import annotations

import json
import shutil
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from changing import SIZES, SPANS, sheet
from file_server import serving
from sequences import waving

import gvpipe
from gvpipe.container.bitstream import CHECKSUM, VERSION
from gvpipe.container.boxes import uuid_head
from gvpipe.container.cursor import pack_block
from gvpipe.container.mp4 import read_index
from gvpipe.container.shot_layout import MAGIC
from gvpipe.container.stream_layout import SHOTS_UUID
from gvpipe.foundation.errors import FormatError
from gvpipe.model.sequence import MeshSequence

pytestmark = pytest.mark.skipif(shutil.which("node") is None, reason="no node")
Ask = Callable[..., Any]
PICTURE = b"\x89PNG\r\n\x1a\n" + np.random.default_rng(0).bytes(4000)


def sheets() -> gvpipe.Capture:
    """Six frames in three shots, which share a picture and have origins of their own."""
    shots = []
    for number, (start, stop) in enumerate(SPANS):
        points = np.stack([sheet(SIZES[frame], frame)[0] for frame in range(start, stop)])
        faces = sheet(SIZES[start], start)[1]
        images = (gvpipe.Image("noise", "image/png", PICTURE),)
        shots.append(MeshSequence(points, faces, 25.0, images=images, origin=np.array([0, 1000.25 * number, 0])))
    return gvpipe.Capture(shots, "sheets")


def rough(side: int, frames: int) -> MeshSequence:
    """Noise, which takes many bytes."""
    sequence = waving(side, frames)
    noise = np.random.default_rng(side).normal(0, 0.2, (frames, sequence.n_vertices, 3))
    return MeshSequence((sequence.read(0, frames) + noise).astype(np.float32), sequence.faces, 25.0)


@pytest.fixture(scope="module")
def video(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("capture") / "sheets.mp4"
    gvpipe.encode(sheets(), path, max_error="0.01%")
    return path


@pytest.fixture(scope="module")
def long(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A short shot, which is bare, and one in the stream layout that takes more than a first request."""
    path = tmp_path_factory.mktemp("capture") / "long.mp4"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("gvpipe.captures.encoding.STREAMED_FRAMES", 10)
        capture = gvpipe.Capture([rough(8, 4), rough(32, 80), rough(8, 2)], "rough")
        gvpipe.encode(capture, path, "pca", stream=True, segment=10, quality=95)
    with gvpipe.open_capture(path) as found:
        assert [shot.bitstream.layout for shot in found.shots] == ["bare", "stream", "bare"]
        assert found.shot_bytes[1] > 1 << 17
    return path


def check(answer: dict[str, Any], path: Path, frames: list[int]) -> None:
    """Frames are Python's, in the coordinates of the first shot."""
    with gvpipe.open_capture(path) as found:
        assert [row["start"] for row in answer["shots"]] == list(found.starts)
        assert [row["frames"] for row in answer["shots"]] == list(found.lengths)
        assert answer["duration"] == len(found) / found.fps
        first = found.shots[0].sequence().origin
        for k, given in zip(frames, answer["found"], strict=True):
            number, own = found.capture().locate(k)
            shot = found.shots[number].sequence()
            assert (given["shot"], given["own"]) == (number, own)
            assert np.array_equal(np.array(given["indices"]).reshape(-1, 3), shot.faces)
            wanted = (found[k] + (shot.origin - first)).astype(np.float32)
            positions = np.array(given["positions"], np.float32).reshape(-1, 3)
            assert np.array_equal(positions, wanted), f"frame {k}"
            low, high = (np.float32(answer["bounds"][side]) for side in ("min", "max"))
            assert (positions >= low).all() and (positions <= high).all()


def test_frames_of_all_shots(node: Ask, video: Path) -> None:
    order = [5, 0, 3, 2, 4, 1, 5]
    answer = node("shots", path=str(video), frames=order)
    check(answer, video, order)
    assert answer["images"] == [len(PICTURE)] and answer["bounds"]["max"][1] > 2000
    assert node("frame", k=6) == ("RangeError", "frame 6: there are 6")
    assert node("level", level=1) == ("unsupported", "level 1: there are levels 0..0")


@pytest.mark.parametrize("codec", ["laplacian", "pdct"])
def test_other_codecs(node: Ask, tmp_path: Path, codec: str) -> None:
    gvpipe.encode(gvpipe.Capture([waving(8, 6), waving(6, 5)], "two"), tmp_path / "a.mp4", codec)
    check(node("shots", path=str(tmp_path / "a.mp4"), frames=[7, 0]), tmp_path / "a.mp4", [7, 0])


@pytest.mark.parametrize("ranges", [True, False])
def test_shots_come_by_ranges(node: Ask, long: Path, ranges: bool) -> None:
    order = [85, 50, 2]
    with serving(long.read_bytes()) as (url, served):
        served.ranges = ranges
        answer = node("shots", url=url, frames=order)
        sent = served.n_sent
    check(answer, long, order)
    size = long.stat().st_size
    assert sent < 0.9 * size if ranges else sent == size


def test_frames_play_in_a_row(node: Ask, video: Path) -> None:
    node("shots", path=str(video), frames=[0])
    assert node("start") is True
    shown = node("shown", count=6)
    assert sorted(set(shown["frames"])) == list(range(6)) and shown["ended"] <= 1


def test_few_shots_stay_open(node: Ask) -> None:
    """Of large shots eight; those used longest ago are closed, and their frames let go of."""
    order = [*range(0, 40, 2), 1, 39]
    found = node("row", shots=20, vertices=100_000, together=2, frames=order)
    assert found["seen"] == [[k // 2, k % 2, 0] for k in order]
    assert found["opened"] == [*range(20), 0] and found["closed"][:12] == list(range(12))
    assert found["kept"] <= 2 * 8
    found = node("row", shots=20, vertices=1000, together=2, frames=order)
    assert found["opened"] == list(range(20)) and not set(found["closed"][:-20])


def test_shots_are_opened_ahead(node: Ask) -> None:
    """While it plays: in order, few at once, and again behind the last."""
    found = node("row", shots=20, vertices=100_000, together=2, frames=[0], plays=60)
    steps = np.diff(found["seen"][1:]) % 40
    assert steps.min() >= 1 and steps.max() <= 3 and found["most"] <= 2
    assert found["opened"][:20] == list(range(20)) and found["opened"][20:24] == [0, 1, 2, 3]
    assert len(found["closed"]) >= len(found["opened"]) - 1


def changed(path: Path, change: Callable[[dict[str, Any]], None], target: Path) -> Path:
    """The same file with another index, whose checksum is right."""
    data, index = path.read_bytes(), read_index(path)
    assert index is not None
    at = len(index.head)
    stop = at + int.from_bytes(data[at : at + 4], "big")
    length, begin = 0, at + 24 + len(MAGIC) + 2
    while data[begin] >= 128:
        length, begin = length + 1, begin + 1
    header = json.loads(zlib.decompress(data[begin + 1 : stop - 12]))
    change(header)
    packed = MAGIC + VERSION.to_bytes(2, "little") + pack_block(zlib.compress(json.dumps(header).encode()))
    packed += data[stop - 12 : stop - 4]
    packed += CHECKSUM.pack(zlib.crc32(packed))
    target.write_bytes(data[:at] + uuid_head(SHOTS_UUID, len(packed)) + packed + data[stop:])
    return target


def _set(path: str, value: Any) -> Callable[[dict[str, Any]], None]:
    """A change of one value, by the keys that lead to it."""

    def change(header: dict[str, Any]) -> None:
        *keys, last = (int(key) if key.isdigit() else key for key in path.split("."))
        for key in keys:
            header = header[key]  # type: ignore[index]
        header[last] = value  # type: ignore[index]

    return change


WRONG = {
    "frames": _set("shots.frames.1", 3),
    "vertices": _set("shots.vertices.0", 26),
    "triangles": _set("shots.triangles.2", 1),
    "rate": _set("fps", 24.0),
    "no shots": _set("shots.frames", []),
    "no frames": _set("shots.frames.1", 0),
    "a list too short": _set("shots.bytes", [1, 2]),
    "a huge shot": _set("shots.bytes.0", 1 << 50),
    "a long poster": _set("poster", 1 << 20),
    "another id": _set("id", "0" * 32),
    "companions": _set("companions", [{}] * 9),
    "a hash": _set("shared", {"x" * 32: 10}),
    "shared bytes": lambda header: header["shared"].update({next(iter(header["shared"])): 1}),
    "no shared sections": _set("shared", {}),
    "a box": _set("box", [1, 0, 0, 0, 0, 0]),
    "a text": _set("box", "wide"),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_index_is_refused(node: Ask, video: Path, tmp_path: Path, name: str) -> None:
    path = changed(video, WRONG[name], tmp_path / "bad.mp4")
    kind, message = node("shots", path=str(path), frames=list(range(6)))
    assert kind in ("corrupt", "truncated", "unsupported") and "\n" not in message
    with pytest.raises(FormatError), gvpipe.open_capture(path) as found:
        for k in range(6):
            found.frame(k)


def test_damage_is_refused(node: Ask, video: Path, tmp_path: Path) -> None:
    data, path, index = video.read_bytes(), tmp_path / "bad.mp4", read_index(video)
    assert index is not None
    at_shared = next(iter(index.shared.values()))[0]
    places = [len(index.head) - 3, len(index.head) + 60, at_shared + 5, index.offsets[1] + 200, index.offsets[2] + 70]
    damaged = [data[:at] + bytes([data[at] ^ 255]) + data[at + 1 :] for at in places]
    for each in (*damaged, data[:-1], data[: len(data) // 2], data + b"stray"):
        path.write_bytes(each)
        kind, message = node("shots", path=str(path), frames=list(range(6)))
        assert kind in ("corrupt", "truncated", "not-geometry-video") and "\n" not in message, message


def test_a_bare_file_alone_is_refused_as_before(node: Ask, tmp_path: Path) -> None:
    gvpipe.encode(waving(5, 3), tmp_path / "a.mp4", "pca", bare=True)
    assert node("join", path=str(tmp_path / "a.mp4"))[0] == "unsupported"
