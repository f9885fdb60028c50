"""What goes wrong inside a reader, said in one line: the file, what it should be, the reason, the remedy.

Damaged files raise nearly anything inside NumPy, json, h5py, SciPy and the libraries of scene formats. `reading` is the one
place where that becomes an `InputError`. Errors that are raised for users pass, with the file's name before them.
"""

from __future__ import annotations

import re
import stat
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from gvpipe.container.sources import NO_FILE
from gvpipe.foundation.arguments import did_you_mean
from gvpipe.foundation.errors import InputError, TopologyChange, printable

AGAIN, FRAME_AGAIN = "export it again", "export this frame again"
WHOLE = "it may be cut short, so export it again"
OTHERWISE = "export it in another form or format"
NOT_READ = re.compile(r"\b(not|are) (read|followed)\b")
REMEDY = re.compile(r"\b(needed|check|convert|export|get|give|install|must|put|remove|save|set|use|write)\b")
LONGEST = 300  # characters of a reason
LISTED = 12  # names in a message


@contextmanager
def reading(path: Path, kind: str, at: str = "", remedy: str = AGAIN) -> Iterator[None]:
    """Turn what is raised inside into `InputError`; odd numbers, such as NaN for an index, make no warnings.

    Args:
        path: of the file, for the message.
        kind: what it should be, such as ``"USD"``; ``""`` leaves that out.
        at: where in the file, such as ``"frame 3"``.
        remedy: what the user can do.
    """
    import numpy as np  # late: a process of a library starts before it is loaded

    try:
        with np.errstate(all="ignore"):  # readers check what they made of the numbers
            yield
    except InputError as exc:
        if printable(path.name) in str(exc) or isinstance(exc, TopologyChange):
            raise
        raise InputError(f"{path}: {exc}") from exc
    except Exception as exc:
        raise unreadable(path, kind, reason_of(exc), at, remedy) from exc


def check_file(path: Path) -> None:
    """Raise `InputError` unless a path is that of a file that has bytes; a pipe or a device would be read for ever."""
    try:
        state = path.stat()
    except FileNotFoundError as exc:
        raise InputError(f"{path}: no such file; check the path") from exc
    except OSError as exc:
        raise InputError(f"{path} cannot be read: {exc.strerror}; check the path") from exc
    if not stat.S_ISREG(state.st_mode):
        raise InputError(f"{path} {NO_FILE}")
    if not state.st_size:
        raise InputError(f"{path} is empty; {AGAIN}")


def unreadable(path: Path, kind: str, reason: str, at: str = "", remedy: str = AGAIN) -> InputError:
    """The error of a file that cannot be read; arguments as of `reading`. A reason that ends in a remedy keeps its own."""
    about = reason.rpartition("; ")[2] if "; " in reason else ""
    if remedy == AGAIN and NOT_READ.search(reason):  # another export of the same kind would be refused, too
        remedy = OTHERWISE
    again = "" if REMEDY.search(about) else f"; {remedy}"
    return InputError(f"{path}{f': {at}' if at else ''} cannot be read{f' as {kind}' if kind else ''}: {reason}{again}")


def reason_of(exc: BaseException) -> str:
    """The text of an error as one short line, without where in a library's sources it arose."""
    if isinstance(exc, OSError) and exc.strerror and exc.errno:
        return exc.strerror
    if isinstance(exc, MemoryError):
        return "it declares more numbers than memory holds"
    try:
        text = str(exc)
    except UnicodeError:  # it quotes a damaged file
        return "its text is damaged"
    usd = re.search(r" in file \S+ : '(.*?)'?\s*(?:$|Error in)", text, re.DOTALL)
    text = re.sub(r"parse error matching .*? at '", "parse error at '", usd[1], flags=re.DOTALL) if usd else text
    alembic = text.rsplit("EXCEPTION:", 1)
    text = alembic[-1] if len(alembic) > 1 else text
    return " ".join(text.split())[:LONGEST] or type(exc).__name__


def unknown_name(kind: str, name: str, names: Iterable[str]) -> InputError:
    """The error of a clip or a take that a file does not have: it lists those that there are."""
    known = list(names)
    listed = ", ".join(map(repr, known[:LISTED])) + (f" and {len(known) - LISTED} more" if len(known) > LISTED else "")
    there = f"there are: {listed}" if known else "it has none"
    return InputError(f"it has no {kind} {name!r}; {there}{did_you_mean(name, known)}")
