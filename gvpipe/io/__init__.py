"""Mesh sequences from files and to files.

A format that holds a whole sequence in one file has a module here and an entry in `scene_formats`. A format of single frames
has a module and an entry in `formats.FRAME_FORMATS`. What is named in ``__all__`` loads on first use: a process that runs a
library imports its own format alone.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gvpipe.io.reading import READERS, read
    from gvpipe.io.scene_formats import WRITERS
    from gvpipe.io.writing import write

__all__ = ["READERS", "WRITERS", "read", "write"]

_HOME = {
    "READERS": "gvpipe.io.reading",
    "WRITERS": "gvpipe.io.scene_formats",
    "read": "gvpipe.io.reading",
    "write": "gvpipe.io.writing",
}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'gvpipe.io' has no attribute {name!r}")
    return getattr(import_module(_HOME[name]), name)
