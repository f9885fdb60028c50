"""Positions moved by a field of displacements, as engineers look at simulations ("warp by vector")."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gvpipe.foundation.arguments import show
from gvpipe.foundation.arrays import Array, Float32
from gvpipe.foundation.errors import InputError, SettingError
from gvpipe.grids.volume import Volume
from gvpipe.model.sequence import MeshSequence

USUAL = ("displacement", "displacements", "disp", "displ", "u", "depl")  # names of what moves a mesh, in lower case
TURNING = ("normal", "tangent")  # kinds of numbers that a moved mesh has others of
STILL = 1e-9  # of the largest coordinate


class Warped:
    """Frames of a sequence, ``(F, V, 3)``, with the scaled numbers of each frame added, when they are read."""

    def __init__(self, sequence: MeshSequence, name: str, scale: float) -> None:
        self._sequence, self._name, self._scale = sequence, name, scale
        self.shape: tuple[int, ...] = (sequence.n_frames, sequence.n_vertices, 3)

    def __getitem__(self, key: slice, /) -> Float32:
        start, stop, _ = key.indices(self.shape[0])
        positions = self._sequence.read(start, stop).astype(np.float64)
        positions += self._scale * _moves(self._sequence, self._name, start, stop)
        return positions.astype(np.float32)


def parse_warp(text: str) -> tuple[str, float]:
    """The name and the scale of ``NAME`` or ``NAME:SCALE``.

    Raises:
        SettingError: there is no name, or the scale is no finite number.
        TypeError: it is no text.

    Examples:
        >>> parse_warp("displacement:2.5"), parse_warp("U"), parse_warp("a:b")
        (('displacement', 2.5), ('U', 1.0), ('a:b', 1.0))
    """
    if not isinstance(text, str):
        raise TypeError(f"warp is {show(text)}; a text such as 'displacement:10' is needed")
    name, colon, last = text.rpartition(":")
    try:
        found = (name, float(last)) if colon else (text, 1.0)
    except ValueError:
        found = (text, 1.0)
    if not found[0] or not np.isfinite(found[1]):
        raise SettingError(f"warp is {show(text)}; NAME or NAME:SCALE is needed, such as displacement:10")
    return found


def warped(sequence: MeshSequence, text: str) -> MeshSequence:
    """A sequence whose vertices are moved by a field or an attribute.

    Args:
        sequence: to move; its field stays as it is.
        text: ``NAME`` or ``NAME:SCALE`` of three numbers a vertex (two: in x and y), model units.

    Raises:
        InputError: it has no such numbers.
        SettingError: `text` is of another form.
    """
    name, scale = parse_warp(text)
    name, scale = (text, 1.0) if text in movers(sequence) else (name, scale)
    if name not in movers(sequence):
        known = ", ".join(map(repr, movers(sequence))) or "none"
        raise InputError(f"{sequence.name} has no vectors {name!r} on its vertices to warp by; it has {known}")
    notes = [
        *(note for note in sequence.notes if not note.startswith(HINT)),
        f"positions are moved by {scale:g} times {name!r}",
    ]
    directions = [each for each, one in (*sequence.attributes.items(), *sequence.fields.items()) if one.kind in TURNING]
    if directions:
        notes.append(f"{', '.join(map(repr, dict.fromkeys(directions)))} of the mesh before it was moved are left out")
    return replace(
        sequence,
        positions=Warped(sequence, name, scale),
        volume=_warped_inside(sequence, name, scale),
        attributes={each: one for each, one in sequence.attributes.items() if each not in directions},
        fields={each: one for each, one in sequence.fields.items() if each not in directions},
        notes=tuple(notes),
    )


class _WarpedPoints:
    """Inner points, moved as the surface is."""

    def __init__(self, volume: Volume, name: str, scale: float) -> None:
        self._volume, self._field, self._scale = volume, volume.point_fields[name], scale
        self.shape = volume.points.shape

    def __getitem__(self, key: slice, /) -> Float32:
        start, stop, _ = key.indices(self.shape[0])
        moves = self._field.read(start, stop) if len(self._field) > 1 else self._field.read(0, 1)
        return (self._volume.points[start:stop] + self._scale * _in_space(moves)).astype(np.float32)


def _warped_inside(sequence: MeshSequence, name: str, scale: float) -> Volume | None:
    volume = sequence.volume
    if volume is None or not volume.n_points:
        return volume
    if name not in volume.point_fields:
        raise InputError(f"{sequence.name}: inner points have no {name!r} to warp by; leave the volume out")
    return replace(volume, points=_WarpedPoints(volume, name, scale))


HINT = "the mesh stands still; "


def warp_hint(sequence: MeshSequence) -> tuple[str, ...]:
    """A note where a mesh stands still and has a field of displacements."""
    named = [name for name in sequence.fields if name in movers(sequence) and name.lower() in USUAL]
    if not named or sequence.n_frames < 2:
        return ()
    first = sequence.read(0, 1)[0]
    for k in sorted({sequence.n_frames // 2, sequence.n_frames - 1}):
        if np.abs(sequence.read(k, k + 1)[0] - first).max(initial=0) > STILL * np.abs(first).max(initial=0):
            return ()
    return (f"{HINT}--warp {named[0]} moves it by its field {named[0]!r} (--warp {named[0]}:10 ten times as far)",)


def movers(sequence: MeshSequence) -> list[str]:
    """Names of fields and attributes that can move vertices."""
    widths = {name: (one.domain, np.asarray(one).shape[1]) for name, one in sequence.attributes.items()}
    widths |= {name: (one.domain, one.n_components) for name, one in sequence.fields.items()}
    return [name for name, (domain, width) in widths.items() if domain == "vertex" and width in (2, 3)]


def _moves(sequence: MeshSequence, name: str, start: int, stop: int) -> Array:
    field = sequence.fields.get(name)
    values = np.asarray(sequence.attributes[name])[None] if field is None else field.read(start, stop)
    return _in_space(values)


def _in_space(values: Array) -> Array:
    """Vectors ``(n, R, 2 or 3)`` as three numbers each, float64."""
    values = values.astype(np.float64)
    return values if values.shape[2] == 3 else np.concatenate([values, np.zeros((*values.shape[:2], 1))], axis=2)
