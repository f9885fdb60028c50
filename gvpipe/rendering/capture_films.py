"""Pictures of a capture: those of its shots, by one camera and on one scale of colours."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from gvpipe.foundation.arrays import Float64, UInt8
from gvpipe.foundation.atomic import unnamed_path
from gvpipe.foundation.errors import InputError
from gvpipe.foundation.progress import Progress
from gvpipe.model.capture import Capture
from gvpipe.model.frame_views import Shifted
from gvpipe.model.part_choice import only_parts
from gvpipe.model.sequence import MeshSequence
from gvpipe.rasterizer.camera import Animation, Camera, framing, sampled
from gvpipe.rendering.cut import AXES, parse_cut
from gvpipe.rendering.field_map import FieldMap
from gvpipe.rendering.field_range import checked_range, ends_of
from gvpipe.rendering.films import Film, PictureOptions, check_output, drawn_frames, plan_film
from gvpipe.rendering.picture_files import WRITERS


def write_capture_pictures(
    capture: Capture, path: Path, options: PictureOptions, progress: Progress | None = None
) -> tuple[str, ...]:
    """Paint a capture as ``.png``, ``.gif`` or ``.mp4``, as `gvpipe.rendering.films.write_pictures` does a sequence.

    Raises:
        InputError: a value that cannot be, a shot without triangles, an unknown field or part.
        OutputError: the file cannot be written; no part of it is left.
    """
    suffix = check_output(path, options)
    film = CaptureFilm(capture, drawn_frames(capture, options.frame, suffix, options.turntable), suffix, options)
    with unnamed_path(path) as temporary:
        WRITERS[suffix](film, temporary, progress)
    return tuple(film.notes)


class CaptureFilm:
    """Pictures of frames of a capture, painted when they are asked for; ``[k]`` is ``(H, W, 3) uint8``, sRGB.

    Args:
        capture: its shots.
        frames: of the capture, one for each picture.
        suffix: of the file.
        options: what to paint and how; ranges and planes that follow from frames follow from all of the capture's.

    Raises:
        InputError: as `write_capture_pictures`.
    """

    def __init__(self, capture: Capture, frames: list[int], suffix: str, options: PictureOptions) -> None:
        self.fps, self.notes = capture.fps, dict[str, None]()
        self._capture, self._frames, self._suffix = capture, frames, suffix
        first = self._shot(0, options)
        if options.cut is not None and (plane := parse_cut(options.cut)).is_part:
            place = plane.at(first.read(0, 1)[0].astype(np.float64), first.origin) + first.origin[plane.axis]
            options = replace(options, cut=f"{'-' if plane.sign < 0 else ''}{AXES[plane.axis]}={place!r}")
        if options.field is not None:
            options = replace(options, limits=self._limits(options))
        self._options = options
        self._up = options.up or first.metadata.up_axis or "y"
        self._number, self._film = 0, self._planned(0, first, Camera(up=self._up))
        width, height = options.size
        legend = self._film.legend
        across = width - (0 if legend is None else legend.shape[1])
        shots: list[Animation] = [self._shot(number, options) for number in sampled(range(len(capture.shots)))]
        self._camera = options.camera or framing(
            shots, None, options.view, self._up, across / height, options.turntable, follow=options.follow
        )
        self._start = self._film.middle(0) if options.follow else np.zeros(3)

    def __len__(self) -> int:
        return len(self._frames)

    def __getitem__(self, k: int) -> UInt8:
        number, own = self._capture.locate(self._frames[k])
        if number != self._number:
            self._number, self._film = number, self._planned(number, self._shot(number, self._options), self._camera)
        camera = self._camera
        if self._options.turntable:
            camera = replace(camera, azimuth=camera.azimuth + 360.0 * k / len(self))
        if self._options.follow:
            x, y, z = np.asarray(camera.target) + self._film.middle(own) - self._start
            camera = replace(camera, target=(float(x), float(y), float(z)))
        picture = self._film.paint(own, camera)
        self.notes |= dict.fromkeys(self._film.notes)
        return picture

    def _shot(self, number: int, options: PictureOptions) -> MeshSequence:
        """A shot with positions relative to the first's origin, and the parts that are painted."""
        shot, origin = self._capture.shots[number], self._capture.shots[0].origin
        if not np.array_equal(shot.origin, origin):
            shot = shot.reading_from(Shifted(shot.positions, shot.origin - origin), None, origin=origin)
        return only_parts(shot, options.parts) if options.parts else shot

    def _planned(self, number: int, shot: MeshSequence, camera: Camera) -> Film:
        own = replace(self._options, parts=(), camera=camera, turntable=False, follow=False)
        start = self._capture.starts[number]
        wanted = [frame - start for frame in self._frames if 0 <= frame - start < len(shot)]
        return plan_film(shot, sorted(set(wanted)) or [0], self._suffix, own)

    def _limits(self, options: PictureOptions) -> tuple[float, float]:
        """The ends of a field's colours, from all frames that are drawn."""
        wanted = checked_range(options.limits, log=options.log)
        if isinstance(wanted, tuple):
            return wanted
        name, found = options.field or "", dict[int, FieldMap]()

        def numbers(frame: int) -> Float64:
            number, own = self._capture.locate(frame)
            if number not in found:
                found.clear()
                found[number] = FieldMap(self._shot(number, options), name, [], limits=(1.0, 2.0), log=options.log)
            return found[number].drawn(own)

        ends = ends_of(numbers, self._frames, wanted)
        if ends is None and options.log:
            raise InputError(f"{self._capture.name}: field {name!r} has no value above 0 to show; leave out the log scale")
        return ends or (0.0, 0.0)
