"""Arguments of the wrong type, and misspelt names: what was given, what is needed, what was probably meant.

A wrong type is a mistake in the calling program and raises TypeError. A wrong value may come from a user and raises a
`gvpipe.foundation.errors.GvpipeError`.
"""

from __future__ import annotations

import difflib
import os
from collections.abc import Iterable

StrPath = str | os.PathLike[str]


def check_path(value: object, role: str, instead: str = "") -> StrPath:
    """Return a path; raise TypeError if ``value`` is none. ``instead`` names alternatives, such as ``"a MeshSequence or "``."""
    if not isinstance(value, str | os.PathLike) or isinstance(os.fspath(value), bytes):
        raise TypeError(f"{role} is {show(value)}; {instead}a path (str or os.PathLike) is needed")
    return value


def check_number(value: object, role: str) -> None:
    """Raise TypeError unless ``value`` is a number; NumPy's are."""
    if isinstance(value, bool | str | bytes) or not hasattr(value, "__float__"):
        raise TypeError(f"{role} is {show(value)}; a number is needed")


def show(value: object) -> str:
    """A value and its type, short, in one line: ``5 (int)``."""
    text = " ".join(repr(value).split())
    return f"{text if len(text) <= 40 else text[:37] + '...'} ({type(value).__name__})"


def did_you_mean(name: object, names: Iterable[str]) -> str:
    """``; did you mean 'quality'?``, or nothing where no name is near."""
    known = {each.lower(): each for each in reversed(list(names))}
    near = difflib.get_close_matches(str(name).lower(), list(known), 1, 0.6)
    return f"; did you mean {known[near[0]]!r}?" if near else ""
