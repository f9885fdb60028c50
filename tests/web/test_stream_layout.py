"""Files in the stream layout in a browser: positions are Python's, and damage is one clear error."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import browsers
import numpy as np
import pytest
from file_server import serving
from pages import FRAMES, check_frames, flipped, points
from sequences import held, rigid, waving

import gvpipe

pytestmark = [pytest.mark.skipif(bool(browsers.missing()), reason=browsers.missing()), pytest.mark.slow]
VARIANTS: dict[str, dict[str, Any]] = {
    "segments": {"gop": 16, "segment": 20},
    "whole": {"gop": 8, "prediction": "affine"},
    "jpeg": {"image": "jpeg", "prediction": "affine"},
    "precise": {"profile": "precise", "gop": 8, "prediction": "affine"},
}
LOAD = """const outcomes = [];
for (const name of args[0]) {
  outcomes.push(await GeometryVideo.load(name).then((video) => (video.close(), ["loaded", ""]),
    (error) => (error instanceof GeometryVideoError ? [error.kind, error.message] : ["other", String(error.stack)])));
}
return outcomes;"""


BUFFERED = "return window.video.buffered"
JUMP = """const video = await GeometryVideo.load(args[0]);
window.video = video;
return [...(await video.frame(args[1]))];"""
AGAIN = """return window.video.frame(args[0]).then((frame) => ["loaded", [...frame]],
  (error) => [error instanceof GeometryVideoError ? error.kind : "other", String(error.message)]);"""


@pytest.fixture(scope="module")
def long(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file of ten segments, too large for the first request."""
    path = tmp_path_factory.mktemp("long") / "long.mp4"
    settings: dict[str, Any] = {"preset": "ultrafast", "gop": 16, "segment": 20, "clusters": 2, "quality": 80}
    gvpipe.encode(waving(40, 200), path, stream=True, **settings)
    assert path.stat().st_size > 3 << 16
    return path


def test_parts_are_fetched_when_they_are_asked_for(module: Callable[..., Any], long: Path) -> None:
    with gvpipe.open(long) as video, serving(long.read_bytes()) as (url, served):
        found = module(JUMP, url, 170)
        assert np.array_equal(np.array(found, np.float32).reshape(-1, 3), video[170])
        assert served.n_sent < len(served.data) / 2
        first, last = module(BUFFERED)
        assert first[0] == 0 and first[1] < 1.5 and last[0] <= 170 / video.fps < last[1] < len(video) / video.fps + 1e-6
        visited = [199, 16, 40, 0, 100]
        result = module(FRAMES, url, visited)
        for k, text in zip(visited, result["frames"], strict=True):
            assert np.array_equal(points(text), video[k]), f"frame {k}"
        assert result["byteLength"] == long.stat().st_size


def test_a_server_without_range_sends_the_whole_file(module: Callable[..., Any], long: Path) -> None:
    with gvpipe.open(long) as video, serving(long.read_bytes()) as (url, served):
        served.ranges = False
        found = module(JUMP, url, 170)
        assert np.array_equal(np.array(found, np.float32).reshape(-1, 3), video[170])
        assert len(served.sent) == 1


def test_the_plain_layout_is_fetched_once(module: Callable[..., Any], long: Path, tmp_path: Path) -> None:
    gvpipe.restream(long, tmp_path / "plain.mp4")
    small = tmp_path / "small.mp4"
    gvpipe.encode(waving(6, 40), small, preset="ultrafast", gop=16, segment=20, stream=True)
    for path, answers in ((tmp_path / "plain.mp4", 2), (small, 1)):
        with gvpipe.open(path) as video, serving(path.read_bytes()) as (url, served):
            found = module(JUMP, url, 30)
            assert np.array_equal(np.array(found, np.float32).reshape(-1, 3), video[30])
            assert served.n_sent == len(served.data) and len(served.sent) == answers


@pytest.mark.parametrize(
    ("change", "kind", "words"),
    [
        ({"status": 404}, "load", "status 404"),
        ({"status": 416}, "load", "status 416"),
        ({"ranges": False}, "load", "status 200"),
        ({"data": b"x" * 1_000_000}, "corrupt", "damaged|checksum"),
        ({"data": b"x" * 10}, "load", "status 416"),
        ({"cut": 10}, "load", "cannot be fetched"),
    ],
)
def test_what_goes_wrong_later_is_one_error(
    change: dict[str, object], kind: str, words: str, module: Callable[..., Any], long: Path
) -> None:
    with gvpipe.open(long) as video, serving(long.read_bytes()) as (url, served):
        module(JUMP, url, 0)
        before = dataclasses.replace(served)
        for name, value in change.items():
            setattr(served, name, value)
        found, message = module(AGAIN, 190)
        assert found == kind and re.search(words, message) and "\n" not in message, (found, message)
        for name in change:
            setattr(served, name, getattr(before, name))
        found, frame = module(AGAIN, 190)
        if kind == "corrupt":  # stays so
            assert found == kind
            return
        assert found == "loaded" and np.array_equal(np.array(frame, np.float32).reshape(-1, 3), video[190])


def test_motion_without_pictures_comes_in_parts(module: Callable[..., Any], tmp_path: Path) -> None:
    path = tmp_path / "a.mp4"
    noise = np.random.default_rng(1).random((2 * 40 * 40, 8), np.float32)  # so that it exceeds the first request
    sequence = dataclasses.replace(rigid(40, 120), attributes={"noise": noise})
    gvpipe.encode(sequence, path, stream=True, segment=10, quality=95, attributes={"noise": "exact"})
    with gvpipe.open(path) as video, serving(path.read_bytes()) as (url, served):
        assert video.bitstream.header["pictures"] is False
        found = module(JUMP, url, 115)
        assert np.array_equal(np.array(found, np.float32).reshape(-1, 3), video[115])
        assert len(served.sent) <= 4  # the start, perhaps what all share, and two segments
        served.status = 404
        assert module(AGAIN, 60)[0] == "load"
        served.status = 0
        assert module(AGAIN, 60)[0] == "loaded"


