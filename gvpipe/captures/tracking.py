"""Captures whose frames have meshes of their own, with long shots in their place: one mesh follows the surface."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import groupby

from gvpipe.captures.followed_frames import FollowedFrames
from gvpipe.captures.painting import left_of_looks, paint_names, picture_size, with_looks
from gvpipe.captures.sampled_fields import sampled_fields
from gvpipe.following import Run, follow
from gvpipe.following.follow import MAX_ERROR, RMS
from gvpipe.foundation.arrays import Array, Float64, Int32
from gvpipe.foundation.notes import count
from gvpipe.foundation.progress import Progress
from gvpipe.io.normals.own import are_smooth
from gvpipe.model.capture import Capture
from gvpipe.model.sequence import MeshSequence

LONG = 8  # frames of a shot that is kept as it is
SHARE = 0.6  # of a largest distance that is asked for: what following may use, and coding the rest
RMS_SHARE = 0.3  # of the same: the greatest rms
CODED_RMSE = 0.0005  # of vertices, part of the diagonal; most of it lies along the surface
CODED_LARGEST = 0.0025  # of vertices: what coding may always add; more, where following leaves more of `MAX_ERROR`
SURFACE_ALONE = "only the surface is followed"

Targets = tuple[float | None, float | None, float | None, float | str | None]
"""Largest rmse, KG error, bits per vertex and frame, and error of a vertex."""


@dataclass(frozen=True)
class Tracked:
    """A capture whose short shots were followed.

    Args:
        capture: the shots that there are now.
        keys: of each shot, the frame of the capture that its mesh comes from; None: it is as it came.
        largest: of each shot, the greatest distance between its surface and those of its frames, part of the diagonal.
        notes: what a user should know, a line each.
    """

    capture: Capture
    keys: tuple[int | None, ...]
    largest: tuple[float, ...]
    notes: tuple[str, ...]

    @property
    def is_any(self) -> bool:
        """Whether a shot was followed."""
        return any(key is not None for key in self.keys)


def coded_largest(followed: float) -> float:
    """The greatest error of a vertex that coding may add where nobody asks for another, part of the diagonal.

    Args:
        followed: the greatest distance that following leaves, part of the diagonal.
    """
    return max(MAX_ERROR - followed, CODED_LARGEST)


def coding_targets(targets: Targets, is_followed: bool) -> Targets:
    """The targets of coding: of a largest distance, the part that following leaves."""
    rmse, kg, bpvf, bound = targets
    if bound is None or not is_followed:
        return targets
    text = str(bound).strip()
    rest = (1 - SHARE) * float(text.removesuffix("%"))
    return rmse, kg, bpvf, f"{rest!r}%" if text.endswith("%") else rest


def is_tracked_by_default(capture: Capture) -> bool:
    """Whether most frames have a connectivity of their own, and following loses nothing of them.

    Fields would be sampled, which is not what who measures expects.
    """
    alone = sum(length == 1 for length in capture.lengths)
    if len(capture) <= 2 or 2 * alone <= len(capture):
        return False
    return not any(shot.fields for shot in capture.shots) and not _losses(capture)


def _losses(capture: Capture) -> list[str]:
    """What following leaves behind of any shot, by name."""
    painted = set().union(*map(paint_names, capture.shots))  # coordinates, also in a frame whose picture is missing
    return list(dict.fromkeys(name for shot in capture.shots for name in what_is_lost(shot) if name not in painted))


def what_is_lost(shot: MeshSequence) -> list[str]:
    """What following leaves behind of a shot, by name."""
    kept, normals = paint_names(shot), shot.attributes.get("normal")
    if normals is not None and are_smooth(normals, shot.read(0, 1)[0], shot.faces):
        kept.add("normal")  # those of the followed surface are as good
    lost = [name for name in shot.attributes if name not in kept]
    lost += [f"{len(shot.parts)} parts"] if len({part.name for part in shot.parts}) > 1 else []
    lost += left_of_looks(shot)
    lost += ["the volume"] if shot.volume is not None else []
    return lost


def track(capture: Capture, max_error: float | None, vertices: int | None, progress: Progress) -> Tracked:
    """Follow the surface through shots of fewer than `LONG` frames; longer ones stay as they are.

    Args:
        capture: what is followed.
        max_error: greatest distance of the decoded surface, part of the first frame's diagonal; None: that of `follow`.
        vertices: of each key mesh; None: as few as the distance allows.
        progress: called with ``"follow"``.

    Raises:
        InputError: a frame cannot be read.
        OutputError: the temporary folder is full.
    """
    bound = MAX_ERROR if max_error is None else SHARE * max_error
    rms = RMS if max_error is None else min(RMS, RMS_SHARE * max_error)
    shots: list[MeshSequence] = []
    keys: list[int | None] = []
    largest: list[float] = []
    losses: list[list[str]] = []
    progress("follow", 0.0)
    worst_rms, followed, size = 0.0, 0, (0, 0)
    for is_long, span in _stretches(capture):
        if is_long:
            shots += [capture.shots[number] for number in span]
            keys += [None] * len(span)
            largest += [0.0] * len(span)
            continue
        start, stop = capture.starts[span[0]], capture.starts[span[-1]] + capture.lengths[span[-1]]
        frames = CaptureFrames(capture.part(start, stop))
        for run in follow(frames, max_error=bound, rms=rms, vertices=vertices, progress=progress):
            keys.append(None if run.key is None else start + run.key)
            largest.append(0.0 if run.key is None else max(error.largest for error in run.errors))
            if run.key is None:
                shots.append(capture.frame(start + run.start))
            else:
                shot, lost = _shot(capture.part(start + run.start, start + run.stop), run, frames.origin)
                shots.append(shot)
                losses.append(lost)
                size = max(size, picture_size(shot))
                followed += run.stop - run.start
                worst_rms = max(worst_rms, *(error.rms for error in run.errors))
    notes = []
    if followed:
        runs = sum(key is not None for key in keys)
        distance = f"rms {worst_rms:.2g}, at most {max(largest):.2g} of the diagonal"
        alone = len(capture) - followed
        notes.append(
            f"{count(followed, 'frame')} follow {count(runs, 'key mesh', 'key meshes')}: {distance}; "
            f"{alone} are as they came (--track off: all)"
        )
        notes += [f"colours of each frame become textures that move, of up to {size[0]}x{size[1]} texels"] if size[0] else []
        left_out = dict.fromkeys(name for names in losses for name in names)
        notes += [f"{SURFACE_ALONE}; left out: {', '.join(left_out)}"] if left_out else []
    found = Capture(shots, capture.name, fps=capture.fps, lengths=[len(shot) for shot in shots], sound=capture.sound)
    return Tracked(found, tuple(keys), tuple(largest), tuple(notes))


class CaptureFrames:
    """The meshes of a capture's frames, positions relative to the first one's origin."""

    def __init__(self, capture: Capture) -> None:
        self._capture = capture
        self.origin = capture.shots[0].origin

    def __len__(self) -> int:
        return len(self._capture)

    def __getitem__(self, frame: int) -> tuple[Array, Int32]:
        number, own = self._capture.locate(frame)
        shot = self._capture.shots[number]
        return shot.read_absolute(own, own + 1)[0] - self.origin, shot.faces


def _stretches(capture: Capture) -> Iterator[tuple[bool, list[int]]]:
    """Numbers of shots in a row that are all long, or all short."""
    for is_long, numbers in groupby(range(len(capture.shots)), lambda number: capture.lengths[number] >= LONG):
        yield is_long, list(numbers)


def _shot(frames: Capture, run: Run, origin: Float64) -> tuple[MeshSequence, list[str]]:
    """A run with the looks and fields of its ``frames``, and names of what it leaves out of them."""
    first = frames.shots[0]
    metadata = first.metadata
    if metadata.times:
        times = tuple(float(frames.frame(k).times[0]) for k in range(len(frames)))
        metadata = replace(metadata, times=times)
    followed = FollowedFrames(frames, origin, run)
    fields = sampled_fields(followed)
    lost = _losses(frames)
    lost += dict.fromkeys(name for shot in frames.shots for name in shot.fields if name not in fields)
    not_carried = dict.fromkeys([*lost, *(name for shot in frames.shots for name in shot.not_carried)])
    notes = dict.fromkeys(note for shot in frames.shots for note in shot.notes)
    bare = MeshSequence(
        run.positions,
        run.faces,
        frames.fps,
        {},
        frames.name,
        origin,
        fields=fields,
        metadata=metadata,
        not_carried=tuple(not_carried),
        notes=tuple(notes),
    )
    return with_looks(bare, followed), lost
