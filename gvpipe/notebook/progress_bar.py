"""The progress of an encoding, as a bar below the cell that is replaced by what came of it."""

from __future__ import annotations

import html
import time
from typing import Any

from gvpipe.notebook.libraries import in_kernel

SECONDS = 0.2  # between two pictures of the bar
AFTER = 0.5  # s until it appears: short work needs none


class ProgressBar:
    """A `gvpipe.foundation.progress.Progress` that shows in notebooks, and nowhere else.

    Args:
        name: of what is encoded.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._due = time.monotonic() + AFTER
        self._handle: Any = None  # IPython's

    def __call__(self, stage: str, done: float) -> None:
        if time.monotonic() < self._due or not in_kernel():
            return
        self._due = time.monotonic() + SECONDS
        words = html.escape(f"encoding {self._name}: {stage}")
        self._show(f'<progress max="1" value="{min(1.0, max(0.0, done)):.3f}"></progress> {words}', f"{words} {done:.0%}")

    def finish(self, note: str) -> None:
        """Say what came of it, in place of the bar."""
        if note and in_kernel():
            self._show(html.escape(note), note)

    def _show(self, markup: str, text: str) -> None:
        from IPython.display import display

        bundle = {"text/html": markup, "text/plain": text}
        if self._handle is None:
            self._handle = display(bundle, raw=True, display_id=True)
        else:
            self._handle.update(bundle, raw=True)