def test_trajectory_images_come_in_parts(module: Callable[..., Any], tmp_path: Path) -> None:
    path = tmp_path / "images.mp4"
    gvpipe.encode(waving(90, 200), path, preset="ultrafast", stream=True, transform="klt", segment=20, quality=98)
    assert path.stat().st_size > 2 << 16
    with gvpipe.open(path) as video, serving(path.read_bytes()) as (url, served):
        found = module(JUMP, url, 170)
        assert np.array_equal(np.array(found, np.float32).reshape(-1, 3), video[170])
        assert served.n_sent < len(served.data)


@pytest.mark.parametrize("variant", VARIANTS)
def test_frames_equal_pythons(variant: str, module: Callable[..., Any], site: tuple[Path, str]) -> None:
    path = site[0] / "stream.mp4"
    gvpipe.encode(waving(9, 70), path, preset="ultrafast", stream=True, **VARIANTS[variant])
    check_frames(module, path)


def test_repeated_frames_equal_pythons(module: Callable[..., Any], site: tuple[Path, str]) -> None:
    path = site[0] / "held.mp4"
    gvpipe.encode(held(waving(9, 24), [1, 2] * 12), path, preset="ultrafast", gop=8, stream=True)
    check_frames(module, path)


def test_the_video_element_plays_fragments(module: Callable[..., Any], site: tuple[Path, str]) -> None:
    path = site[0] / "element.mp4"
    gvpipe.encode(waving(9, 70), path, preset="ultrafast", stream=True, **VARIANTS["segments"])
    body = """delete window.VideoDecoder;
    const video = await GeometryVideo.load(args[0]);
    const frames = [];
    for (const k of args[1]) frames.push([...(await video.frame(k))]);
    return frames;"""
    visited = [50, 3, 69, 0]
    with gvpipe.open(path) as video:
        for k, found in zip(visited, module(body, path.name, visited), strict=True):
            assert np.array_equal(np.array(found, np.float32).reshape(-1, 3), video[k]), f"frame {k}"


def test_damage_is_one_clear_error(module: Callable[..., Any], site: tuple[Path, str]) -> None:
    path = site[0] / "sound.mp4"
    gvpipe.encode(waving(6, 40), path, preset="ultrafast", gop=16, stream=True)
    data = path.read_bytes()
    index = data.index(b"gvpipe\r\n")
    damaged = {
        "short.mp4": ("truncated", data[:-1]),
        "long.mp4": ("corrupt", data + bytes(16)),
        "magic.mp4": ("corrupt", flipped(data, index)),
        "table.mp4": ("corrupt", flipped(data, index + 20)),
        "configuration.mp4": ("corrupt", flipped(data, data.index(b"avcC") + 8)),
        "picture.mp4": ("corrupt", flipped(data, data.index(b"mdat") + 30)),
        "run.mp4": ("corrupt", flipped(data, data.index(b"trun") + 10)),
        "newer.mp4": ("newer", data.replace(b"gvpipe 1 ", b"gvpipe 9 ")),
        "stripped.mp4": ("stripped", data.replace(data[index - 16 : index], bytes(16))),
    }
    for name, (_, content) in damaged.items():
        (site[0] / name).write_bytes(content)
    outcomes = module(LOAD, list(damaged))
    for (name, (kind, _)), (found, message) in zip(damaged.items(), outcomes, strict=True):
        assert found == kind, (name, found, message)
        assert "\n" not in message


FIELD = """const values = await window.video.fields.get(args[0]).frame(args[1]);
return [...values];"""
TRY_FIELD = f"return (async () => {{ {FIELD} }})().then(() => 'loaded', (error) => error.kind);"


def test_a_field_is_fetched_when_it_is_shown(module: Callable[..., Any], tmp_path: Path) -> None:
    """It comes on its own; what fails is tried again; derived ones follow from positions that are fetched meanwhile."""
    path = tmp_path / "a.mp4"
    noise = np.random.default_rng(1).random((120, 400), np.float32)
    sequence = waving(20, 120)
    speed = np.linalg.norm(sequence.read(0, 120), axis=2)
    sequence = dataclasses.replace(sequence, fields={"noise": noise, "speed": speed})
    settings: dict[str, Any] = {"preset": "ultrafast", "gop": 16, "segment": 20, "clusters": 2, "quality": 80}
    gvpipe.encode(sequence, path, stream=True, fields={"noise": "exact", "speed": 0.01}, **settings)
    with gvpipe.open(path) as video, serving(path.read_bytes()) as (url, served):
        found = module(JUMP, url, 70)
        assert np.array_equal(np.array(found, np.float32).reshape(-1, 3), video[70])
        before = served.n_sent
        assert before < path.stat().st_size / 2  # noise is most of the file
        served.status = 404
        assert module(TRY_FIELD, "noise", 3) == "load"
        served.status = 0
        for name, k in (("noise", 3), ("speed", 119), ("noise", 90)):
            values = np.array(module(FIELD, name, k), np.float32)
            assert np.array_equal(values, video.fields[name].read(k, k + 1)[0].reshape(-1)), (name, k)
        assert served.n_sent > before + len(noise.tobytes()) / 2
        served.data = served.data[: -len(noise.tobytes()) // 4] + bytes(len(noise.tobytes()) // 4)
        module(JUMP, url, 0)
        assert module(TRY_FIELD, "noise", 3) == "corrupt" or module(TRY_FIELD, "speed", 3) == "corrupt"
