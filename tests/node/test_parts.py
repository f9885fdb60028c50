"""Files without pictures that come in parts, and levels of detail that change: the player in Node, a server beside it."""

from __future__ import annotations

import dataclasses
import io
import re
import shutil
import time
from collections.abc import Callable, Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest
from file_server import CHUNK, Served, serving
from folders import SAMPLES
from long_files import write_long
from sequences import waving

import gvpipe
from gvpipe.container.mp4 import read_file
from gvpipe.container.stream_layout import StoredSections
from gvpipe.media.sound import Sound, pack_track

pytestmark = pytest.mark.skipif(shutil.which("node") is None, reason="no node")
VERTICES = [8000, 6000, 4000, 3000, 2000, 1000, 500]
Ask = Callable[..., Any]


@pytest.fixture(scope="module")
def long(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A `pca` file of ten segments that walk away; what all share exceeds the first request."""
    return write_long(tmp_path_factory.mktemp("long") / "long.mp4", 10)


@pytest.fixture
def site(long: Path) -> Iterator[tuple[str, Served]]:
    with serving(long.read_bytes()) as (url, served):
        yield url, served


def segments_sent(path: Path, served: Served) -> list[int]:
    """Numbers of the segments whose bytes were sent, in order, behind what all share."""
    sections = read_file(path).sections
    assert isinstance(sections, StoredSections)
    places = sections._places
    found = []
    for start, length in served.sent:
        own = {int(name.split(".")[1]) for name, place in places.items() if place.offset == start and name.startswith("basis.")}
        for s in own:
            assert length == places[f"basis.{s}"].length + places[f"coefficients.{s}"].length
            found.append(s)
    return found


def check(answer: Any, wanted: np.ndarray) -> None:
    assert np.array_equal(np.array(answer["positions"], np.float32).reshape(-1, 3), wanted)


def test_segments_are_fetched_when_they_are_shown(node: Ask, long: Path, site: tuple[str, Served]) -> None:
    url, served = site
    with gvpipe.open(long) as video:
        loaded = node("load", url=url, level=0)
        assert loaded["counts"] == [len(video), video.shape[1], len(video.faces)] and loaded["levels"] == video.levels
        assert segments_sent(long, served) == [0]
        for k in (100, 3, 50):
            check(node("frame", k=k), video[k])
        assert segments_sent(long, served) == [0, 8, 4]
        assert served.n_sent < long.stat().st_size
        n_sent = len(served.sent)
        for k in range(51, 55):  # frames in a row: the next segment comes before it is shown
            check(node("frame", k=k), video[k])
        check(node("frame", k=55), video[55])
        for _ in range(500):  # it is asked for beside, so that the server may be behind the frame
            if len(served.sent) > n_sent:
                break
            time.sleep(0.02)
        assert segments_sent(long, served) == [0, 8, 4, 5]


def test_bounds_grow_with_what_is_read(node: Ask, long: Path, site: tuple[str, Served]) -> None:
    with gvpipe.open(long) as video:
        node("load", url=site[0], level=0)
        near, far = (node("frame", k=k)["bounds"] for k in (0, len(video) - 1))
        last = video[len(video) - 1]
    assert near["max"][0] < last[:, 0].max()
    assert (np.float32(far["min"]) <= last).all() and (last <= np.float32(far["max"])).all()
    assert far["min"][0] == near["min"][0]


def test_a_server_without_range_sends_the_whole_file(node: Ask, long: Path, site: tuple[str, Served]) -> None:
    url, served = site
    served.ranges = False
    node("load", url=url, level=0)
    with gvpipe.open(long) as video:
        check(node("frame", k=70), video[70])
    assert len(served.sent) == 1


def test_without_range_a_file_plays_as_it_comes(node: Ask, long: Path, site: tuple[str, Served]) -> None:
    url, served = site
    served.ranges = False
    served.held = len(served.data) - CHUNK // 2  # the last segments
    with gvpipe.open(long) as video:
        node("load", url=url, level=0)
        check(node("frame", k=10), video[10])
        assert not served.go.is_set()
        served.go.set()
        check(node("frame", k=115), video[115])
    assert len(served.sent) == 1


def test_a_whole_file_that_ends_early_is_one_error(node: Ask, long: Path, site: tuple[str, Served]) -> None:
    url, served = site
    served.ranges = False
    for most, has_length, words in ((20_000, True, "cannot be fetched"), (110_000, False, "bytes came")):
        served.cut, served.has_length = most, has_length
        found = node("load", url=url, level=0)
        kind, message = found if isinstance(found, tuple) else node("frame", k=115)
        assert kind == "load" and words in message and "\n" not in message


@pytest.mark.parametrize(
    ("change", "kind", "words"),
    [
        ({"status": 404}, "load", "status 404"),
        ({"status": 416}, "load", "status 416"),
        ({"ranges": False}, "load", "status 200"),
        ({"data": b"x" * 1_000_000}, "corrupt", "has another file by now; load the page again"),
        ({"data": b"x" * 10}, "load", "status 416"),
        ({"cut": 10}, "load", "cannot be fetched"),
    ],
)
def test_what_goes_wrong_later_is_one_error(
    change: dict[str, Any], kind: str, words: str, node: Ask, long: Path, site: tuple[str, Served]
) -> None:
    url, served = site
    node("load", url=url, level=0)
    before = dataclasses.replace(served)
    for name, value in change.items():
        setattr(served, name, value)
    found, message = node("frame", k=115)
    assert found == kind and re.search(words, message) and "\n" not in message, (found, message)
    for name in change:
        setattr(served, name, getattr(before, name))
    with gvpipe.open(long) as video:
        check(node("frame", k=3), video[3])  # what was fetched stays
        if kind == "load":
            check(node("frame", k=115), video[115])


def test_segments_that_were_not_asked_for_lately_are_dropped(node: Ask, long: Path, site: tuple[str, Served]) -> None:
    url, served = site
    names = [f"coefficients.{s}" for s in (0, 1, 2, 3, 0)]
    sizes = read_file(long).section_sizes
    most = 2 * max(sizes[f"basis.{s}"] + sizes[f"coefficients.{s}"] for s in range(10))
    kept = node("keep", url=url, names=names, most=most)
    assert {name for name in kept if "." in name and not name.startswith("attribute")} == {
        "basis.3", "coefficients.3", "basis.0", "coefficients.0",
    }  # fmt: skip
    assert segments_sent(long, served) == [0, 1, 2, 3, 0]


def test_levels_change_at_any_time(node: Ask, long: Path, site: tuple[str, Served]) -> None:
    with gvpipe.open(long) as video:
        loaded = node("load", url=site[0], level="coarsest")
        coarsest = len(video.levels) - 1
        assert loaded["level"] == coarsest and loaded["counts"][1] == video.levels[-1]
        check(node("frame", k=20), video.level(coarsest).read(20, 21)[0])
        assert node("level", level=0) == [0, video.shape[1], len(video.faces), 3 * len(video.faces)]
        check(node("frame", k=20), video[20])
        check(node("frame", k=21), video[21])
        assert node("level", level="coarsest")[:2] == [coarsest, video.levels[-1]]
        check(node("frame", k=21), video.level(coarsest).read(21, 22)[0])
        kind, message = node("level", level=9)
        assert (kind, message) == ("unsupported", f"level 9: there are levels 0..{coarsest}")


def test_what_plays_goes_on_at_another_level(node: Ask, long: Path, site: tuple[str, Served]) -> None:
    loaded = node("load", url=site[0], level="coarsest")
    shown = node("play", count=40, after=5, level=0)
    counts = [count for _, count in shown]
    assert set(counts[:5]) == {loaded["levels"][-1]} and counts[-1] == loaded["levels"][0]
    assert counts == sorted(counts)  # one change
    steps = np.diff([k for k, _ in shown])
    assert ((steps >= 0) & (steps <= 3)).all()  # it goes on where it was


def test_a_level_is_left_when_frames_are_late(node: Ask) -> None:
    def levels(*steps: tuple[float, bool, int], due: float = 40) -> list[int]:
        found: list[int] = node("choose", vertices=VERTICES, due=due, steps=steps)
        return found

    late, good = (40, False, 30), (16, True, 400)
    assert levels(good) == [0]
    assert levels((40, True, 101), (80, True, 13)) == [0, 2]  # steps that come late: at most half of the vertices
    assert levels(late, late, late, late, late) == [2, 4, 5, 6, 6]  # frames that are not there
    assert levels((2000, False, 100)) == [0]  # the page was hidden
    assert levels((30, False, 1), (30, True, 9), (30, True, 300)) == [0, 0, 0]  # once in a while
    assert levels((90, True, 30), due=100) == [0]  # few frames per second are in time


def test_a_finer_level_is_tried_again_and_later_each_time(node: Ask) -> None:
    late, five = (40, False, 26), (40, True, 125)  # 1 s, 5 s
    steps = [late, five, late, five, five, late, five, five, five, five]
    found = node("choose", vertices=VERTICES, due=40, steps=steps)
    assert found == [2, 0, 2, 2, 0, 2, 2, 2, 2, 0]  # after 4 s, then 8 s, then 16 s
    held = node("choose", vertices=VERTICES, due=40, steps=[late, five, five, late, five])
    assert held == [2, 0, 0, 2, 0]  # a level that has held is left and tried as at first


def test_the_element_and_the_mesh_choose_while_they_play(node: Ask) -> None:
    steps = [(40, False, 60), (100, True, 60), (100, False, 60), (40, False, 400)]
    assert node("follow", vertices=VERTICES, steps=steps)[:2] == [0, 0]  # waiting for the file is no reason
    found = node("follow", vertices=VERTICES, steps=steps)
    assert found[2] > 2 and found[3] < found[2]


def test_a_long_sound_is_not_fetched(node: Ask, tmp_path: Path) -> None:
    """Its tables exceed the first request; its samples are the browser's affair, and come late."""
    path, sequence = tmp_path / "a.mp4", waving(6, 24)
    tone = gvpipe.read_sound(SAMPLES / "voice.wav", "opus")
    with av.open(io.BytesIO(tone.data), "r") as container:
        stream = container.streams.audio[0]
        packets = [bytes(packet) for packet in container.demux(stream) if packet.size]

        def repeated() -> Iterator[av.Packet[Any]]:
            for number in range(20_000):
                packet = av.Packet(packets[1 + number % (len(packets) - 1)])
                packet.pts, packet.duration, packet.time_base = 960 * number, 960, Fraction(1, 48_000)
                yield packet

        sound = Sound.of(pack_track(stream, repeated()))
    gvpipe.encode(sequence, path, "pdct", segment=12, stream=True, audio=sound)
    assert path.stat().st_size > sound.n_bytes > 1_000_000
    with serving(path.read_bytes()) as (url, served):
        for served.ranges in (True, False):
            before = served.n_sent
            assert node("load", url=url, level=0)["counts"][0] == 24
            check(node("frame", k=20), gvpipe.open(path)[20])
            assert not served.ranges or served.n_sent - before < 300_000
