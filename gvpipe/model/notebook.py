"""What notebooks show of a sequence or a geometry video: an interactive player, or its first frame and its numbers as HTML.

The picture is inline PNG, so that a saved notebook needs no other file.
"""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Mapping
from importlib import import_module
from typing import TYPE_CHECKING, Any

from gvpipe.foundation.errors import GvpipeError
from gvpipe.foundation.text import escaped

if TYPE_CHECKING:
    from gvpipe.rasterizer.camera import Animation

SIZE = 240  # pixels, of both sides
SAMPLES = 3  # per pixel and axis
INTERACTIVE = "gvpipe.notebook.display"  # floors above this module, so it is known by its name, as codecs are


def mimebundle(shown: Any) -> dict[str, Any]:
    """What a notebook shows of the last line of a cell, by media type: a player, where there can be one, or ``_repr_html_``."""
    still: str = shown._repr_html_()
    shows: dict[str, Any] | None = import_module(INTERACTIVE).interactive(shown, still)
    return shows or {"text/html": still, "text/plain": repr(shown)}


def card(title: str, numbers: Mapping[str, str], sequence: Animation) -> str:
    """Return HTML with a title, named numbers, and a picture of the first frame if it can be painted."""
    cell = '<td style="text-align:left">{}</td>'
    rows = "".join(f"<tr>{cell.format(_safe(name))}{cell.format(_safe(value))}</tr>" for name, value in numbers.items())
    return (
        f'<div style="display:flex;align-items:center;gap:1em">{_picture(sequence)}'
        f"<div><b>{_safe(title)}</b><table>{rows}</table></div></div>"
    )


def _safe(text: str) -> str:
    return html.escape(escaped(text))


def png(sequence: Animation) -> bytes:
    """Return a PNG picture of the first frame from the renderer's usual view; raises `InputError` without triangles."""
    from PIL import Image

    from gvpipe.rasterizer.camera import framing
    from gvpipe.rasterizer.renderer import Renderer

    first = sequence.read(0, 1)[0]
    renderer = Renderer(sequence.faces, first, (SIZE, SIZE), samples=SAMPLES)
    file = io.BytesIO()
    Image.fromarray(renderer.draw(first, framing(sequence, [0]))).save(file, "PNG", optimize=True)
    return file.getvalue()


def _picture(sequence: Animation) -> str:
    try:
        data = base64.b64encode(png(sequence)).decode("ascii")
    except GvpipeError:  # no triangles, or a frame that cannot be read: the numbers are there still
        return ""
    return f'<img width="{SIZE}" height="{SIZE}" alt="first frame" src="data:image/png;base64,{data}">'
