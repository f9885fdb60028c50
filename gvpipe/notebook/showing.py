"""``gvpipe.show``: an interactive player in a notebook."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from gvpipe.foundation.errors import InputError
from gvpipe.model.part_choice import only_parts
from gvpipe.notebook.libraries import check_widgets
from gvpipe.notebook.prepared import prepare
from gvpipe.notebook.progress_bar import ProgressBar
from gvpipe.rendering.field_range import Range
from gvpipe.web.export import AXES
from gvpipe.web.page_view import view_of_shots

if TYPE_CHECKING:
    from gvpipe.notebook.side_by_side import SideBySide
    from gvpipe.notebook.widget import PlayerWidget

ERROR = "0.1%"  # of the diagonal: less than a pixel of a player
HEIGHT = 420  # pixels
LONGEST_NAME = 80  # characters, beside the progress bar


def show(
    source: Any,
    *others: Any,
    field: str | None = None,
    colormap: str | None = None,
    field_range: Range = None,
    log: bool = False,
    speed: float = 1.0,
    warp: str | None = None,
    camera: str | tuple[float, float] | None = None,
    shading: str = "smooth",
    parts: str | Sequence[str] | None = None,
    up: str | None = None,
    autoplay: bool = True,
    loop: bool = True,
    height: int = HEIGHT,
    error: float | str = ERROR,
    embed: bool | None = None,
    unlimited: bool = False,
) -> PlayerWidget | SideBySide:
    """Show a geometry video, a sequence or a capture in a notebook: an interactive player, whose traits Python reads and sets.

    A geometry video is shown as it is. What is none is encoded by codec ``pca`` first, once; ``widget.note`` says its error.
    Of files above 8 MB the page fetches parts from the kernel when it needs them.

    Args:
        source: `Player`, `CapturePlayer`, `MeshSequence`, `Capture` or what `read_capture` takes, such as a path.
        others: to show beside it, with as many frames: they play and turn in step, as source and decoded.
        field, colormap, field_range, log, speed, warp, camera, shading: how it opens, as for `export_html`.
        parts: names of the parts to show; None: all.
        up: the axis that stands upright in the first view, ``"y"`` or ``"z"``; None: the file's own, else ``"y"``.
        autoplay: whether it plays at once.
        loop: whether it starts again at its end.
        height: of the player, pixels.
        error: most that a vertex may move by an encoding: model units, or a part of the diagonal such as ``"0.1%"``.
        embed: whether a saved notebook holds the player (0.7 MB) and the file; None: if the file has at most 4 MB.
        unlimited: as for `open`.

    Returns:
        An ipywidgets widget with traits ``frame``, ``playing``, ``speed``, ``field``, ``range``, ``camera`` and ``parts``. Of
        several sources: a box of such widgets, ``players``.

    Raises:
        InputError: anywidget is not installed, a source cannot be read, or it has no such field or part; sources differ in
            their number of frames.
        FormatError: it is no geometry video, or a damaged one.
        TypeError: the source is none of these.

    Examples:
        >>> player = gvpipe.show("crash.mp4", field="stress", colormap="magma")  # doctest: +SKIP
        >>> player.on_pick(lambda pick: print(pick.vertex, pick.values["stress"]))  # doctest: +SKIP
    """
    check_widgets()
    if up is not None and up not in AXES:
        raise InputError(f"up is {up!r}; one of {', '.join(AXES)} is needed")
    from gvpipe.notebook.side_by_side import SideBySide
    from gvpipe.notebook.widget import PlayerWidget

    names = None if parts is None else [parts] if isinstance(parts, str) else list(parts)
    players = []
    for given in (source, *others):
        bar = ProgressBar(str(getattr(given, "name", given))[:LONGEST_NAME])
        prepared = prepare(given, error, bar, unlimited=unlimited)
        bar.finish(prepared.note)
        if names is not None:
            only_parts(prepared.player.sequence(), names)
        options = {"colormap": colormap, "log": log, "speed": speed, "camera": camera, "shading": shading}
        view = view_of_shots(prepared.shots, field, field_range, warp, **options)
        players.append(PlayerWidget(prepared, view, names, up, autoplay, loop, height, embed))
    return SideBySide(players) if others else players[0]
