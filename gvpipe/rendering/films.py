"""A sequence to a picture or a film: which frames, from where, in which file.

PNG is one frame, three samples a pixel and axis. GIF and MP4 play the motion (two samples); a turntable lets the camera go once
around meanwhile, repeats the motion until the turn lasts `TURN_SECONDS`, and ends one step before its start, so that it loops.
Frames are painted one at a time, and the file appears once it is complete.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from gvpipe.arrays import Float64, Int32, UInt8
from gvpipe.atomic import atomic_path
from gvpipe.codec import Progress
from gvpipe.errors import InputError
from gvpipe.rasterizer.camera import Camera, framing, middle_of, used_vertices
from gvpipe.rasterizer.renderer import Renderer
from gvpipe.rendering.error_map import ErrorMap
from gvpipe.sequence import MeshSequence

SUFFIXES = (".png", ".gif", ".mp4")
STILL_SAMPLES, FILM_SAMPLES = 3, 2  # per pixel and axis
TURN_SECONDS = 4.0  # a turntable's shortest turn
GIF_FPS = 50.0  # browsers slow down GIFs that are faster
PALETTE_FRAMES = 6  # pictures that a GIF's one palette is made from


@dataclass(frozen=True)
class Film:
    """Pictures to paint: the frame and the azimuth of each; ``len``, and ``[k]`` paints the k-th, ``(H, W, 3) uint8``."""

    sequence: MeshSequence
    frames: list[int]
    camera: Camera
    renderer: Renderer
    turntable: bool = False
    errors: ErrorMap | None = None
    legend: UInt8 | None = None  # a strip at the left
    follow: bool = False  # whether the camera goes with the mesh

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


def write_pictures(
    sequence: MeshSequence,
    path: Path,
    *,
    frame: int | None,
    size: tuple[int, int],
    view: str | tuple[float, float],
    up: str,
    turntable: bool,
    follow: bool,
    reference: MeshSequence | None,
    error_max: float | None,
    shading: str,
    camera: Camera | None,
    progress: Progress | None,
) -> None:
    """Paint a sequence as ``.png``, ``.gif`` or ``.mp4``; the arguments are those of `gvpipe.render`.

    Raises:
        InputError: a value that cannot be, a sequence without triangles, a reference that does not fit.
        OutputError: the file cannot be written; no part of it is left.
    """
    suffix = check_output(path, size, turntable, error_max)
    width, height = size
    frames = _frames(sequence, frame, suffix, turntable)
    errors, legend, across = None, None, width
    if reference is not None:
        errors = ErrorMap(reference, sequence, frames, error_max)
        sequence, legend = errors.sequence, errors.legend((width, height))
        across -= legend.shape[1]
    camera = camera or framing(sequence, None, view, up, across / height, turntable, follow=follow)
    samples = STILL_SAMPLES if suffix == ".png" else FILM_SAMPLES
    renderer = Renderer(sequence.faces, sequence.read(0, 1)[0], (across, height), shading, samples)
    film = Film(sequence, frames, camera, renderer, turntable, errors, legend, follow)
    with atomic_path(path) as temporary:
        WRITERS[suffix](film, temporary, progress)


def check_output(path: Path, size: tuple[int, int], turntable: bool, error_max: float | None) -> str:
    """Return the path's suffix; raises `InputError` for a file or picture that cannot be made."""
    suffix = _checked_suffix(path, turntable)
    width, height = size
    if suffix == ".mp4" and (width % 2 or height % 2):
        raise InputError(f"a picture of {width}x{height}; MP4 needs even sides")
    if error_max is not None and not (np.isfinite(error_max) and error_max > 0):
        raise InputError(f"the colours' end is {error_max} percent of the diagonal; a number above 0 is needed")
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


def _checked_suffix(path: Path, turntable: bool) -> str:
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise InputError(f"{path}: pictures are written as {', '.join(SUFFIXES)}; end the name in one of them")
    if turntable and suffix == ".png":
        raise InputError(f"{path}: a turntable moves; end the name in .gif or .mp4")
    return suffix


def _frames(sequence: MeshSequence, frame: int | None, suffix: str, turntable: bool) -> list[int]:
    count = len(sequence)
    if frame is not None and not -count <= frame < count:
        raise InputError(f"{sequence.name}: frame {frame} asked for; there are {count}, 0 to {count - 1} or -{count} to -1")
    frames = [(frame or 0) % count] if frame is not None or suffix == ".png" else list(range(count))
    return frames * max(1, math.ceil(TURN_SECONDS * sequence.fps / len(frames))) if turntable else frames


def _painted(film: Film, progress: Progress | None, step: int = 1) -> Iterator[UInt8]:
    for k in range(0, len(film), step):
        yield film[k]
        if progress:
            progress("render", min(1.0, (k + step) / len(film)))


def _write_png(film: Film, path: Path, progress: Progress | None) -> None:
    from PIL import Image

    for picture in _painted(film, progress):
        Image.fromarray(picture).save(path, optimize=True)


def _write_gif(film: Film, path: Path, progress: Progress | None) -> None:
    from PIL import Image

    step = math.ceil(film.sequence.fps / GIF_FPS)
    count = len(range(0, len(film), step))
    # GIF counts in hundredths of a second: every picture ends at the hundredth nearest to its time
    ends = np.rint(np.arange(1, count + 1) * step * 100 / film.sequence.fps).astype(int)
    durations = np.maximum(np.diff(ends, prepend=0), 1) * 10
    some = np.unique(np.linspace(0, len(film) - 1, PALETTE_FRAMES).round().astype(int)).tolist()
    palette = Image.fromarray(np.concatenate([film[k] for k in some])).quantize(256, Image.Quantize.MEDIANCUT)
    pictures = (
        Image.fromarray(picture).quantize(palette=palette, dither=Image.Dither.NONE)
        for picture in _painted(film, progress, step)
    )
    first = next(pictures)
    first.save(path, save_all=True, append_images=pictures, duration=durations.tolist(), loop=0, disposal=1)


def _write_mp4(film: Film, path: Path, progress: Progress | None) -> None:
    from gvpipe.media.film import write_film

    write_film(path, _painted(film, progress), film.sequence.fps)


WRITERS: dict[str, Callable[[Film, Path, Progress | None], None]] = {
    ".png": _write_png,
    ".gif": _write_gif,
    ".mp4": _write_mp4,
}
