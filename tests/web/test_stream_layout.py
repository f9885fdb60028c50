"""Files in the stream layout in a browser: positions are Python's, and damage is one clear error."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import browsers
import numpy as np
import pytest
from pages import check_frames, flipped
from sequences import held, waving

import gvpipe

pytestmark = [pytest.mark.skipif(bool(browsers.missing()), reason=browsers.missing()), pytest.mark.slow]
VARIANTS: dict[str, dict[str, Any]] = {
    "segments": {"gop": 16, "segment": 20},
    "whole": {"gop": 8, "prediction": "affine"},
}
LOAD = """const outcomes = [];
for (const name of args[0]) {
  outcomes.push(await GeometryVideo.load(name).then((video) => (video.close(), ["loaded", ""]),
    (error) => (error instanceof GeometryVideoError ? [error.kind, error.message] : ["other", String(error.stack)])));
}
return outcomes;"""


@pytest.mark.parametrize("variant", ["segments", "whole"])
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
        "newer.mp4": ("newer", data.replace(b"gvpipe 2 ", b"gvpipe 9 ")),
        "stripped.mp4": ("stripped", data.replace(data[index - 16 : index], bytes(16))),
    }
    for name, (_, content) in damaged.items():
        (site[0] / name).write_bytes(content)
    outcomes = module(LOAD, list(damaged))
    for (name, (kind, _)), (found, message) in zip(damaged.items(), outcomes, strict=True):
        assert found == kind, (name, found, message)
        assert "\n" not in message
