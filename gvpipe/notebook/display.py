"""What a notebook shows of a sequence, a player or a report that is the last line of a cell."""

from __future__ import annotations

import html
from typing import Any

from gvpipe.foundation.errors import GvpipeError
from gvpipe.model.sequence import MeshSequence
from gvpipe.notebook.libraries import REMEDY, has_widgets, in_kernel
from gvpipe.notebook.prepared import is_ready
from gvpipe.notebook.showing import ERROR, show

MOST_SAMPLES = 8_000_000  # vertices times frames, of a sequence that is encoded unasked: some seconds
TOO_LARGE = "gvpipe.show(...) encodes it and plays it"


def interactive(shown: Any, still: str) -> dict[str, Any] | None:
    """Show a player, and return what a saved notebook keeps of it; None where nothing but text or a still can be shown.

    Args:
        shown: a sequence or a player.
        still: HTML that is shown, with what to do about it, where there is no player.
    """
    if not in_kernel():
        return None
    if not has_widgets():
        return _with_hint(still, REMEDY)
    is_large = isinstance(shown, MeshSequence) and shown.n_frames * shown.n_vertices > MOST_SAMPLES
    if is_large and not is_ready(shown, ERROR):
        return _with_hint(still, TOO_LARGE)
    try:
        return show(shown)._repr_mimebundle_()
    except GvpipeError as exc:
        return _with_hint(still, str(exc))


def _with_hint(still: str, hint: str) -> dict[str, Any]:
    return {"text/html": f"{still}<div>{html.escape(hint)}</div>"}
