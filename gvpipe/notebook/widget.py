"""The player as a widget. It needs anywidget, so nothing imports this module before a widget is asked for."""

from __future__ import annotations

import uuid
from collections.abc import Callable, Sequence
from typing import Any

import anywidget
import traitlets
from ipywidgets import CallbackDispatcher, Layout

from gvpipe.foundation.arguments import did_you_mean
from gvpipe.foundation.errors import GvpipeError, InputError
from gvpipe.notebook.module import module_text
from gvpipe.notebook.pick import Pick, read_pick
from gvpipe.notebook.prepared import Prepared
from gvpipe.notebook.saved import picture, saved_html
from gvpipe.web.export import AXES
from gvpipe.web.page_view import FASTEST, SLOWEST, PageView

WIDGET = "application/vnd.jupyter.widget-view+json"


class PlayerWidget(anywidget.AnyWidget):
    """An interactive player of a geometry video, as `gvpipe.show` makes it.

    Traits follow what users do, and players follow the traits, in Python and by ``ipywidgets.jslink``:

    - ``frame``: the frame that is shown. While it plays, it is told about eight times a second.
    - ``playing``: whether it plays.
    - ``speed``: 0.0625 to 16; 1 is the video's own.
    - ``field``: name of the field in colours, or None: materials.
    - ``range``: ``(low, high)`` of the colours, or None: the field's own.
    - ``camera``: ``(azimuth, elevation)``, degrees, or None: the first view.
    - ``parts``: names of the parts that are shown, or None: all.

    ``layout`` is that of ipywidgets: ``widget.layout.height = "600px"``.

    Args:
        prepared: what to show.
        view: how it opens.
        parts: names of the parts to show; None: all.
        up: the axis that stands upright, ``"y"`` or ``"z"``; None: the video's own, else ``"y"``.
        playing: whether it plays at once.
        loop: whether it starts again at its end.
        height: pixels.
        embed: whether a saved notebook holds the player and the file; None: if the file has at most 4 MB.
        is_growing: whether the file is still written, so that frames come.

    Raises:
        InputError: a trait is set to what the video has not.
    """

    frame = traitlets.Int(0).tag(sync=True)
    playing = traitlets.Bool(False).tag(sync=True)
    speed = traitlets.Float(1.0).tag(sync=True)
    field = traitlets.Unicode(None, allow_none=True).tag(sync=True)
    range = traitlets.Tuple(traitlets.Float(), traitlets.Float(), default_value=None, allow_none=True).tag(sync=True)
    camera = traitlets.Tuple(traitlets.Float(), traitlets.Float(), default_value=None, allow_none=True).tag(sync=True)
    parts = traitlets.List(traitlets.Unicode(), default_value=None, allow_none=True).tag(sync=True)
    name = traitlets.Unicode("").tag(sync=True)
    _attributes = traitlets.Dict().tag(sync=True)  # of the element, which stay
    _data = traitlets.Bytes(None, allow_none=True).tag(sync=True)  # the file; None: the page asks for parts of it
    _is_growing = traitlets.Bool(False).tag(sync=True)  # parts of the file come by `send_part`
    _version = traitlets.Int(0).tag(sync=True)  # counts files
    _saved_id = traitlets.Unicode("").tag(sync=True)

    def __init__(
        self,
        prepared: Prepared,
        view: PageView,
        parts: Sequence[str] | None = None,
        up: str | None = None,
        playing: bool = True,
        loop: bool = True,
        height: int = 420,
        embed: bool | None = None,
        is_growing: bool = False,
    ) -> None:
        self._esm = module_text()
        own = prepared.player.metadata.up_axis
        up = up or (own if own in AXES else AXES[0])
        self._prepared, self._view, self._up, self._height, self._embed = prepared, view, up, height, embed
        self._picked = CallbackDispatcher()
        kept = {"colormap": view.colormap, "scale": "log" if view.log else None, "warp": view.warp, "shading": view.shading}
        super().__init__(
            name=prepared.name,
            playing=playing,
            speed=view.speed,
            field=view.field,
            range=view.limits,
            camera=view.camera,
            parts=None if parts is None else list(parts),
            layout=Layout(width="100%", height=f"{height}px"),
            _attributes={"up": up, **{name: value for name, value in kept.items() if value}, **({"loop": ""} if loop else {})},
            _data=None if prepared.is_large and not is_growing else prepared.data(),
            _is_growing=is_growing,
            _saved_id=uuid.uuid4().hex,
        )
        self.on_msg(self._take)

    @property
    def note(self) -> str:
        """What was done to what was given to show it, such as an encoding and its error; "" for nothing."""
        return self._prepared.note

    @property
    def n_frames(self) -> int:
        """F, the number of frames."""
        return self._prepared.n_frames

    def show_instead(self, prepared: Prepared) -> None:
        """Show another file in place of this one, such as one that is finished, from its first frame on."""
        self._prepared = prepared
        with self.hold_sync():
            self._is_growing = False
            self.frame = 0
            self._data = None if prepared.is_large else prepared.data()
            self._version += 1

    def send_part(self, start: int, data: bytes) -> None:
        """Send a part of a file that grows, from byte ``start`` on, to pages that show it."""
        self.send({"kind": "part", "start": start}, buffers=[data])

    def on_pick(self, callback: Callable[[Pick], None], remove: bool = False) -> None:
        """Call a function with a `Pick` when a user clicks on the mesh, or no longer."""
        self._picked.register_callback(callback, remove=remove)

    @traitlets.validate("frame")
    def _check_frame(self, proposal: Any) -> int:
        frame: int = proposal["value"]
        n_frames = self._prepared.n_frames
        if self._is_growing and frame >= 0:
            return frame
        if not -n_frames <= frame < n_frames:
            raise InputError(f"frame {frame} of {self.name}: there are {n_frames}")
        return frame % n_frames

    @traitlets.validate("speed")
    def _check_speed(self, proposal: Any) -> float:
        speed: float = proposal["value"]
        if not SLOWEST <= speed <= FASTEST:
            raise InputError(f"speed {speed:g}; browsers play at {SLOWEST:g} to {FASTEST:g} times a video's own speed")
        return speed

    @traitlets.validate("field")
    def _check_field(self, proposal: Any) -> str | None:
        field: str | None = proposal["value"]
        if field is None:
            return None
        known = dict.fromkeys(name for shot in self._prepared.shots for name in shot.fields)
        return _known(field, known, f"{self.name} has no field")

    @traitlets.validate("range")
    def _check_range(self, proposal: Any) -> tuple[float, float] | None:
        limits: tuple[float, float] | None = proposal["value"]
        if limits is not None and not limits[0] < limits[1]:
            raise InputError(f"range is {limits}; (low, high) with low < high is needed")
        return limits

    @traitlets.validate("camera")
    def _check_camera(self, proposal: Any) -> tuple[float, float] | None:
        camera: tuple[float, float] | None = proposal["value"]
        if camera is not None and not abs(camera[1]) <= 90:
            raise InputError(f"camera is {camera}; (azimuth, elevation) in degrees is needed, the elevation from -90 to 90")
        return camera

    @traitlets.validate("parts")
    def _check_parts(self, proposal: Any) -> list[str] | None:
        names: list[str] | None = proposal["value"]
        known = dict.fromkeys(part.name for part in self._prepared.player.parts)
        return names if names is None else [_known(name, known, f"{self.name} has no part") for name in names]

    def _take(self, _: Any, message: Any, __: Any) -> None:
        """Answer a page: with bytes of the file, or by calls of who wants to know of picks."""
        kind = message.get("kind") if isinstance(message, dict) else None
        if kind == "range":
            self._send_range(message)
        elif kind == "pick" and (pick := read_pick(self._prepared, message)):
            self._picked(pick)

    def _send_range(self, message: dict[str, Any]) -> None:
        answer = {"kind": "range", "number": message.get("number"), "size": self._prepared.source.size}
        try:
            data = read_range(self._prepared, message.get("start"), message.get("stop"))
        except GvpipeError as exc:
            self.send({**answer, "error": str(exc)})
        else:
            self.send(answer, buffers=[data])

    def saved(self) -> dict[str, Any]:
        """What a notebook keeps of it, by media type: HTML with a still and the player, and the still as PNG."""
        still = picture(self._prepared)
        kept = saved_html(self._prepared, self._view, self._up, self._saved_id, still, self._height, self._embed)
        bundle: dict[str, Any] = {"text/html": kept, "text/plain": repr(self)}
        return bundle if still is None else {**bundle, "image/png": still}

    def _repr_mimebundle_(self, **_: Any) -> dict[str, Any]:
        show_widget(self)
        return self.saved()

    def __repr__(self) -> str:
        return f"<PlayerWidget {self.name}: frame {self.frame} of {self._prepared.n_frames}>"


def show_widget(widget: Any) -> None:
    """Show a widget in an output of its own, above the one that is kept for saved notebooks.

    Viewers show of one output what they like best: the widget, even where there is no kernel to draw it.
    """
    from IPython.display import display

    view = {"version_major": 2, "version_minor": 0, "model_id": widget.model_id}
    display({WIDGET: view, "text/plain": repr(widget)}, raw=True)


def read_range(prepared: Prepared, start: Any, stop: Any) -> bytes:
    """Bytes of the file that a page asks for, fewer where it ends before.

    Raises:
        InputError: it asks for what cannot be.
        FormatError: the file has changed.
    """
    size = prepared.source.size
    stop = max(size, start) if stop is None and isinstance(start, int) else stop
    if not (isinstance(start, int) and isinstance(stop, int) and 0 <= start <= stop):
        raise InputError(f"bytes {start} to {stop} were asked for; show the player again")
    return prepared.source.read(start, min(stop, size) - start) if start < size else b""


def _known(name: str, known: Any, what: str) -> str:
    if name not in known:
        listed = ", ".join(map(repr, known)) or "none"
        raise InputError(f"{what} {name!r}; it has {listed}{did_you_mean(name, list(known))}")
    return name
