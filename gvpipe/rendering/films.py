"""A sequence to a picture or a film: which frames, from where, in which file.

PNG is one frame, three samples a pixel and axis; GIF and MP4 play the motion, with two samples. A turntable lets the camera go
once around meanwhile. It repeats the motion until the turn lasts `TURN_SECONDS`, and ends one step before its start, so that it
loops. Frames are painted one at a time, and the file appears once it is complete.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

import numpy as np

from gvpipe.foundation.arrays import Float64, Int32, UInt8
from gvpipe.foundation.atomic import unnamed_path
from gvpipe.foundation.errors import InputError
from gvpipe.foundation.progress import Progress
from gvpipe.model.capture import Capture
from gvpipe.model.part_choice import only_parts
from gvpipe.model.sequence import MeshSequence
from gvpipe.rasterizer.camera import Camera, framing, middle_of, used_vertices
from gvpipe.rasterizer.renderer import Renderer, check_size
from gvpipe.rendering.cut import parse_cut
from gvpipe.rendering.cut_scene import CutLook, CutScene
from gvpipe.rendering.error_map import ErrorMap
from gvpipe.rendering.field_map import FieldMap
from gvpipe.rendering.field_range import Range, checked_range
from gvpipe.rendering.legend import widen_for_time, write_time
from gvpipe.rendering.picture_files import STILL, WRITERS
from gvpipe.runtime.forks import kept

STILL_SAMPLES, FILM_SAMPLES = 3, 2  # per pixel and axis
TURN_SECONDS = 4.0  # a turntable's shortest turn
DEFAULT_COLORMAP = "viridis"
WITHOUT_FIELD = "a colour map, a range or a log scale is given without a field; name one (field, --field)"


class ColourMap(Protocol):
    """Values that colours show: errors, or a field."""

    def values(self, frame: int) -> Float64:
        """``(V,)``, or ``(T, 1)`` of triangles, in 0..1."""
        ...

    def legend(self, size: tuple[int, int]) -> UInt8:
        """``(H, w, 3) uint8``, a strip at the left of a picture of ``size``."""
        ...


@dataclass(frozen=True)
class Film:
    """Pictures to paint, one after the other; ``[k]`` paints the k-th, ``(H, W, 3) uint8``, sRGB.

    Args:
        frames: the frame of each picture.
        camera: of the first picture.
        turntable: whether the camera goes once around.
        shown: whose values the colours show, in place of materials.
        legend: ``(H, w, 3) uint8``, a strip at the left.
        follow: whether the camera goes with the mesh.
        cut: by a plane, in place of the renderer; one of both is there.
    """

    sequence: MeshSequence
    frames: list[int]
    camera: Camera
    renderer: Renderer | None
    turntable: bool = False
    shown: ColourMap | None = None
    legend: UInt8 | None = None
    follow: bool = False
    cut: CutScene | None = None

    @property
    def notes(self) -> tuple[str, ...]:
        """What a user should know, a line each."""
        return () if self.renderer is None else self.renderer.notes

    @property
    def fps(self) -> float:
        """Frames per second."""
        return self.sequence.fps

    def __len__(self) -> int:
        return len(self.frames)

    def camera_of(self, k: int) -> Camera:
        """The camera of the k-th picture."""
        camera = self.camera
        if self.turntable:
            camera = replace(camera, azimuth=camera.azimuth + 360.0 * k / len(self))
        if self.follow:
            x, y, z = np.asarray(camera.target) + self.middle(self.frames[k]) - self._first_middle
            camera = replace(camera, target=(float(x), float(y), float(z)))
        return camera

    @kept
    def _first_middle(self) -> Float64:
        return self.middle(0)

    @kept
    def _used(self) -> Int32:
        return used_vertices(self.sequence)

    def middle(self, frame: int) -> Float64:
        """``(3,)`` mean of a frame's vertices that triangles use."""
        return middle_of(self.sequence.read(frame, frame + 1)[0], self._used)

    def __getitem__(self, k: int) -> UInt8:
        return self.paint(self.frames[k], self.camera_of(k))

    def paint(self, frame: int, camera: Camera) -> UInt8:
        """A frame of the sequence, with its legend."""
        if self.renderer is None:
            assert self.cut is not None
            picture = self.cut.draw(frame, camera)
        else:
            values = self.shown.values(frame) if self.shown else None
            picture = self.renderer.draw(self.sequence.read(frame, frame + 1)[0], camera, values, frame)
        if self.legend is None:
            return picture
        legend = self.legend
        if self.sequence.metadata.times:
            height, across, _ = picture.shape
            legend = write_time(legend, (across + legend.shape[1], height), self.sequence.times[frame])
        return np.concatenate([legend, picture], axis=1)


