"""What a notebook shows of a sequence, a player or a comparison that is the last line of a cell."""

from __future__ import annotations

import html
import os
from dataclasses import dataclass
from typing import Any

from gvpipe.foundation.errors import GvpipeError
from gvpipe.metrics.comparison import Comparison
from gvpipe.model.capture import Capture
from gvpipe.model.sequence import MeshSequence
from gvpipe.notebook.libraries import REMEDY, has_widgets, in_kernel
from gvpipe.notebook.prepared import is_ready
from gvpipe.notebook.showing import ERROR, show

MOST_SAMPLES = 8_000_000  # vertices times frames, of a sequence that is encoded unasked: some seconds
TOO_LARGE = "gvpipe.show(...) encodes it and plays it"


def interactive(shown: Any, still: str) -> dict[str, Any] | None:
    """Show a player, and return what a saved notebook keeps of it; None where nothing but text or a still can be shown.

    Args:
        shown: a sequence, a capture, a player of either, or a comparison, of which both sides play in step.
        still: HTML that is shown, with what to do about it, where there is no player, and above the players of a comparison.
    """
    if not in_kernel():
        return None
    sources = shown.sides if isinstance(shown, Comparison) else [shown]
    if not sources:
        return None
    player = _player(sources)
    if isinstance(player, str):
        return {"text/html": _with_hint(still, player)}
    bundle: dict[str, Any] = player._repr_mimebundle_()
    return {**bundle, "text/html": still + bundle["text/html"]} if isinstance(shown, Comparison) else bundle


@dataclass(frozen=True)
class Still:
    """HTML in place of a player."""

    html: str

    def _repr_html_(self) -> str:
        return self.html


def player_or_still(shown: Any, still: str) -> Any:
    """Return a player's widget, for notebooks whose pages take that, or a `Still` with what to do about it."""
    player = _player([shown])
    return Still(_with_hint(still, player)) if isinstance(player, str) else player


def _player(sources: list[Any]) -> Any:
    """The widget, or what to do to get one."""
    if not has_widgets():
        return REMEDY
    try:
        return TOO_LARGE if any(map(_is_large, sources)) else show(*sources)
    except GvpipeError as exc:
        return str(exc)


def _is_large(source: Any) -> bool:
    """Whether a sequence takes long to encode; what files hold that are no videos is not looked at."""
    if isinstance(source, str | os.PathLike | list | tuple):
        return False
    if not isinstance(source, MeshSequence | Capture):
        return False
    shots = [source] if isinstance(source, MeshSequence) else source.shots
    return sum(shot.n_frames * shot.n_vertices for shot in shots) > MOST_SAMPLES and not is_ready(source, ERROR)


def _with_hint(still: str, hint: str) -> str:
    return f"{still}<div>{html.escape(hint)}</div>"
