"""Every error that gvpipe raises on purpose.

One tree, so that a caller can catch as much or as little as needed::

    GvpipeError
    ├── InputError           a sequence, a setting or a path that cannot be used (also a ValueError)
    │   ├── SettingError     a codec setting out of range or unknown
    │   └── TopologyChange   vertices or triangles change at a frame, which it names
    ├── OutputError          the result cannot be written (disk full, no such folder)
    └── FormatError          a file that cannot be read as a geometry video
        ├── NotGeometryVideo     not an MP4, or an MP4 that gvpipe did not write
        ├── NewerVersion         written by a newer gvpipe
        ├── StrippedFile         the payload box was removed, e.g. by remuxing
        ├── TruncatedFile        the file ends early
        ├── CorruptFile          a checksum, a length or an index does not hold
        ├── MissingSection       it shares a section with other files of a shard that it was taken out of
        └── OverBudget           it takes more memory or work than a file of its size may

Third-party errors are wrapped where they arise (``raise ... from exc``); every message names the file, frame
or value, the limit and what to do about it.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Self

from gvpipe.foundation.text import escaped

REMEDY = "get the file again from its source"
LONGEST = 800  # characters of a message
LONGEST_QUOTE = 60  # characters of a value that a message quotes
CUT = " ... "


def printable(text: str, longest: int = LONGEST) -> str:
    """Return a text as one line that any terminal shows: `text.escaped`, and its middle left out where it is long.

    Examples:
        >>> printable("two\\nlines and a bell\\a")
        'two lines and a bell\\\\x07'
    """
    text = escaped(text)
    if len(text) <= longest:
        return text
    half = (longest - len(CUT)) // 2
    return text[:half] + CUT + text[-half:]


def quote(value: object) -> str:
    """Return a value of a file for a message: as Python writes it, cut at `LONGEST_QUOTE` characters.

    Examples:
        >>> quote("mcgv")
        "'mcgv'"
    """
    return repr(value)[:LONGEST_QUOTE]


class GvpipeError(Exception):
    """Base of all errors raised on purpose; its text is one line, fit to be shown to a user (`printable`)."""

    def __init__(self, message: str = "") -> None:
        super().__init__(printable(message))


class InputError(GvpipeError, ValueError):
    """The sequence, path or argument given cannot be used."""


class SettingError(InputError):
    """A codec setting is unknown or out of range."""


class TopologyChange(InputError):
    """The mesh has other vertices or triangles from a frame on: ``frame``, counted in the whole input."""

    def __init__(self, message: str, frame: int) -> None:
        super().__init__(message)
        self.frame = frame

    def __reduce__(self) -> tuple[type[TopologyChange], tuple[str, int]]:
        return type(self), (str(self), self.frame)

    @classmethod
    def at(cls, what: str, frame: int, start: int = 0) -> TopologyChange:
        """The error for what changes at a frame, of an input that is read from ``start`` on."""
        remedy = f"read some frames (--frames {start}:{frame} or --frames {frame}:), or write several files (--split)"
        return cls(f"{what}; {remedy}", frame)


class OutputError(GvpipeError):
    """The result cannot be written."""


class FormatError(GvpipeError):
    """The file cannot be read as a geometry video.

    Attributes:
        what: what is wrong with it.
        remedy: what its user can do; may be empty.
        file: its name; empty where it has none, or where the name is not known yet (`within`).
    """

    def __init__(self, what: str = "", remedy: str = "", file: str = "") -> None:
        self.what, self.remedy, self.file = what, remedy, file
        super().__init__(": ".join(filter(None, (file, "; ".join(filter(None, (what, remedy)))))))

    def within(self, file: str) -> Self:
        """The same error of a file of that name, or of what lies in it."""
        named = type(self)(self.what, self.remedy, ": ".join(filter(None, (file, self.file))))
        named.__dict__.update(self.__dict__, file=named.file)
        return named


class NotGeometryVideo(FormatError):
    """Not an MP4 file, or an MP4 file that gvpipe did not write."""


class NewerVersion(FormatError):
    """The file, or the codec inside it, is newer than this gvpipe."""


class StrippedFile(FormatError):
    """The MP4 carries gvpipe's tag but not its payload, as after remuxing."""


class TruncatedFile(FormatError):
    """The file ends before its content does."""


class CorruptFile(FormatError):
    """A checksum, a length or an index in the file does not hold."""


class SeveralShots(FormatError):
    """The file is a capture, whose vertices and triangles change; `gvpipe.open_capture` reads it."""


class MissingSection(FormatError):
    """The file refers to a section that lies in the shard that it was taken out of (`gvpipe.container.shared_sections`)."""


class OverBudget(FormatError):
    """The file takes more memory or work than its size warrants (`gvpipe.foundation.budget`).

    Attributes:
        asked: the step that was refused, and what it takes.
    """

    asked = ""


def corrupt(what: str) -> CorruptFile:
    """Return the error for a file of which ``what`` says what does not hold; the remedy is added.

    Examples:
        >>> str(corrupt("its video is damaged"))
        'its video is damaged; get the file again from its source'
    """
    return CorruptFile(what, REMEDY)


def corrupt_section(name: str, what: str) -> CorruptFile:
    """Return the error for a section of which ``what`` says what does not hold; name and remedy are added."""
    return corrupt(f"section {name!r} is corrupt: {what}")


@contextmanager
def in_file(path: str) -> Iterator[None]:
    """Put the file's name before the message of any `FormatError` that is raised inside; nothing for an empty name."""
    try:
        yield
    except FormatError as exc:
        if not path:
            raise
        raise exc.within(path) from exc
