"""A file on a web server, read by HTTP Range: what is asked for, in blocks, of which the last are kept.

Any server will do. One that does not know Range sends the whole file: then it is read as it comes, into a temporary file, up to
`MOST`. `gvpipe.container.http_request` says how long an answer may take.
"""

from __future__ import annotations

import contextlib
import http.client
import re
import tempfile
import urllib.error
import weakref
from collections import OrderedDict
from collections.abc import Callable, Iterator
from typing import IO, Any

from gvpipe.container.http_request import Answer, TooSlow
from gvpipe.foundation.errors import REMEDY, CorruptFile, InputError, TruncatedFile, printable, quote
from gvpipe.runtime.forks import ForkLock, renew_after_fork

BLOCK = 1 << 16  # bytes
KEPT_BLOCKS = 512  # 32 MB
MOST = 1 << 30  # bytes of a file that has to come as a whole
CONTENT_RANGE = re.compile(r"bytes (\d{1,18})-(\d{1,18})/(\d{1,18})")
OPEN_AGAIN = "open it again"
IDENTITY = "identity"  # a body that is the file itself
OUTAGE = 500  # from this status on, a server may come back


class HttpSource:
    """The bytes at an address; thread-safe.

    Args:
        url: of the file.
        received: called with the number of bytes that have come so far, after each answer.
        most: bytes of a file that has to come as a whole; None: any.

    Raises:
        InputError: no such server or file, or it cannot be read.
    """

    def __init__(self, url: str, received: Callable[[int], None] = lambda count: None, most: int | None = MOST) -> None:
        self._url, self._tell, self._most = url, received, most
        self._lock = ForkLock()
        self._blocks: OrderedDict[int, bytes] = OrderedDict()
        self._received = 0
        self._arriving: _Arriving | None = None
        self._is_forked = False
        self._may_grow = False
        with self._asking():
            answer = self._request(0, BLOCK)
            self._validators = _validators(answer.headers)
            if answer.status != 206:
                self._arriving = _Arriving(answer, self._most)
                self.size: int = self._arriving.size
            else:
                with answer:
                    self.size = _total(answer.headers, 0)
                    self._keep(0, self._body(answer, min(BLOCK, self.size)))
        renew_after_fork(self)

    def after_fork(self) -> None:
        """Ask anew in a forked child: what still comes in would be shared with the parent."""
        self._is_forked = self._arriving is not None

    def let_grow(self) -> None:
        """Read on though the file has become larger; its size stays what it was."""
        self._may_grow = True

    def read(self, offset: int, length: int) -> bytes:
        """Return bytes ``offset`` to ``offset + length``.

        Raises:
            InputError: the server does not answer, or not with them.
            CorruptFile, TruncatedFile: it has another file by now, or the connection was cut.
        """
        if offset + length > self.size:
            raise TruncatedFile(f"it ends at byte {self.size}, {offset + length - self.size} more are needed; {REMEDY}")
        if not length:
            return b""
        with self._lock:
            if self._arriving is not None:
                return self._read_arriving(self._arriving, offset, length)
            first, last = offset // BLOCK, (offset + length - 1) // BLOCK
            parts = {number: self._blocks[number] for number in range(first, last + 1) if number in self._blocks}
            missing = [number for number in range(first, last + 1) if number not in parts]
            if missing:
                start, stop = missing[0] * BLOCK, min((missing[-1] + 1) * BLOCK, self.size)
                data = self._fetch(start, stop - start)
                for number in range(missing[0], missing[-1] + 1):
                    parts[number] = data[number * BLOCK - start : (number + 1) * BLOCK - start]
            for number in sorted(parts):
                self._keep(number, parts[number])
            joined = b"".join(parts[number] for number in sorted(parts))
        return joined[offset - first * BLOCK : offset - first * BLOCK + length]

    def read_all(self) -> bytes:
        """Return the whole file, which is not kept."""
        with self._lock:
            if self._arriving is None and self.size > BLOCK:  # else it is here already
                with self._asking():
                    _check_size(self.size, self._most)
                return self._fetch(0, self.size)
        return self.read(0, self.size)

    def _read_arriving(self, arriving: _Arriving, offset: int, length: int) -> bytes:
        with self._asking():
            if self._is_forked:
                answer = self._request(0, None)
                arriving = self._arriving = _Arriving(answer, self._most)
                self._is_forked = False
                if arriving.size != self.size or _validators(answer.headers) != self._validators:
                    raise CorruptFile(f"the server has another file by now; {OPEN_AGAIN}")
            data = arriving.read(offset, length)
        self._tell(arriving.received)
        return data

    def _keep(self, number: int, block: bytes) -> None:
        self._blocks[number] = block
        self._blocks.move_to_end(number)
        while len(self._blocks) > KEPT_BLOCKS:
            self._blocks.popitem(last=False)

    def _fetch(self, offset: int, length: int) -> bytes:
        try:
            return self._fetch_once(offset, length)
        except TruncatedFile:  # connections that were idle are cut
            return self._fetch_once(offset, length)

    def _fetch_once(self, offset: int, length: int) -> bytes:
        with self._asking(), self._request(offset, length) as answer:
            if answer.status == 200:
                raise InputError(f"the server no longer sends parts of the file (200 without Range); {OPEN_AGAIN}")
            size = _total(answer.headers, offset)
            is_same = size == self.size and _validators(answer.headers) == self._validators
            if not is_same and not (self._may_grow and size >= self.size):
                raise CorruptFile(f"the server has another file by now; {OPEN_AGAIN}")
            return self._body(answer, length)

    def _request(self, offset: int, length: int | None) -> Answer:
        headers = {"Accept-Encoding": IDENTITY, "User-Agent": "gvpipe"}
        if length is not None:
            headers["Range"] = f"bytes={offset}-{offset + length - 1}"
        answer = Answer(self._url, headers, length)
        coding = answer.headers.get("Content-Encoding", IDENTITY)
        if coding.strip().lower() not in ("", IDENTITY):
            answer.close()
            raise InputError(f"the server sends the file with Content-Encoding {quote(coding)}; have it send .mp4 as it is")
        return answer

    def _body(self, answer: Answer, length: int) -> bytes:
        data = answer.read(length)
        if len(data) != length:
            raise TruncatedFile(f"the connection was cut after {len(data)} of {length} bytes; try again")
        self._received += len(data)
        self._tell(self._received)
        return data

    @contextlib.contextmanager
    def _asking(self) -> Iterator[None]:
        """Turn what servers and connections do into one line."""
        try:
            yield
        except urllib.error.HTTPError as exc:
            with exc:
                raise _refused(self._url, exc.code, exc.reason) from exc
        except TooSlow as exc:
            raise TruncatedFile(f"{exc}; try again, or download the file first") from exc
        except (ConnectionError, TimeoutError, http.client.IncompleteRead) as exc:
            raise TruncatedFile(f"the connection was cut ({type(exc).__name__}); try again") from exc
        except InputError as exc:
            raise InputError(f"{self._url}: {exc}") from exc
        except (OSError, http.client.HTTPException, ValueError) as exc:  # URLError is an OSError
            reason = printable(str(getattr(exc, "reason", exc)) or type(exc).__name__, 200)
            raise InputError(f"{self._url} cannot be read: {reason}; check the address and the connection") from exc


