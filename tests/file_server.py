"""A web server on this machine for one file: it counts bytes, and misbehaves as told."""

from __future__ import annotations

import contextlib
import http.server
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, field

CHUNK = 1 << 14
HELD = 30  # s, at most


@dataclass
class Served:
    """What the server does.

    Args:
        data: the file.
        ranges: whether it knows Range.
        has_length: whether it sends the length of a whole file.
        status: an answer in place of the file; 0: the file.
        cut: bytes after which answers end early; 0: they do not.
        etag: of the file.
        rate: bits per second; 0: as fast as it can.
        held: what lies behind so many bytes is sent once ``go`` is set.
        go: see ``held``.
        drip: seconds between single bytes; 0: they come together.
        redirect: an address to send readers to; "": none.
        sent: ``(offset, bytes)`` of each answer.
        n_refused: answers that were a status.
    """

    data: bytes
    ranges: bool = True
    has_length: bool = True
    status: int = 0
    cut: int = 0
    etag: str = '"1"'
    rate: float = 0.0
    held: int = 1 << 62
    go: threading.Event = field(default_factory=threading.Event)
    drip: float = 0.0
    redirect: str = ""
    sent: list[tuple[int, int]] = field(default_factory=list)
    n_refused: int = 0

    @property
    def n_sent(self) -> int:
        """Bytes that were sent so far."""
        return sum(length for _, length in self.sent)


@contextlib.contextmanager
def serving(data: bytes) -> Iterator[tuple[str, Served]]:
    """The address of a file on a server that runs for as long as the block, and what it does."""
    served = Served(data)

    class Handler(http.server.BaseHTTPRequestHandler):
        def log_message(self, *_: object) -> None:
            """Print nothing."""

        def do_GET(self) -> None:
            answer(self, served)

        def do_OPTIONS(self) -> None:
            self.send_response(204)  # browsers may ask before they send a Range to another server
            self.send_header("Access-Control-Allow-Headers", "Range")
            self.end_headers()

        def end_headers(self) -> None:
            self.send_header("Access-Control-Allow-Origin", "*")
            super().end_headers()

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=server.serve_forever, args=(0.01,), daemon=True)
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_port}/a.mp4", served
    finally:
        server.shutdown()
        server.server_close()


def answer(handler: http.server.BaseHTTPRequestHandler, served: Served) -> None:
    """Send the file, the part of it that is asked for, or an error."""
    wanted, size = handler.headers.get("Range"), len(served.data)
    if served.status:
        served.n_refused += 1
        handler.send_error(served.status)
        return
    if served.redirect:
        handler.send_response(302)
        handler.send_header("Location", served.redirect)
        handler.end_headers()
        return
    start, stop = 0, size
    if wanted and served.ranges:
        first, last = wanted.removeprefix("bytes=").split("-")
        start, stop = int(first), min(int(last or size) + 1, size)
        if start >= size:
            handler.send_error(416)
            return
        handler.send_response(206)
        handler.send_header("Content-Range", f"bytes {start}-{stop - 1}/{size}")
    else:
        handler.send_response(200)
    if served.has_length:
        handler.send_header("Content-Length", str(stop - start))
    handler.send_header("ETag", served.etag)
    handler.end_headers()
    if served.cut:
        stop = min(stop, start + served.cut)
    served.sent.append((start, stop - start))
    with contextlib.suppress(OSError):
        begun = time.perf_counter()
        at = start
        while served.drip and at < stop:
            handler.wfile.write(served.data[at : at + 1])
            at += 1
            time.sleep(served.drip)
        while at < stop and (at < served.held or served.go.wait(HELD)):
            end = min(at + CHUNK, stop, served.held if at < served.held else stop)
            handler.wfile.write(served.data[at:end])
            at = end
            if served.rate:
                time.sleep(max(0.0, 8 * (at - start) / served.rate - (time.perf_counter() - begun)))
