"""A recording in a notebook while it grows: a player that follows the file, and then shows it as it is.

A kernel that runs a loop answers no page. So it sends the page what has come, whether the page asks or not.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from gvpipe.container.sources import BytesSource
from gvpipe.foundation.errors import GvpipeError
from gvpipe.notebook.libraries import has_widgets, in_kernel
from gvpipe.notebook.prepared import Prepared, prepare
from gvpipe.notebook.showing import ERROR
from gvpipe.playback.player import Player
from gvpipe.web.page_view import PageView


class LiveView:
    """The player of a recording.

    Args:
        path: of the file that grows, with a clip in it.
    """

    def __init__(self, path: Path) -> None:
        from IPython.display import display

        from gvpipe.notebook.widget import PlayerWidget, show_widget

        self._path, self._front = path, path.read_bytes()
        self._size = len(self._front)
        prepared = Prepared(path.name, Player(path, unlimited=True), BytesSource(self._front))
        self._widget = PlayerWidget(prepared, PageView(), loop=False, is_growing=True)
        show_widget(self._widget)
        self._handle: Any = display({"text/html": "", "text/plain": ""}, raw=True, display_id=True)

    def grow(self) -> None:
        """Send what has changed: the end, and in the front, of which the table has new rows."""
        with open(self._path, "rb") as file:
            front = file.read(len(self._front))
            changed = np.flatnonzero(np.frombuffer(front, np.uint8) != np.frombuffer(self._front, np.uint8))
            file.seek(self._size)
            self._widget.send_part(self._size, end := file.read())
        if changed.size:
            self._widget.send_part(first := int(changed[0]), front[first : int(changed[-1]) + 1])
        self._front, self._size = front, self._size + len(end)

    def finish(self, path: Path) -> None:
        """Show the whole file, which then may go."""
        self._widget.show_instead(prepare(Player(path, unlimited=True, data=path.read_bytes()), ERROR))
        self._handle.update(self._widget.saved(), raw=True)


def open_view(path: Path, wanted: bool | None) -> LiveView | None:
    """Show a file that grows; None where there is no notebook, or it has no widgets.

    Raises:
        GvpipeError: a view is wanted, and cannot be.
    """
    if not (in_kernel() and has_widgets()):
        return None
    try:
        return LiveView(path)
    except GvpipeError:
        if wanted:
            raise
        return None
