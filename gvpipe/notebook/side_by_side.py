"""Players beside each other that play, turn and show fields in step. It needs ipywidgets, as `gvpipe.notebook.widget`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ipywidgets import HBox, Layout, jslink

from gvpipe.foundation.errors import InputError
from gvpipe.notebook.widget import PlayerWidget, show_widget

SHARED = ("frame", "playing", "speed", "camera")


class SideBySide(HBox):
    """Players in a row whose frame, speed and camera are linked in the page, so they stay so without a kernel's help.

    Args:
        players: with one number of frames; they become ``players``.

    Raises:
        InputError: their numbers of frames differ.
    """

    def __init__(self, players: Sequence[PlayerWidget]) -> None:
        counts = {player.name: player.n_frames for player in players}
        if len(set(counts.values())) > 1:
            listed = ", ".join(f"{name} has {count}" for name, count in counts.items())
            raise InputError(
                f"players in step need as many frames each: {listed}; show them one by one, or frames of one length"
            )
        self.players = tuple(players)
        super().__init__(children=self.players, layout=Layout(width="100%"))
        first = self.players[0]
        self._links = [jslink((first, name), (other, name)) for other in self.players[1:] for name in SHARED]

    def _repr_mimebundle_(self, **_: Any) -> dict[str, Any]:
        show_widget(self)
        kept = [player.saved() for player in self.players]
        pages = "".join(f'<div style="flex: 1; min-width: 0">{each["text/html"]}</div>' for each in kept)
        row = f'<div style="display: flex; gap: 1em">{pages}</div>'
        return {**kept[0], "text/html": row, "text/plain": repr(self)}

    def __repr__(self) -> str:
        return f"<SideBySide {', '.join(player.name for player in self.players)}>"
