"""Which of the numbers beside positions change from frame file to frame file: those become fields, the others attributes.

1. A few files are compared with the first. What differs is a field.
2. Normals that are the surface's own in these files are an attribute, the first file's: each frame's follow from its positions.
3. If anything is left, all files are compared, for what is the same in all. They are parsed once, for later reads too.

Normals per corner cannot be a field: fields have one row per vertex or triangle. The first file's are kept, and a note says so.
"""

from __future__ import annotations

import contextlib
from dataclasses import dataclass
from typing import Any

import numpy as np

from gvpipe.asset.attribute import Attribute, guess_kind
from gvpipe.asset.field import Field
from gvpipe.foundation.arrays import Array, Int64
from gvpipe.foundation.errors import InputError
from gvpipe.io.damage import FRAME_AGAIN, reading
from gvpipe.io.fetching import is_elsewhere
from gvpipe.io.frames.column_types import can_be_still, field_type
from gvpipe.io.frames.frame_files import FrameFiles
from gvpipe.io.left_behind import met_later
from gvpipe.io.mesh import FrameValues, Mesh, too_wide
from gvpipe.io.normals.own import FIRST_NORMALS, entries_of, own_rule

SAMPLES = 3  # files that are compared with the first before all are


@dataclass(frozen=True)
class Columns:
    """Attributes and fields that frame files have beside their positions."""

    attributes: dict[str, Attribute]
    fields: dict[str, Field]
    notes: tuple[str, ...] = ()
    not_carried: tuple[str, ...] = ()


class FrameColumn:
    """One column of frame files, ``(F, R)`` or ``(F, R, C)``, loaded as it is sliced, as numbers of a type."""

    def __init__(self, frames: FrameFiles, name: str, first: Array, dtype: np.dtype[Any]) -> None:
        self._frames, self._name = frames, name
        self.shape: tuple[int, ...] = (len(frames.paths), *first.shape)
        self.dtype: Any = dtype

    def __getitem__(self, key: slice, /) -> Array:
        with np.errstate(over="ignore"):
            return self._frames.column(self._name, range(*key.indices(self.shape[0]))).astype(self.dtype, copy=False)


def split_columns(frames: FrameFiles) -> Columns:
    """Find out what moves.

    Raises:
        InputError: a file cannot be read, or lacks what the first one has.
    """
    with reading(frames.paths[0], "", remedy=FRAME_AGAIN):
        given = {name: make() for name, make in frames.first.animated.items()}
    left = [name for name, one in given.items() if not one.can_be_held]
    given = {name: one._replace(values=_plain(one.values)) for name, one in given.items() if name not in left}
    with reading(frames.paths[0], "", remedy=FRAME_AGAIN):
        statics = {name: _static(frames.first, name, one) for name, one in given.items() if can_be_still(one.values)}
    n_frames = len(frames.paths)
    samples = np.unique(np.linspace(1, n_frames - 1, SAMPLES).astype(int)).tolist() if n_frames > 1 else []
    moving = set(given) - set(statics)
    for name in moving:
        frames.keep(name, given[name].values, 1)
    meshes = [frames.load(frame) for frame in samples] if given else []
    looked_at = meshes or _some(frames, samples)
    late = sorted({name for mesh in looked_at for name in mesh.animated} - {*given, *left})
    settled = {
        name
        for name in statics
        if given[name].kind == "normal" and _are_own(frames, meshes, samples, statics[name], given[name])
    }
    found = {name for name in set(statics) - settled if _differs(frames, meshes, samples, name, given[name])}
    _keep(frames, found, given, 1)
    moving |= found
    for frame in range(1, n_frames):
        open_names = set(statics) - settled - moving
        if not open_names:
            break
        if frame not in samples:
            mesh = frames.load(frame)
            found = {name for name in open_names if _differs(frames, [mesh], [frame], name, given[name])}
            _keep(frames, found, given, frame)
            moving |= found
    corners = {name for name in moving if given[name].domain == "corner"}
    where = frames.paths[0].parent
    fields = {}
    for name in (each for each in given if each in moving - corners):
        one = given[name]
        samples_of = [frames.values(mesh, name, k, one.values) for mesh, k in zip(meshes, samples, strict=True)]
        column = FrameColumn(frames, name, one.values, field_type([one.values, *samples_of]))
        fields[name] = Field(column, one.domain, one.kind, one.unit, name=f"{where}: field {name!r}")
    attributes = {name: each for name, each in statics.items() if name not in fields}
    notes = (FIRST_NORMALS,) if corners else ()
    more = met_later(frames.first.not_carried, (name for mesh in looked_at for name in mesh.not_carried))
    return Columns(
        attributes, fields, notes, (*too_wide(left), *(f"{name} of later frames" for name in late), *dict.fromkeys(more))
    )


def _some(frames: FrameFiles, samples: list[int]) -> list[Mesh]:
    """Those of some frames that lie on disk and can be read."""
    found = []
    for frame in samples:
        if not is_elsewhere(frames.paths[frame]):
            with contextlib.suppress(InputError):  # which whoever asks for that frame gets
                found.append(frames.load(frame))
    return found


def _keep(frames: FrameFiles, names: set[str], given: dict[str, FrameValues], n_frames: int) -> None:
    for name in names:
        if given[name].domain != "corner":
            frames.keep(name, given[name].values, n_frames)


def _plain(values: Array) -> Array:
    """Numbers of a type that fields have."""
    result = values if values.dtype.kind != "f" or values.dtype.itemsize == 8 else np.asarray(values, np.float32)
    return result if result.dtype.isnative else result.astype(result.dtype.newbyteorder("="))


def _static(first: Mesh, name: str, one: FrameValues) -> Attribute:
    """The attribute that numbers are if they do not change; its kind is guessed where the file does not say."""
    given = first.attributes.get(name)
    return (
        given
        if given is not None
        else Attribute(one.values, one.domain, one.kind or guess_kind(name, one.values), None, one.unit)
    )


def _differs(frames: FrameFiles, meshes: list[Mesh], numbers: list[int], name: str, one: FrameValues) -> bool:
    """Whether numbers differ from the first file's in one of some meshes."""
    pairs = zip(meshes, numbers, strict=True)
    return any(not np.array_equal(frames.values(mesh, name, number, one.values), one.values) for mesh, number in pairs)


def _are_own(frames: FrameFiles, meshes: list[Mesh], numbers: list[int], normals: Attribute, one: FrameValues) -> bool:
    """Whether one rule gives the normals of the first mesh and of all others."""
    faces = frames.first.faces
    entries, corners = entries_of(normals, faces)
    rows: Int64 = corners if one.domain == "corner" else faces.reshape(-1)[corners].astype(np.int64)
    pairs = [
        (frames.first, one.values),
        *((mesh, frames.values(mesh, "normal", n, one.values)) for mesh, n in zip(meshes, numbers, strict=True)),
    ]
    rules = {own_rule(values[rows], mesh.positions, faces, entries) for mesh, values in pairs}
    return None not in rules
