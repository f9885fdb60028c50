"""Fields of frames that have meshes of their own, on the key mesh that follows them: sampled at the closest places."""

from __future__ import annotations

import operator
from typing import Any

import numpy as np

from gvpipe.asset.field import Field
from gvpipe.following import Run
from gvpipe.following.closest import triangle_normals
from gvpipe.following.places import OwnMesh, Places
from gvpipe.following.surface import vertex_normals
from gvpipe.foundation.arrays import Array, Float64
from gvpipe.model.capture import Capture
from gvpipe.model.sequence import MeshSequence


def sampled_fields(frames: Capture, origin: Float64, run: Run) -> dict[str, Field]:
    """Fields of a followed run by name: those that all of its frames have, with the same domain and components.

    Args:
        frames: of the run, as they came.
        origin: ``(3,)`` what the run's positions are relative to, model units.
        run: the key mesh at each of the frames.
    """
    first = frames.shots[0].fields
    kept = [name for name, field in first.items() if all(_is_alike(shot.fields.get(name), field) for shot in frames.shots)]
    places = {domain: _FramePlaces(frames, origin, run, domain) for domain in ("vertex", "triangle")}
    return {name: _sampled(name, first[name], places[first[name].domain]) for name in kept}


def _is_alike(field: Field | None, first: Field) -> bool:
    return field is not None and (field.domain, field.dtype, field.shape[2:]) == (first.domain, first.dtype, first.shape[2:])


def _sampled(name: str, first: Field, places: _FramePlaces) -> Field:
    return Field(_SampledFrames(name, first, places), first.domain, first.kind, first.unit)


class _FramePlaces:
    """Where a run's vertices, or the middles of its triangles, lie on the frames' own meshes; the last frame's are kept."""

    def __init__(self, frames: Capture, origin: Float64, run: Run, domain: str) -> None:
        self._frames, self._origin, self._run, self._domain = frames, origin, run, domain
        self._last: tuple[int, MeshSequence, Places] | None = None

    @property
    def shape(self) -> tuple[int, int]:
        """Frames, and rows of each."""
        return len(self._frames), len(self._run.faces) if self._domain == "triangle" else int(self._run.positions.shape[1])

    def of(self, frame: int) -> tuple[MeshSequence, Places]:
        """A frame as it came, and the places on it."""
        last = self._last
        if last is None or last[0] != frame:
            own = self._frames.frame(frame)
            mesh = OwnMesh(own.read_absolute(0, 1)[0] - self._origin, own.faces)
            points = np.asarray(self._run.positions[frame : frame + 1], np.float64)[0]
            normals = vertex_normals(points, self._run.faces)
            if self._domain == "triangle":
                corners = points[self._run.faces]
                points, normals = corners.mean(axis=1), triangle_normals(corners)
            self._last = last = frame, own, mesh.places(points, normals)
        return last[1], last[2]


class _SampledFrames:
    """Values of one field, ``(F, R, ...)``; integers are those of the nearest vertex."""

    def __init__(self, name: str, first: Field, places: _FramePlaces) -> None:
        self._name, self._places = name, places
        self.shape: tuple[int, ...] = (*places.shape, *first.shape[2:])
        self.dtype: Any = first.dtype

    def __getitem__(self, key: slice, /) -> Array:
        rows = [self._frame(frame) for frame in range(*key.indices(operator.index(self.shape[0])))]
        return np.stack(rows).reshape(-1, *self.shape[1:]) if rows else np.empty((0, *self.shape[1:]), self.dtype)

    def _frame(self, frame: int) -> Array:
        own, places = self._places.of(frame)
        field = own.fields[self._name]
        values = field.read(0, 1)[0]  # (R, C)
        if field.domain == "triangle":
            return np.asarray(values[places.triangles])
        if self.dtype.kind in "iu":
            nearest = own.faces[places.triangles, places.weights.argmax(axis=1)]
            return np.asarray(values[nearest])
        return places.of_vertices(values, own.faces).astype(self.dtype)
