"""Geometry videos on a web server: what is asked for is fetched, and all that a server does wrong is one line."""

from __future__ import annotations

import contextlib
import pickle
import socket
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from file_server import Served, serving
from sequences import waving

import gvpipe
from gvpipe.container import http_request, http_source
from gvpipe.container.http_source import HttpSource
from gvpipe.foundation.errors import CorruptFile, GvpipeError, InputError, NotGeometryVideo, TruncatedFile

BLOCK = 256


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A sequence of eight segments in both layouts."""
    folder = tmp_path_factory.mktemp("files")
    gvpipe.encode(waving(10, 80), folder / "plain.mp4", "pdct", segment=10)
    gvpipe.restream(folder / "plain.mp4", folder / "stream.mp4")
    return folder / "plain.mp4", folder / "stream.mp4"


@pytest.fixture
def server(files: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[str, Served]]:
    """The stream layout on a server, fetched in small blocks."""
    monkeypatch.setattr(http_source, "BLOCK", BLOCK)
    with serving(files[1].read_bytes()) as running:
        yield running


def test_a_jump_fetches_the_index_and_one_segment(server: tuple[str, Served], files: tuple[Path, Path]) -> None:
    url, served = server
    wanted = gvpipe.decode(files[0])
    with gvpipe.open(url) as video:
        sizes = video.bitstream.section_sizes
        shared = video.bitstream.sections._places["clip.0"].offset  # type: ignore[attr-defined]
        assert served.n_sent <= shared + 2 * BLOCK
        before = served.n_sent
        assert np.array_equal(video[75], wanted.read(75, 76)[0])
        assert served.n_sent - before <= sizes["clip.7"] + 2 * BLOCK
        assert served.n_sent < len(served.data) / 2
        before = served.n_sent
        video[76]
        assert served.n_sent == before  # kept
        assert np.array_equal(video[:], wanted.read(0, 80))
        assert served.n_sent <= len(served.data) + 20 * BLOCK


def test_blocks_that_were_not_used_are_dropped(server: tuple[str, Served], monkeypatch: pytest.MonkeyPatch) -> None:
    url, served = server
    monkeypatch.setattr(http_source, "KEPT_BLOCKS", 3)
    source = HttpSource(url)
    for at in (0, 2000, 4000, 6000, 0):
        assert source.read(at, 10) == served.data[at : at + 10]
    assert [start for start, _ in served.sent] == [0, 1792, 3840, 5888, 0]
    assert source.read(100, 0) == b""
    assert source.read(300, 1000) == served.data[300:1300]
    assert len(source._blocks) == 3


@pytest.mark.parametrize("layout", [0, 1])
def test_servers_without_range_are_read_as_it_comes(layout: int, files: tuple[Path, Path]) -> None:
    wanted = gvpipe.decode(files[0]).read(0, 80)
    with serving(files[layout].read_bytes()) as (url, served):
        served.ranges = False
        with gvpipe.open(url) as video:
            assert np.array_equal(video[3], wanted[3])
            assert np.array_equal(video[75], wanted[75])
            assert np.array_equal(video[3], wanted[3])
            assert len(served.sent) == 1


def test_the_plain_layout_is_fetched_whole(files: tuple[Path, Path]) -> None:
    with serving(files[0].read_bytes()) as (url, served):
        assert np.array_equal(gvpipe.decode(url, 5, 7).read(0, 2), gvpipe.decode(files[0], 5, 7).read(0, 2))
        assert served.n_sent <= 2 * len(served.data)
        assert gvpipe.info(url).bytes == len(served.data)
        assert gvpipe.read(f"{url}?token=1").n_frames == 80


def test_another_process_opens_the_address_again(server: tuple[str, Served]) -> None:
    url, _ = server
    with gvpipe.open(url) as video:
        again = pickle.loads(pickle.dumps(video))
        assert again.path == url and np.array_equal(again[70], video[70])


def message(url: str) -> str:
    with pytest.raises(GvpipeError) as raised:
        gvpipe.open(url)
    text = str(raised.value)
    assert text.count(url) == 1 and "\n" not in text
    return text


@pytest.mark.parametrize(("status", "words"), [(404, "404"), (403, "403"), (416, "416: the file is empty"), (500, "500")])
def test_refusals_are_one_line(status: int, words: str, server: tuple[str, Served]) -> None:
    url, served = server
    served.status = status
    assert words in message(url)


def test_wrong_addresses_are_one_line() -> None:
    assert "check the address" in message("http://127.0.0.1:1/a.mp4")
    assert "check the address" in message("https://[::1/a.mp4")
    assert "check the address" in message("http://127.0.0.1:99999/a.mp4")


def test_an_empty_file_and_another_kind_of_file(server: tuple[str, Served]) -> None:
    url, served = server
    served.data = b""
    assert "416" in message(url)
    served.data = b"<html>not here</html>" * 100
    with pytest.raises(NotGeometryVideo, match="no geometry video"):
        gvpipe.open(url)


def test_a_server_without_length_or_range(server: tuple[str, Served]) -> None:
    url, served = server
    served.ranges = served.has_length = False
    assert "download it first" in message(url)


@pytest.mark.parametrize(
    ("change", "kind", "words"),
    [
        ({"etag": '"2"'}, CorruptFile, "another file by now"),
        ({"data": b"x" * 100_000}, CorruptFile, "another file by now"),
        ({"data": b"x"}, InputError, "416: the file is empty, or shorter than it was"),
        ({"ranges": False}, InputError, "200 without Range"),
        ({"status": 404}, InputError, "404"),
        ({"cut": 10}, TruncatedFile, "cut after 10 of"),
    ],
)
def test_what_changes_while_it_plays_is_one_line(
    change: dict[str, object], kind: type[GvpipeError], words: str, server: tuple[str, Served]
) -> None:
    url, served = server
    with gvpipe.open(url) as video:
        video[0]
        for name, value in change.items():
            setattr(served, name, value)
        with pytest.raises(kind, match=words) as raised:
            video[75]
        assert str(raised.value).count(url) == 1
        served.data, served.etag, served.ranges, served.status, served.cut = video_data(served, change), '"1"', True, 0, 0
        assert video[3].shape == (100, 3)  # what was fetched stays usable


def video_data(served: Served, change: dict[str, object]) -> bytes:
    """The file as it is after a change: none of these tests needs more of it."""
    return b"" if "data" in change else served.data


def test_a_connection_that_was_cut_once_is_tried_again(server: tuple[str, Served]) -> None:
    url, _ = server
    with gvpipe.open(url) as video:
        plain, calls = HttpSource._body, []

        def cut_once(self: HttpSource, answer: Any, length: int) -> bytes:
            calls.append(length)
            if len(calls) == 1:
                raise TruncatedFile("the connection was cut")
            return plain(self, answer, length)

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(HttpSource, "_body", cut_once)
            assert video[75].shape == (100, 3)
        assert len(calls) == 2


def test_a_file_cut_as_it_comes(files: tuple[Path, Path]) -> None:
    with serving(files[1].read_bytes()) as (url, served):
        served.ranges, served.cut = False, len(served.data) // 2
        with gvpipe.open(url) as video:
            video[0]
            with pytest.raises(TruncatedFile, match="cut after"):
                video[75]


def test_what_came_so_far_is_the_budget(server: tuple[str, Served]) -> None:
    url, served = server
    with gvpipe.open(url) as video:
        assert video.bitstream.budget.n_bytes == served.n_sent
        video[75]
        assert video.bitstream.budget.n_bytes == served.n_sent
    assert not gvpipe.open(url, unlimited=True).bitstream.budget.is_limited


def test_a_server_that_sends_a_byte_now_and_then(server: tuple[str, Served], monkeypatch: pytest.MonkeyPatch) -> None:
    """Never silent for long, and never done: the whole answer has a limit, and what a user waits for does not count."""
    monkeypatch.setattr(http_request, "LEAST_SECONDS", 1.0)
    monkeypatch.setattr(http_request, "LEAST_RATE", 1e9)
    url, served = server
    served.drip = 0.05
    begun = time.monotonic()
    assert "takes more than 1 s" in message(url)
    assert time.monotonic() - begun < 10


def test_headers_that_never_end(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(http_request, "LEAST_SECONDS", 0.5)
    monkeypatch.setattr(http_request, "LEAST_RATE", 1e9)
    with socket.create_server(("127.0.0.1", 0)) as listening:

        def answer() -> None:
            with contextlib.suppress(OSError):
                connection, _ = listening.accept()
                with connection:
                    connection.sendall(b"HTTP/1.1 200 OK\r\n")
                    for number in range(200):
                        connection.sendall(b"X-%d: y\r\n" % number)
                        time.sleep(0.05)

        thread = threading.Thread(target=answer, daemon=True)
        thread.start()
        begun = time.monotonic()
        assert "takes more than" in message(f"http://127.0.0.1:{listening.getsockname()[1]}/a.mp4")
        assert time.monotonic() - begun < 5
        thread.join(20)


def test_the_page_of_a_redirect_is_not_read() -> None:
    """It is as long as its server likes."""
    begun = time.monotonic()
    with answering(b"HTTP/1.1 302 Found\r\nLocation: /x\r\nContent-Length: 10000000000\r\n\r\n") as url:
        assert "302" in message(url)
    assert time.monotonic() - begun < 10


def test_a_length_that_a_server_names_buys_no_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(http_request, "LEAST_SECONDS", 0.5)
    monkeypatch.setattr(http_request, "LEAST_RATE", 1e9)
    begun = time.monotonic()
    with answering(b"HTTP/1.1 200 OK\r\nContent-Length: 1000000000000\r\n\r\n") as url:
        assert "takes more than" in message(url)
    assert time.monotonic() - begun < 10


@contextlib.contextmanager
def answering(head: bytes) -> Iterator[str]:
    """A server that answers with a head, then a byte now and then for 20 s."""

    def answer(connection: socket.socket) -> None:
        with contextlib.suppress(OSError), connection:
            connection.recv(1 << 16)
            connection.sendall(head)
            for _ in range(400):
                connection.sendall(b"a")
                time.sleep(0.05)

    def listen() -> None:
        with contextlib.suppress(OSError):
            while True:
                threading.Thread(target=answer, args=listening.accept()[:1], daemon=True).start()

    with socket.create_server(("127.0.0.1", 0)) as listening:
        threading.Thread(target=listen, daemon=True).start()
        yield f"http://127.0.0.1:{listening.getsockname()[1]}/a.mp4"


def test_a_pause_between_reads_does_not_count(files: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(http_request, "LEAST_SECONDS", 0.3)
    with serving(files[1].read_bytes()) as (url, served):
        served.ranges = False
        with gvpipe.open(url) as video:
            time.sleep(0.5)
            assert video[75].shape == (100, 3)


@pytest.mark.parametrize("ranges", [False, True])
def test_a_large_file_that_has_to_come_whole(ranges: bool, files: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(http_source, "MOST", 1 << 12)
    with serving(files[0].read_bytes() + bytes(1 << 20)) as (url, served):
        served.ranges = ranges
        assert "have to come before it can be read, above 4096" in message(url)
        assert served.n_sent < 1 << 20 or not ranges
        with pytest.raises(GvpipeError):  # the bytes behind the file are none
            gvpipe.open(url, unlimited=True)


def test_a_large_file_in_parts(files: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(http_source, "MOST", 1 << 10)
    monkeypatch.setattr(http_source, "BLOCK", 256)
    with serving(files[1].read_bytes()) as (url, _), gvpipe.open(url) as video:
        assert video[75].shape == (100, 3)


@pytest.mark.parametrize("target", ["ftp://127.0.0.1/a.mp4", "file:///etc/hostname", "data:text/plain,a"])
def test_redirects_lead_to_http_alone(target: str, server: tuple[str, Served]) -> None:
    url, served = server
    served.redirect = target
    assert "cannot be read" in message(url) or "302" in message(url)
