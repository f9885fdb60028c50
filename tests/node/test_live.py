"""Files that are still written: pages follow them as they grow; the player in Node, a server beside it."""

from __future__ import annotations

import re
import shutil
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from file_server import Served, serving
from sequences import waving

import gvpipe
from fuzz.live import join_live, split_live
from fuzz.videos import FILE
from gvpipe.container.live_layout import ROW_BYTES

Ask = Callable[..., Any]
pytestmark = pytest.mark.skipif(shutil.which("node") is None, reason="no node")
CLIP, N_FRAMES = 4, 18
SEQUENCE = waving(8, N_FRAMES)


@pytest.fixture(scope="module")
def states(tmp_path_factory: pytest.TempPathFactory) -> list[bytes]:
    """A file with no clip, one, two ..., and finished."""
    path, found = tmp_path_factory.mktemp("live") / "a.mp4", []
    with gvpipe.open_live(path, SEQUENCE.faces, SEQUENCE.fps, segment=CLIP) as live:
        for k, frame in enumerate(SEQUENCE.read(0, N_FRAMES)):
            live.append(frame)
            if k == 0 or live.n_frames == live.n_written:
                found.append(path.read_bytes())
    return [*found, path.read_bytes()]


@pytest.fixture(scope="module")
def frames(states: list[bytes], tmp_path_factory: pytest.TempPathFactory) -> np.ndarray:
    path = tmp_path_factory.mktemp("frames") / "a.mp4"
    path.write_bytes(states[-1])
    with gvpipe.open(path) as video:
        return video[:]


@pytest.fixture
def server(states: list[bytes]) -> Iterator[tuple[str, Served]]:
    with serving(states[1]) as (url, served):
        yield url, served


def check(answer: Any, wanted: np.ndarray) -> None:
    assert np.array_equal(np.array(answer["positions"], np.float32).reshape(-1, 3), wanted)


def test_frames_come_as_the_file_grows(node: Ask, server: tuple[str, Served], states: list[bytes], frames: np.ndarray) -> None:
    url, served = server
    assert node("join", url=url) == [CLIP, True, 0, "Infinity", None]
    check(node("frame", k=3), frames[3])
    served.data = states[2]
    assert node("grown", frames=8) == [8, True, 0, "Infinity", None]
    check(node("frame", k=7), frames[7])
    served.data = states[-1]  # two clips and the end
    assert node("grown", frames=N_FRAMES) == [N_FRAMES, False, 0, "0.75", None]
    for k in (17, 0, 12):
        check(node("frame", k=k), frames[k])
    asked = len(served.sent)
    time.sleep(0.3)
    assert len(served.sent) == asked  # nobody looks any more


def test_who_comes_late_gets_the_latest_clip_first(
    node: Ask, server: tuple[str, Served], states: list[bytes], frames: np.ndarray
) -> None:
    url, served = server
    served.data = states[4]
    assert node("join", url=url)[:3] == [16, True, 12]
    check(node("frame", k=13), frames[13])
    latest = len(states[3])
    assert [start for start, _ in served.sent if start > len(states[0])] == [latest + 24]
    served.data = states[-1]
    node("grown", frames=N_FRAMES)
    check(node("frame", k=0), frames[0])


def test_a_page_may_be_there_before_the_first_clip(node: Ask, server: tuple[str, Served], states: list[bytes]) -> None:
    url, served = server
    served.data = states[0]
    timer = threading.Timer(0.3, lambda: setattr(served, "data", states[1]))
    timer.start()
    assert node("join", url=url)[:2] == [CLIP, True]
    timer.join()


@pytest.mark.slow
def test_what_plays_waits_for_frames_and_ends_with_the_file(node: Ask, server: tuple[str, Served], states: list[bytes]) -> None:
    url, served = server
    node("join", url=url)
    node("start")
    assert node("shown", count=CLIP)["frames"] == [0, 1, 2, 3]
    asked = len(served.sent)
    found = node("shown", count=CLIP + 1, seconds=1)
    assert found == {"frames": [0, 1, 2, 3], "waits": [True], "ended": 0}
    assert 1 <= len(served.sent) - asked <= 12  # looks, never faster than every 100 ms
    served.data = states[4]
    assert node("shown", count=2 * CLIP)["frames"][CLIP:] == [12, 13, 14, 15]  # what is further behind is left out
    served.data = states[-1]
    found = node("shown", count=2 * CLIP + 3, seconds=1.5)
    assert found["frames"][2 * CLIP :] == [16, 17] and found["ended"] == 1
    assert found["waits"][0] and not found["waits"][-1]


@pytest.mark.parametrize(
    ("change", "kind", "words"),
    [
        ({"status": 404}, "load", "status 404"),
        ({"data": b"x" * 1000}, "load", "status 416"),
        ({"data": bytes(1_000_000)}, "corrupt", "has another file by now; load the page again"),
        ({"ranges": False}, "load", "status 200"),
    ],
)
def test_a_file_that_is_lost_is_one_error(
    change: dict[str, Any], kind: str, words: str, node: Ask, server: tuple[str, Served], frames: np.ndarray
) -> None:
    url, served = server
    node("join", url=url)
    for name, value in change.items():
        setattr(served, name, value)
    found = node("grown", frames=N_FRAMES)
    assert found[0] == CLIP and found[4][0] == kind and re.search(words, found[4][1]) and "\n" not in found[4][1]
    check(node("frame", k=2), frames[2])  # what is there plays on


def test_a_short_trouble_is_none(node: Ask, server: tuple[str, Served], states: list[bytes]) -> None:
    url, served = server
    node("join", url=url)
    served.status = 503
    node("grown", frames=N_FRAMES, seconds=0.25)
    served.status, served.data = 0, states[2]
    assert node("grown", frames=8) == [8, True, 0, "Infinity", None]


def test_servers_without_range_and_damaged_tables(node: Ask, server: tuple[str, Served], states: list[bytes]) -> None:
    url, served = server
    served.ranges = False
    assert node("join", url=url) == (
        "load",
        f"{url} is still written, and its server knows no Range; try again when it is finished",
    )
    served.ranges = True
    for at, kind in ((len(states[0]) // 2, "truncated"), (100, "not-geometry-video")):
        served.data = states[1][:at]
        assert node("join", url=url)[0] in (kind, "load", "truncated")


def test_bytes_of_an_unfinished_file(node: Ask, states: list[bytes], frames: np.ndarray, tmp_path: Path) -> None:
    path = tmp_path / "a.mp4"
    path.write_bytes(states[3] + b"part of a clip")
    assert node("join", path=str(path)) == [12, False, 0, "0.5", None], node("join", path=str(path))
    check(node("frame", k=11), frames[11])
    path.write_bytes(states[0])
    assert node("join", path=str(path))[0] == "truncated"
    parts = split_live(states[3])
    path.write_bytes(join_live({**parts, "header": parts["header"].replace(b"pdct", b"mcgv")})[FILE])
    assert node("join", path=str(path)) == (
        "corrupt",
        "section 'header' is corrupt: files of its codec do not grow; get the file again from its source",
    )
    data = bytearray(states[3])
    data[-ROW_BYTES] ^= 1
    path.write_bytes(data)
    assert node("join", path=str(path))[0] == "corrupt"