class _Arriving:
    """A whole file as it comes, kept in a temporary file: for servers that do not know Range."""

    def __init__(self, answer: Answer, most: int | None) -> None:
        length = answer.headers.get("Content-Length", "")
        if not (length.isascii() and length.isdecimal() and len(length) < 19):
            answer.close()
            raise InputError("the server sends neither parts of the file nor its length; download it first")
        self.size, self.received, self._most = int(length), 0, most
        self._answer = answer
        self._file: IO[bytes] = tempfile.TemporaryFile()  # noqa: SIM115  closed with the last reference to this object
        for each in (self._file, answer):
            weakref.finalize(self, each.close)

    def read(self, offset: int, length: int) -> bytes:
        """Wait until bytes have come, and return them."""
        _check_size(offset + length, self._most)
        if self.received < offset + length:
            self._answer.allow(offset + length)  # not the length that the server names, which may be any
        self._file.seek(0, 2)
        while self.received < offset + length:
            data = self._answer.read(min(BLOCK, offset + length - self.received))
            if not data:
                raise TruncatedFile(f"the connection was cut after {self.received} of {self.size} bytes; {OPEN_AGAIN}")
            self._file.write(data)
            self.received += len(data)
        self._file.seek(offset)
        return self._file.read(length)


def _check_size(size: int, most: int | None) -> None:
    """Refuse to fetch so many bytes, of a file that cannot be read in parts."""
    if most is not None and size > most:
        raise InputError(
            f"{size} bytes have to come before it can be read, above {most}; if you trust its source, allow more by "
            "--unlimited (Python: unlimited=True), or download it first"
        )


def _total(headers: Any, offset: int) -> int:
    """The size of the whole file, of an answer with a part of it from ``offset`` on."""
    found = CONTENT_RANGE.fullmatch(headers.get("Content-Range", "").strip())
    if found is None or int(found[1]) != offset:
        given = quote(headers.get("Content-Range"))
        raise InputError(f"the server sends {given} in place of bytes from {offset} on; download the file first")
    return int(found[3])


def _validators(headers: Any) -> tuple[str, ...]:
    """What changes when the file does."""
    return tuple(str(headers.get(name, "")) for name in ("ETag", "Last-Modified"))


def _refused(url: str, status: int, reason: str) -> InputError:
    if status == 416:
        return InputError(f"{url}: the server answers 416: the file is empty, or shorter than it was; {OPEN_AGAIN}")
    remedy = "try again later" if status >= OUTAGE else "check the address"
    return InputError(f"{url}: the server answers {status} {printable(str(reason), 60)}; {remedy}")
