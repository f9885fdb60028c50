"""One request by HTTP, with a limit of time for all of it, and no other protocol behind a redirect.

``urllib`` of the standard library does the work, so proxies and certificates are those of Python. A server that sends a byte
now and then would keep it waiting for ever. So a timer ends the connection when it was waited for too long, in all.
"""

from __future__ import annotations

import contextlib
import http.client
import socket
import threading
import time
import urllib.request
from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any

Connection = http.client.HTTPConnection
SILENCE = 30.0  # seconds without a byte
LEAST_SECONDS = 60.0  # that a whole answer may take
LEAST_RATE = 10_000.0  # bytes a second: of long answers, which may take longer


class TooSlow(OSError):
    """An answer takes more time than its length allows."""


class Answer:
    """What a server sends; a context manager, which ends the connection.

    Args:
        url: of the file.
        headers: of the request.
        n_bytes: that are wanted; None: whatever comes, whose length `allow` tells.

    Raises:
        OSError, http.client.HTTPException, ValueError: there is no answer.
        TooSlow: it takes too long; of `read`, too.
    """

    def __init__(self, url: str, headers: Mapping[str, str], n_bytes: int | None) -> None:
        self._connections: list[Connection] = []
        self._is_late, self._waited = False, 0.0
        self.allow(n_bytes or 0)
        try:
            with self._in_time():
                self._response: Any = _opener(self._connections).open(
                    urllib.request.Request(url, headers=dict(headers)), timeout=SILENCE
                )
        except BaseException:
            self.close()
            raise
        self.status, self.headers = int(self._response.status), self._response.headers

    def allow(self, n_bytes: int) -> None:
        """Let the whole answer take what so many bytes may; time between reads does not count."""
        self._most = LEAST_SECONDS + n_bytes / LEAST_RATE

    def read(self, n_bytes: int) -> bytes:
        """The next bytes, fewer where the answer ends."""
        with self._in_time():
            return bytes(self._response.read(n_bytes))

    def close(self) -> None:
        """End the connection."""
        if hasattr(self, "_response"):
            self._response.close()

    def __enter__(self) -> Answer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _end(self) -> None:
        """In the timer's thread: end what the other one waits for."""
        self._is_late = True
        for connection in list(self._connections):
            sock: socket.socket | None = connection.sock
            with contextlib.suppress(OSError, AttributeError):
                (sock or self._response.fp.raw._sock).shutdown(socket.SHUT_RDWR)

    @contextlib.contextmanager
    def _in_time(self) -> Iterator[None]:
        """Wait for the server inside, for as long as is left; what goes wrong because the time is over says so."""
        begun = time.monotonic()
        timer = threading.Timer(max(0.0, self._most - self._waited), self._end)
        timer.daemon = True
        timer.start()
        failed: Exception | None = None
        try:
            yield
        except Exception as exc:
            failed = exc
        finally:
            timer.cancel()
            self._waited += time.monotonic() - begun
        if self._is_late:
            raise TooSlow(f"its answer takes more than {self._most:.0f} s") from failed
        if failed is not None:
            raise failed


def _opener(connections: list[Connection]) -> urllib.request.OpenerDirector:
    """An opener for http and https, also behind redirects and proxies, whose connections are added to a list."""
    opener = urllib.request.OpenerDirector()
    for handler in (
        urllib.request.ProxyHandler(),
        urllib.request.UnknownHandler(),
        urllib.request.HTTPDefaultErrorHandler(),
        _Redirects(),
        urllib.request.HTTPErrorProcessor(),
        _Plain(connections),
        _Secure(connections),
    ):
        opener.add_handler(handler)
    return opener


class _Redirects(urllib.request.HTTPRedirectHandler):
    """Follows redirects without reading the page that comes with one, of which the library's own reads all."""

    def http_error_302(self, req: urllib.request.Request, fp: Any, code: int, msg: str, headers: Any) -> Any:
        fp.read = bytes  # what the library calls before it closes the answer
        return super().http_error_302(req, fp, code, msg, headers)

    http_error_301 = http_error_303 = http_error_307 = http_error_308 = http_error_302


class _Plain(urllib.request.HTTPHandler):
    def __init__(self, connections: list[Connection]) -> None:
        super().__init__()
        self._connections = connections

    def http_open(self, req: urllib.request.Request) -> Any:
        return self.do_open(partial(_noted, http.client.HTTPConnection, self._connections), req)


class _Secure(urllib.request.HTTPSHandler):
    def __init__(self, connections: list[Connection]) -> None:
        super().__init__()
        self._connections = connections

    def https_open(self, req: urllib.request.Request) -> Any:
        return self.do_open(partial(_noted, http.client.HTTPSConnection, self._connections), req)


def _noted(kind: type[Connection], connections: list[Connection], *given: Any, **named: Any) -> Any:
    connection = kind(*given, **named)
    connections.append(connection)
    return connection
