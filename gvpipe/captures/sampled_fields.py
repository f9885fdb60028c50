"""Fields of frames that have meshes of their own, on the key mesh that follows them: sampled at the closest places."""

from __future__ import annotations

import operator
from typing import Any

import numpy as np

from gvpipe.asset.field import Field
from gvpipe.captures.followed_frames import FollowedFrames
from gvpipe.following.places import Places
from gvpipe.following.surface import vertex_normals
from gvpipe.foundation.arrays import Array
from gvpipe.metrics.surface_samples import triangle_normals
from gvpipe.model.sequence import MeshSequence


def sampled_fields(followed: FollowedFrames) -> dict[str, Field]:
    """Fields of a followed run by name: those that all of its frames have, with the same domain and components."""
    shots = followed.frames.shots
    first = shots[0].fields
    kept = [name for name, field in first.items() if all(_is_alike(shot.fields.get(name), field) for shot in shots)]
    places = {domain: _FramePlaces(followed, domain) for domain in ("vertex", "triangle")}
    return {name: _sampled(name, first[name], places[first[name].domain]) for name in kept}


def _is_alike(field: Field | None, first: Field) -> bool:
    return field is not None and (field.domain, field.dtype, field.shape[2:]) == (first.domain, first.dtype, first.shape[2:])


def _sampled(name: str, first: Field, places: _FramePlaces) -> Field:
    return Field(_SampledFrames(name, first, places), first.domain, first.kind, first.unit)


class _FramePlaces:
    """Where a run's vertices, or the middles of its triangles, lie on the frames' own meshes; the last frame's are kept."""

    def __init__(self, followed: FollowedFrames, domain: str) -> None:
        self._followed, self._domain = followed, domain
        self._last: tuple[int, MeshSequence, Places] | None = None

    @property
    def shape(self) -> tuple[int, int]:
        """Frames, and rows of each."""
        followed = self._followed
        return len(followed), len(followed.faces) if self._domain == "triangle" else followed.n_vertices

    def of(self, frame: int) -> tuple[MeshSequence, Places]:
        """A frame as it came, and the places on it."""
        last = self._last
        if last is None or last[0] != frame:
            own, mesh = self._followed.own(frame)
            points, faces = self._followed.followed(frame), self._followed.faces
            normals = vertex_normals(points, faces)
            if self._domain == "triangle":
                corners = points[faces]
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
