"""How a page opens: field and colours, speed, displacements, a cut, camera, shading, as attributes of ``<geometry-video>``.

What is asked for is checked against the file when the page is written. Ranges that depend on values (percentiles, symmetric,
those of a log scale) are looked up then, over all frames, by the code that `gvpipe.render` uses. The page has their numbers.
"""

from __future__ import annotations

import html
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gvpipe.foundation.arguments import check_number, did_you_mean, show
from gvpipe.foundation.errors import InputError
from gvpipe.model.sequence import MeshSequence
from gvpipe.model.warp import movers, parse_warp
from gvpipe.rasterizer.camera import parse_view
from gvpipe.rasterizer.renderer import SHADINGS
from gvpipe.rendering.cut import AXES, parse_cut
from gvpipe.rendering.field_map import FieldMap
from gvpipe.rendering.field_range import Ends, Range, checked_range
from gvpipe.rendering.films import WITHOUT_FIELD

COLORMAPS = ("viridis", "magma", "coolwarm", "gray")  # that the player has
SLOWEST, FASTEST = 0.0625, 16.0  # that browsers play


@dataclass(frozen=True)
class PageView:
    """What a page shows when it opens.

    Args:
        field: whose values colours show; None: materials.
        colormap: one of `COLORMAPS`, or None for the player's own.
        limits: values of the first and the last colour, or None for the player's own.
        log: whether colours follow the logarithm.
        speed: of playing, `SLOWEST` to `FASTEST`; 1 is the video's own.
        warp: ``NAME`` or ``NAME:SCALE`` of a field that moves vertices, or None.
        clip: a plane that cuts the mesh, ``x=0.3`` in model units, or None.
        camera: azimuth and elevation, degrees, or None for the player's own.
        shading: one of `gvpipe.rasterizer.renderer.SHADINGS`.
        muted: whether it is silent until its reader asks for the sound: browsers start silent films alone.
    """

    field: str | None = None
    colormap: str | None = None
    limits: Ends | None = None
    log: bool = False
    speed: float = 1.0
    warp: str | None = None
    clip: str | None = None
    camera: tuple[float, float] | None = None
    shading: str = SHADINGS[0]
    muted: bool = False

    def attributes(self) -> str:
        """Attributes of the element, each with a space before it; nothing where all is as the player has it."""
        values = {
            "field": self.field,
            "colormap": self.colormap,
            "range": _numbers(self.limits),
            "scale": "log" if self.log else None,
            "speed": None if self.speed == 1 else _number(self.speed),
            "warp": self.warp,
            "clip": self.clip,
            "camera": _numbers(self.camera),
            "shading": None if self.shading == SHADINGS[0] else self.shading,
        }
        given = "".join(f' {name}="{html.escape(value)}"' for name, value in values.items() if value is not None)
        return given + (" muted" if self.muted else "")


def page_view(
    sequence: MeshSequence,
    *,
    field: str | None = None,
    colormap: str | None = None,
    field_range: Range = None,
    log: bool = False,
    speed: float = 1.0,
    warp: str | None = None,
    clip: str | None = None,
    camera: str | tuple[float, float] | None = None,
    shading: str = SHADINGS[0],
) -> PageView:
    """How a page of a sequence opens; `gvpipe.export_html` documents the arguments.

    Raises:
        InputError: there is no such field, or a value cannot be. The message names the sequence.
    """
    name = sequence.name
    if field is None and (colormap is not None or field_range is not None or log):
        raise InputError(f"{name}: {WITHOUT_FIELD}")
    if colormap is not None and colormap not in COLORMAPS:
        known = ", ".join(COLORMAPS)
        raise InputError(f"{name}: colormap {colormap!r}; pages have {known}{did_you_mean(colormap, COLORMAPS)}")
    check_number(speed, "speed")
    if not SLOWEST <= speed <= FASTEST:
        raise InputError(f"{name}: speed {speed:g}; browsers play at {SLOWEST:g} to {FASTEST:g} times a video's own speed")
    if shading not in SHADINGS:
        raise InputError(f"{name}: shading {shading!r}; {' or '.join(SHADINGS)} is needed")
    return PageView(
        field,
        colormap,
        None if field is None else _limits(sequence, field, field_range, log),
        log,
        float(speed),
        None if warp is None else _warp(sequence, warp),
        None if clip is None else _clip(sequence, clip),
        None if camera is None else _camera(name, camera),
        shading,
    )


