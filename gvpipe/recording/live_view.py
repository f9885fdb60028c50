"""A recording in a notebook while it grows: a player that follows the file, and then shows it as it is."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from gvpipe.foundation.errors import GvpipeError
from gvpipe.notebook.libraries import has_widgets, in_kernel
from gvpipe.notebook.prepared import Prepared, prepare
from gvpipe.notebook.showing import ERROR
from gvpipe.playback.player import Player
from gvpipe.web.page_view import PageView


class GrowingFile:
    """A file that gets longer, to read what is there of it."""

    def __init__(self, path: Path) -> None:
        self._path = path

    @property
    def size(self) -> int:
        """Bytes so far."""
        return os.stat(self._path).st_size if self._path.exists() else 0

    def let_grow(self) -> None:
        """It may grow anyway."""

    def read(self, offset: int, length: int) -> bytes:
        """Bytes ``offset`` to ``offset + length``, fewer where it ends before."""
        with open(self._path, "rb") as file:
            file.seek(offset)
            return file.read(length)


class LiveView:
    """The player of a recording.

    Args:
        path: of the file that grows.
    """

    def __init__(self, path: Path) -> None:
        from IPython.display import display

        from gvpipe.notebook.widget import PlayerWidget, shown_above

        prepared = Prepared(path.name, Player(path, unlimited=True), GrowingFile(path))
        self._widget = PlayerWidget(prepared, PageView(), loop=False, is_growing=True)
        kept = {"text/html": "", "text/plain": ""}
        self._handle: Any = display(shown_above(self._widget, kept), raw=True, display_id=True)

    def finish(self, path: Path) -> None:
        """Show the whole file, which then may go."""
        self._widget.show_instead(prepare(Player(path, unlimited=True, data=path.read_bytes()), ERROR))
        self._handle.update(self._widget.saved(), raw=True)


def open_view(path: Path, wanted: bool | None) -> LiveView | None:
    """Show a file that grows; None where there is no notebook, or it has no widgets.

    Raises:
        InputError: a view is wanted, and cannot be.
    """
    if not (in_kernel() and has_widgets()):
        return None
    try:
        return LiveView(path)
    except GvpipeError:
        if wanted:
            raise
        return None