@dataclass(frozen=True)
class PictureOptions:
    """What to paint and how; `gvpipe.render` documents each.

    Args:
        frame: the only frame to paint, or None.
        size: width and height of the file's pictures, legend included, pixels.
        view: a name of `gvpipe.rasterizer.camera.VIEWS`, or azimuth and elevation, degrees.
        error_max: percent of the reference's diagonal, above 0, or None.
        camera: in place of the one that frames the whole motion from ``view``.
        up: the world's axis that is up; None: the sequence's own, else y.
        field: the name of a field whose values colours show, or None.
        colormap: of the field, or None for `DEFAULT_COLORMAP`.
        limits: of the field's colours; see `gvpipe.rendering.field_map.FieldMap`.
        log: whether the field's colours follow the logarithm.
        parts: names of the parts to paint; none: all.
        plain: leave out materials and colours.
        cut: a plane (`gvpipe.rendering.cut.parse_cut`); what lies above it is left out.

    Raises:
        InputError: an ``error_max`` that is not above 0; a field beside errors; a colour map, a range or a log scale without
            a field; a range that cannot be.
    """

    frame: int | None = None
    size: tuple[int, int] = (512, 512)
    view: str | tuple[float, float] = "three-quarter"
    up: str | None = None
    turntable: bool = False
    follow: bool = False
    error_max: float | None = None
    shading: str = "smooth"
    camera: Camera | None = None
    field: str | None = None
    colormap: str | None = None
    limits: Range = None
    log: bool = False
    parts: tuple[str, ...] = ()
    plain: bool = False
    cut: str | None = None

    def __post_init__(self) -> None:
        if self.error_max is not None and not (math.isfinite(self.error_max) and self.error_max > 0):
            raise InputError(f"the colours' end is {self.error_max} percent of the diagonal; a number above 0 is needed")
        if self.field is None and (self.colormap is not None or self.limits is not None or self.log):
            raise InputError(WITHOUT_FIELD)
        checked_range(self.limits, log=self.log)


def write_pictures(
    sequence: MeshSequence,
    path: Path,
    options: PictureOptions,
    reference: MeshSequence | None = None,
    progress: Progress | None = None,
) -> tuple[str, ...]:
    """Paint a sequence as ``.png``, ``.gif`` or ``.mp4``; with a reference, in the colours of the errors. Return notes.

    Raises:
        InputError: a value that cannot be, no triangles, a reference that does not fit, an unknown field or part.
        OutputError: the file cannot be written; no part of it is left.
    """
    suffix = check_output(path, options)
    if options.error_max is not None and reference is None:
        raise InputError("error_max ends the colours of errors; give error_of too")
    film = plan_film(sequence, drawn_frames(sequence, options.frame, suffix, options.turntable), suffix, options, reference)
    with unnamed_path(path) as temporary:
        WRITERS[suffix](film, temporary, progress)
    return film.notes


def check_output(path: Path, options: PictureOptions) -> str:
    """Return the path's suffix; raises `InputError` for a file that cannot be made with these options."""
    suffix = path.suffix.lower()
    if suffix not in WRITERS:
        raise InputError(f"{path}: pictures are written as {', '.join(WRITERS)}; end the name in one of them")
    if options.turntable and suffix == STILL:
        raise InputError(f"{path}: a turntable moves; end the name in .gif or .mp4")
    width, height = options.size
    check_size(options.size)
    if suffix == ".mp4" and (width % 2 or height % 2):
        raise InputError(f"a picture of {width}x{height}; MP4 needs even sides")
    return suffix


def parse_size(text: str) -> tuple[int, int]:
    """Return width and height of ``"512"`` or ``"640x480"``.

    Raises:
        InputError: neither.
    """
    parts = text.lower().split("x")
    if len(parts) > 2 or not all(part.isdecimal() for part in parts):
        raise InputError(f"size {text!r}: pixels such as 512 or 640x480 are needed")
    return int(parts[0]), int(parts[-1])


def plan_film(
    sequence: MeshSequence, frames: list[int], suffix: str, options: PictureOptions, reference: MeshSequence | None = None
) -> Film:
    """From where frames are painted, and with which colours; raises `InputError` as `write_pictures`."""
    (across, height), colors = options.size, "errors"
    shown: ColourMap | None = None
    if reference is not None:
        if options.field is not None:
            raise InputError(f"both the field {options.field!r} and errors are asked for; colours can show one of them")
        errors = ErrorMap(reference, sequence, frames, options.error_max)
        shown, sequence = errors, errors.sequence
    if options.parts:
        sequence = only_parts(sequence, options.parts)
    if options.field is not None:
        colors = options.colormap or DEFAULT_COLORMAP
        shown = FieldMap(sequence, options.field, frames, colors, options.limits, log=options.log)
    legend = shown.legend(options.size) if shown else None
    if legend is not None and sequence.metadata.times:
        legend = widen_for_time(legend, options.size)
    across -= 0 if legend is None else legend.shape[1]
    up = options.up or sequence.metadata.up_axis or "y"
    camera = options.camera or framing(
        sequence, None, options.view, up, across / height, options.turntable, follow=options.follow
    )
    samples = STILL_SAMPLES if suffix == STILL else FILM_SAMPLES
    plain = options.plain or shown is not None
    renderer = cut = None
    if options.cut is None:
        renderer = Renderer.of(sequence, (across, height), options.shading, samples, plain=plain, colors=colors)
    else:
        if reference is not None:
            raise InputError("a plane and errors are asked for; leave one of both out")
        look = CutLook((across, height), options.shading, samples, colors)
        cut = CutScene(sequence, parse_cut(options.cut), look, shown if isinstance(shown, FieldMap) else None)
    return Film(sequence, frames, camera, renderer, options.turntable, shown, legend, options.follow, cut)


def drawn_frames(sequence: MeshSequence | Capture, frame: int | None, suffix: str, turntable: bool) -> list[int]:
    """The frame of each picture; raises `InputError` if there is no such frame."""
    count = len(sequence)
    if frame is not None and not -count <= frame < count:
        raise InputError(f"{sequence.name}: frame {frame} asked for; there are {count}, 0 to {count - 1} or -{count} to -1")
    frames = [(frame or 0) % count] if frame is not None or suffix == STILL else list(range(count))
    return frames * max(1, math.ceil(TURN_SECONDS * sequence.fps / len(frames))) if turntable else frames