def _limits(sequence: MeshSequence, field: str, limits: Range, log: bool) -> Ends | None:
    """The ends of the colours; None if the player knows them itself."""
    try:
        wanted = checked_range(limits, log=log)
    except InputError as exc:
        raise InputError(f"{sequence.name}: {exc}") from exc
    if isinstance(wanted, tuple):
        frames: list[int] = []  # none has to be read
    elif wanted is None and not log:
        frames, limits = [], (0.0, 1.0)
    else:
        frames = list(range(len(sequence)))
    found = FieldMap(sequence, field, frames, limits=limits, log=log).limits  # checks the name, too
    if wanted is None and not log:
        return None
    return found if found[0] < found[1] else None


def _warp(sequence: MeshSequence, text: str) -> str:
    """The attribute's value, in which the page finds the same name and scale as `gvpipe.model.warp`."""
    known = [name for name in movers(sequence) if name in sequence.fields]
    try:
        name, scale = (text, 1.0) if text in known else parse_warp(text)
    except InputError as exc:
        raise InputError(f"{sequence.name}: {exc}") from exc
    if name not in known:
        fields = ", ".join(map(repr, known)) or "none"
        message = f"{sequence.name} has no field of vectors {name!r} on its vertices to warp by; it has {fields}"
        raise InputError(f"{message}{did_you_mean(name, known)}")
    return text if text in known else f"{name}:{_number(scale)}"


def _clip(sequence: MeshSequence, text: str) -> str:
    """The attribute's value: a place in model units, where a part of the first frame's box may have been asked for."""
    try:
        cut = parse_cut(text)
    except InputError as exc:
        raise InputError(f"{sequence.name}: {exc}") from exc
    place = cut.place
    if cut.is_part:
        place = cut.at(sequence.read(0, 1)[0].astype(np.float64), sequence.origin) + float(sequence.origin[cut.axis])
    return f"{'-' if cut.sign < 0 else ''}{AXES[cut.axis]}={_number(place)}"


def _camera(name: str, camera: str | tuple[float, float]) -> tuple[float, float]:
    try:
        azimuth, elevation = map(float, parse_view(camera) if isinstance(camera, str) else camera)
    except InputError as exc:
        raise InputError(f"{name}: {exc}") from exc
    except (TypeError, ValueError) as exc:
        raise TypeError(f"camera is {show(camera)}; a view's name or (azimuth, elevation) is needed") from exc
    if not (math.isfinite(azimuth) and abs(elevation) <= 90):
        raise InputError(f"{name}: camera {azimuth:g},{elevation:g}; an azimuth and an elevation from -90 to 90 are needed")
    return azimuth, elevation


def _numbers(pair: tuple[float, float] | None) -> str | None:
    return None if pair is None else ",".join(map(_number, pair))


def _number(value: float) -> str:
    """Digits that give the number back, in Python and in JavaScript."""
    return repr(float(value)).removesuffix(".0")


def view_of_shots(
    shots: Sequence[MeshSequence], field: str | None, field_range: Range, warp: str | None, **options: Any
) -> PageView:
    """How the page opens: what is asked of fields is looked up in the shots that have them, and colours span all of these."""
    having = [shot for shot in shots if field in shot.fields] or [shots[0]]
    moving = next((shot for shot in shots if warp is not None and warp.partition(":")[0] in shot.fields), having[0])
    warped = page_view(moving, warp=warp).warp
    views = [page_view(shot, field=field, field_range=field_range, **options) for shot in having]
    ends = [view.limits for view in views if view.limits is not None]
    limits = (min(low for low, _ in ends), max(high for _, high in ends)) if ends else None
    return replace(views[0], limits=limits, warp=warped)
