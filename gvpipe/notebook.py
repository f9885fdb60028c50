"""What notebooks show of a sequence or a geometry video: its first frame and its numbers, as a piece of HTML.

The picture is inline PNG, so that a saved notebook needs no other file.
"""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Mapping

from gvpipe.arrays import Float32, Int32
from gvpipe.errors import GvpipeError
from gvpipe.notes import show_origin
from gvpipe.sequence import MeshSequence

SIZE = 240  # pixels, of both sides
SAMPLES = 3  # per pixel and axis


def card(title: str, numbers: Mapping[str, str], sequence: MeshSequence) -> str:
    """Return HTML with a title, named numbers, and a picture of the first frame if it can be painted."""
    rows = "".join(
        f'<tr><td style="text-align:left">{html.escape(name)}</td><td style="text-align:left">{html.escape(value)}</td></tr>'
        for name, value in numbers.items()
    )
    return (
        f'<div style="display:flex;align-items:center;gap:1em">{_picture(sequence)}'
        f"<div><b>{html.escape(title)}</b><table>{rows}</table></div></div>"
    )


def numbers_of(sequence: MeshSequence) -> dict[str, str]:
    """The numbers that every sequence has."""
    numbers = {
        "frames": f"{sequence.n_frames} at {sequence.fps:g} per second, {sequence.n_frames / sequence.fps:.4g} s",
        "vertices": str(sequence.n_vertices),
        "triangles": str(len(sequence.faces)),
    }
    if sequence.attributes:
        numbers["attributes"] = ", ".join(sequence.attributes)
    if sequence.origin.any():
        numbers["origin"] = show_origin(sequence.origin)
    return numbers


def png(positions: Float32, faces: Int32) -> bytes:
    """Return a PNG picture of ``positions (V, 3)`` from the renderer's usual view; raises `InputError` without triangles."""
    from PIL import Image

    from gvpipe.rasterizer.camera import framing
    from gvpipe.rasterizer.renderer import Renderer

    camera = framing(MeshSequence(positions[None], faces))
    picture = Renderer(faces, positions, (SIZE, SIZE), samples=SAMPLES).draw(positions, camera)
    file = io.BytesIO()
    Image.fromarray(picture).save(file, "PNG", optimize=True)
    return file.getvalue()


def _picture(sequence: MeshSequence) -> str:
    try:
        data = base64.b64encode(png(sequence[0], sequence.faces)).decode("ascii")
    except GvpipeError:  # no triangles, or a frame that cannot be read: the numbers are there still
        return ""
    return f'<img width="{SIZE}" height="{SIZE}" alt="first frame" src="data:image/png;base64,{data}">'
