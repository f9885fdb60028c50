"""What gvpipe reads of a file that is no geometry video: the sequence that `gvpipe.read` returns, listed."""

from __future__ import annotations

import dataclasses
import os
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

from gvpipe.asset.listing import Things, count_polygons, list_things
from gvpipe.foundation.arguments import StrPath
from gvpipe.foundation.errors import InputError, TopologyChange
from gvpipe.io import read
from gvpipe.io.clips import list_clips
from gvpipe.io.options import RunMemory
from gvpipe.io.runs import Run, find_runs
from gvpipe.model.sequence import MeshSequence


@dataclass(frozen=True)
class SourceInfo:
    """What a source of a sequence holds; keys that `gvpipe.Info` has too mean the same.

    Args:
        bytes: of the file; None for a folder or several files.
        attributes, fields: as in `gvpipe.Info`, without bound and bytes.
        time_range: seconds of the first and the last frame.
        clips: names of the animations of a glTF file, of the takes of an FBX file.
        clip_ranges: first and last second of each clip.
        not_carried: what the source has beside what is read, by name.
        shots: where vertices or triangles change: ``start``, ``frames``, ``vertices`` and ``triangles`` of each shot. Then
            ``vertices`` and ``triangles`` are those of the largest, ``frames`` those of all, and the rest is the first one's.
    """

    vertices: int
    triangles: int
    frames: int
    fps: float
    bounding_box: dict[str, list[float]]
    bytes: int | None
    origin: list[float]
    parts: list[dict[str, Any]]
    attributes: list[dict[str, Any]]
    fields: list[dict[str, Any]]
    polygons: dict[str, int]
    materials: list[str]
    images: list[dict[str, Any]]
    metadata: dict[str, Any]
    time_range: list[float]
    clips: list[str]
    clip_ranges: list[list[float]]
    not_carried: list[str]
    notes: list[str]
    shots: list[dict[str, Any]] = field(default_factory=list)

    def to_json(self) -> dict[str, Any]:
        """The information as JSON values."""
        return dataclasses.asdict(self)


def source_info(
    path: StrPath,
    clip: str | None = None,
    mesh: StrPath | None = None,
    frames: tuple[int, int | None] | None = None,
    unlimited: bool = False,
    fps: float | None = None,
) -> SourceInfo:
    """Return what gvpipe reads of a source; only some of the frames are evaluated, unless vertices or triangles change.

    Args:
        path, clip, mesh, frames, unlimited, fps: as of `gvpipe.read`.

    Raises:
        InputError: it cannot be read.
    """
    name = os.fspath(path)
    try:
        sequence = read(name, fps, clip, mesh, frames, unlimited)
        _look(sequence)
    except TopologyChange:
        memory = RunMemory()
        runs = find_runs(lambda span: read(name, fps, clip, mesh, span, unlimited, memory=memory), frames)
        return _capture_info(name, runs)
    return _info(name, sequence)


def _look(sequence: MeshSequence) -> None:
    """Look at some frames of files that are read when they are asked for; raises `TopologyChange` if they have other meshes."""
    for frame in sorted({min(1, len(sequence) - 1), len(sequence) // 2, len(sequence) - 1}):
        try:
            sequence.read(frame, frame + 1)
        except TopologyChange:
            raise
        except InputError:  # which whoever asks for that frame gets
            return


def _capture_info(name: str, runs: list[Run]) -> SourceInfo:
    found = [_info(name, run.sequence) for run in runs]
    begin, end = found[0].time_range[0], found[-1].time_range[1]
    n_frames = sum(each.frames for each in found)
    if any(after.time_range[0] <= before.time_range[1] for before, after in pairwise(found)):  # they have no times
        end = begin + (n_frames - 1) / found[0].fps
    return dataclasses.replace(
        found[0],
        vertices=max(each.vertices for each in found),
        triangles=max(each.triangles for each in found),
        frames=n_frames,
        time_range=[begin, end],
        not_carried=list(dict.fromkeys(left for each in found for left in each.not_carried)),
        notes=list(dict.fromkeys(note for each in found for note in each.notes)),
        shots=[
            {"start": run.start, "frames": each.frames, "vertices": each.vertices, "triangles": each.triangles}
            for run, each in zip(runs, found, strict=True)
        ],
    )


def _info(name: str, sequence: MeshSequence) -> SourceInfo:
    first = sequence[0]
    clips = list_clips(name)
    polygons = count_polygons(sequence.polygons)
    things = Things(sequence.parts, polygons, sequence.materials, sequence.images, sequence.metadata)
    return SourceInfo(
        vertices=sequence.n_vertices,
        triangles=len(sequence.faces),
        frames=sequence.n_frames,
        fps=sequence.fps,
        bounding_box={"min": first.min(axis=0).tolist(), "max": first.max(axis=0).tolist()},
        bytes=os.path.getsize(name) if os.path.isfile(name) else None,
        origin=sequence.origin.tolist(),
        attributes=_attributes(sequence),
        fields=_fields(sequence),
        time_range=_time_range(sequence),
        clips=[clip.name for clip in clips],
        clip_ranges=[[clip.start, clip.stop] for clip in clips],
        not_carried=list(sequence.not_carried),
        notes=list(sequence.notes),
        **list_things(things),
    )


def _time_range(sequence: MeshSequence) -> list[float]:
    """Seconds of the first and the last frame, by the file's own times where its steps are uneven."""
    times = sequence.times
    return [float(times[0]), float(times[-1])]


def _attributes(sequence: MeshSequence) -> list[dict[str, Any]]:
    return [
        {
            "name": name,
            "kind": each.kind,
            "domain": each.domain,
            "components": each.shape[1],
            "type": each.dtype.name,
            "unit": each.unit,
        }
        for name, each in sequence.attributes.items()
    ]


def _fields(sequence: MeshSequence) -> list[dict[str, Any]]:
    return [
        {
            "name": name,
            "kind": each.kind,
            "domain": each.domain,
            "components": each.n_components,
            "type": each.dtype.name,
            "unit": each.unit,
            "range": None if each.range is None else list(each.range),
        }
        for name, each in sequence.fields.items()
    ]
