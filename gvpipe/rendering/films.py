"""A sequence to a picture or a film: which frames, from where, in which file.

PNG is one frame, three samples a pixel and axis; GIF and MP4 play the motion, with two samples. A turntable lets the camera go
once around meanwhile. It repeats the motion until the turn lasts `TURN_SECONDS`, and ends one step before its start, so that it
loops. Frames are painted one at a time, and the file appears once it is complete.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from gvpipe.arrays import Float64, Int32, UInt8
from gvpipe.atomic import atomic_path
from gvpipe.codec import Progress
from gvpipe.errors import InputError
from gvpipe.rasterizer.camera import Camera, framing, middle_of, used_vertices
from gvpipe.rasterizer.renderer import Renderer, check_size
from gvpipe.rendering.error_map import ErrorMap
from gvpipe.rendering.picture_files import STILL, WRITERS
from gvpipe.sequence import MeshSequence

STILL_SAMPLES, FILM_SAMPLES = 3, 2  # per pixel and axis
TURN_SECONDS = 4.0  # a turntable's shortest turn


@dataclass(frozen=True)
class Film:
    """Pictures to paint, one after the other; ``[k]`` paints the k-th, ``(H, W, 3) uint8``, sRGB.

    Args:
        frames: the frame of each picture.
        camera: of the first picture.
        turntable: whether the camera goes once around.
        errors: whose values the colours show.
        legend: ``(H, w, 3) uint8``, a strip at the left.
        follow: whether the camera goes with the mesh.
    """

    sequence: MeshSequence
    frames: list[int]
    camera: Camera
    renderer: Renderer
    turntable: bool = False
    errors: ErrorMap | None = None
    legend: UInt8 | None = None
    follow: bool = False

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
            x, y, z = np.asarray(camera.target) + self._middle(self.frames[k]) - self._first_middle
            camera = replace(camera, target=(float(x), float(y), float(z)))
        return camera

    @cached_property
    def _first_middle(self) -> Float64:
        return self._middle(0)

    @cached_property
    def _used(self) -> Int32:
        return used_vertices(self.sequence)

    def _middle(self, frame: int) -> Float64:
        return middle_of(self.sequence.read(frame, frame + 1)[0], self._used)

    def __getitem__(self, k: int) -> UInt8:
        frame = self.frames[k]
        values = self.errors.values(frame) if self.errors else None
        picture = self.renderer.draw(self.sequence.read(frame, frame + 1)[0], self.camera_of(k), values)
        return picture if self.legend is None else np.concatenate([self.legend, picture], axis=1)


@dataclass(frozen=True)
class PictureOptions:
    """What to paint and how; `gvpipe.render` documents each.

    Args:
        frame: the only frame to paint, or None.
        size: width and height of the file's pictures, legend included, pixels.
        view: a name of `gvpipe.rasterizer.camera.VIEWS`, or azimuth and elevation, degrees.
        error_max: percent of the reference's diagonal, above 0, or None.
        camera: in place of the one that frames the whole motion from ``view``.

    Raises:
        InputError: an ``error_max`` that is not above 0.
    """

    frame: int | None = None
    size: tuple[int, int] = (512, 512)
    view: str | tuple[float, float] = "three-quarter"
    up: str = "y"
    turntable: bool = False
    follow: bool = False
    error_max: float | None = None
    shading: str = "smooth"
    camera: Camera | None = None

    def __post_init__(self) -> None:
        if self.error_max is not None and not (math.isfinite(self.error_max) and self.error_max > 0):
            raise InputError(f"the colours' end is {self.error_max} percent of the diagonal; a number above 0 is needed")


def write_pictures(
    sequence: MeshSequence,
    path: Path,
    options: PictureOptions,
    reference: MeshSequence | None = None,
    progress: Progress | None = None,
) -> None:
    """Paint a sequence as ``.png``, ``.gif`` or ``.mp4``; with a reference, in the colours of the errors.

    Raises:
        InputError: a value that cannot be, a sequence without triangles, a reference that does not fit.
        OutputError: the file cannot be written; no part of it is left.
    """
    suffix = check_output(path, options)
    if options.error_max is not None and reference is None:
        raise InputError("error_max ends the colours of errors; give error_of too")
    film = _plan(sequence, suffix, options, reference)
    with atomic_path(path) as temporary:
        WRITERS[suffix](film, temporary, progress)


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


def _plan(sequence: MeshSequence, suffix: str, options: PictureOptions, reference: MeshSequence | None) -> Film:
    """Which frames, from where, with which colours."""
    width, height = options.size
    frames = _frames(sequence, options.frame, suffix, options.turntable)
    errors, legend, across = None, None, width
    if reference is not None:
        errors = ErrorMap(reference, sequence, frames, options.error_max)
        sequence, legend = errors.sequence, errors.legend(options.size)
        across -= legend.shape[1]
    camera = options.camera or framing(
        sequence, None, options.view, options.up, across / height, options.turntable, follow=options.follow
    )
    samples = STILL_SAMPLES if suffix == STILL else FILM_SAMPLES
    renderer = Renderer(sequence.faces, sequence.read(0, 1)[0], (across, height), options.shading, samples)
    return Film(sequence, frames, camera, renderer, options.turntable, errors, legend, options.follow)


def _frames(sequence: MeshSequence, frame: int | None, suffix: str, turntable: bool) -> list[int]:
    count = len(sequence)
    if frame is not None and not -count <= frame < count:
        raise InputError(f"{sequence.name}: frame {frame} asked for; there are {count}, 0 to {count - 1} or -{count} to -1")
    frames = [(frame or 0) % count] if frame is not None or suffix == STILL else list(range(count))
    return frames * max(1, math.ceil(TURN_SECONDS * sequence.fps / len(frames))) if turntable else frames
