"""A file that holds all time steps of a simulation, as a sequence whose frames are read when they are asked for.

1. The surface of the first frame read is found once. Every other step must have the same cells.
2. Numbers that are the same in all steps become attributes, the others fields; a few steps are compared before all are.
"""

from __future__ import annotations

import contextlib
from pathlib import Path

from gvpipe.asset.attribute import Attribute
from gvpipe.asset.field import Field
from gvpipe.asset.metadata import Metadata
from gvpipe.foundation.errors import InputError
from gvpipe.io.damage import reading
from gvpipe.io.mesh import too_wide
from gvpipe.io.options import ReadOptions
from gvpipe.io.simulation.dataset import block_parts, surface_values
from gvpipe.io.simulation.fill_values import fill_notes
from gvpipe.io.simulation.step_frames import StepColumn, StepFrames, Steps, is_still, sampled_frames
from gvpipe.io.simulation.times import empty_note, time_steps
from gvpipe.io.simulation.volumes import read_volume
from gvpipe.model.sequence import MeshSequence


def read_steps(steps: Steps, path: Path, options: ReadOptions, notes: tuple[str, ...] = (), up: str = "") -> MeshSequence:
    """Return the surface of a simulation as a sequence.

    Args:
        steps: of the file.
        path: of the file.
        options: ``fps``, ``frames``, those of the file that are read, and ``volume``.
        notes: of the reader.
        up: axis, where the format says so.

    Raises:
        InputError: no step, or the first frame cannot be read.
    """
    first, stop = options.span(steps.n_steps, str(path))
    if options.frames is None:
        first, empty = _without_empty(steps, first, stop, path)
        notes = (*notes, *empty)
    frames = StepFrames(steps, first, stop, path, options.memory is not None)
    stop = first + len(frames)
    attributes, fields, left = _split(frames, str(path))
    volume = read_volume(frames, [*attributes, *fields]) if options.volume else None
    left_inside = frames.surface.not_carried if volume is None else frames.surface.without_inside
    times = steps.times
    timing = time_steps(None if times is None else times[first:stop], stop - first, options.fps, options.real_time)
    return MeshSequence(
        frames,
        frames.surface.faces,
        timing.fps,
        attributes,
        str(path),
        frames.origin,
        (*notes, *frames.first.notes, *timing.notes, *fill_notes(attributes, fields)),
        fields,
        block_parts(frames.first, frames.surface),
        frames.surface.polygons,
        metadata=Metadata(up, None, timing.start, path.name, times=timing.times),
        not_carried=(*frames.first.not_carried, *left_inside, *too_wide(left), *_late_names(frames)),
        volume=volume,
    )


def _without_empty(steps: Steps, first: int, stop: int, path: Path) -> tuple[int, tuple[str, ...]]:
    """The first step that has cells, and a note if those before it have none."""
    start = first
    while first < stop - 1:
        with reading(path, "", f"frame {first}"):
            if len(steps.open(first).cells().types):
                break
        first += 1
    return first, empty_note(first - start)


def _split(frames: StepFrames, where: str) -> tuple[dict[str, Attribute], dict[str, Field], list[str]]:
    """Attributes, fields, and the names of what is neither."""
    attributes, fields, left = {}, {}, []
    for name, read in frames.values.items():
        first = frames.guarded(0, read)
        if not first.can_be_held:
            left.append(name)
        elif is_still(frames, name, first.values):
            attributes[name] = Attribute(first.values, first.domain, first.kind, unit=first.unit, name=f"{where}: {name}")
        else:
            column = StepColumn(frames, name, first.values)
            fields[name] = Field(column, first.domain, first.kind, first.unit, name=f"{where}: field {name!r}")
    return attributes, fields, left


def _late_names(frames: StepFrames) -> list[str]:
    """Numbers that the first frame lacks and one of some others has."""
    names: set[str] = set()
    for frame in sampled_frames(frames):
        with contextlib.suppress(InputError):  # which whoever asks for that frame gets
            names |= set(surface_values(frames.open(frame), frames.surface))
    return [f"{name} of later frames" for name in sorted(names - set(frames.values))]
