"""Some parts of a sequence as a sequence: to draw, with all vertices, or to write, with theirs alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from gvpipe.asset.polygons import polygon_starts
from gvpipe.foundation.arguments import did_you_mean
from gvpipe.foundation.arrays import Int32, Int64
from gvpipe.foundation.errors import InputError
from gvpipe.model.sequence import MeshSequence

LISTED = 12  # names in a message


def only_parts(sequence: MeshSequence, names: Sequence[str]) -> MeshSequence:
    """Return the sequence with the triangles of parts of some names, in their order.

    All vertices stay, so that fields and attributes of vertices fit. Polygons are left out: triangles are drawn.

    Raises:
        InputError: no part has one of the names.
    """
    known = list(dict.fromkeys(part.name for part in sequence.parts))
    for name in names:
        if name not in known:
            listed = ", ".join(known[:LISTED]) + (f" and {len(known) - LISTED} more" if len(known) > LISTED else "")
            there = f"there are: {listed}" if known else "it has no named parts"
            raise InputError(f"{sequence.name}: part {name!r} asked for; {there}{did_you_mean(name, known)}")
    numbers = [number for number, part in enumerate(sequence.parts) if part.name in names]
    ranges = [np.arange(*sequence.parts[number].triangles) for number in numbers]
    triangles = np.concatenate(ranges)
    ends = np.cumsum([len(each) for each in ranges]).tolist()
    parts = tuple(
        replace(sequence.parts[number], triangles=(end - len(each), end))
        for number, each, end in zip(numbers, ranges, ends, strict=True)
    )
    rows = {"triangle": triangles, "corner": (3 * triangles[:, None] + np.arange(3)).ravel(), "part": np.array(numbers)}
    return replace(
        sequence,
        faces=sequence.faces[triangles],
        parts=parts,
        polygons=None,
        attributes=_chosen(sequence.attributes, rows),
        fields=_chosen(sequence.fields, rows),
    )


def parts_alone(sequence: MeshSequence, names: Sequence[str]) -> MeshSequence:
    """Return the parts of some names with their polygons and their vertices, and no others.

    Vertices and polygons keep their order. Frames still load when they are read. Materials and images stay, since parts
    refer to them by number.

    Raises:
        InputError: no part has one of the names.
    """
    chosen = only_parts(sequence, names)
    is_kept = np.zeros(sequence.n_vertices, bool)
    for part in chosen.parts:
        is_kept[slice(*part.vertices)] = True
    if not len(chosen.faces) or not is_kept.any():
        raise InputError(f"{sequence.name}: part {', '.join(map(repr, names))} has no triangles; choose another one")
    kept = np.flatnonzero(is_kept)
    before = np.concatenate([[0], np.cumsum(is_kept)])  # vertices that are kept before each
    parts = tuple(
        replace(part, vertices=(int(before[part.vertices[0]]), int(before[part.vertices[1]]))) for part in chosen.parts
    )
    rows = {"vertex": kept}
    return replace(
        sequence.reordered(kept, before[chosen.faces].astype(np.int32)),
        parts=parts,
        polygons=_polygons(sequence, names),
        volume=None,
        attributes=_chosen(chosen.attributes, rows),
        fields=_chosen(chosen.fields, rows),
        materials=sequence.materials,
        images=sequence.images,
    )


def _polygons(sequence: MeshSequence, names: Sequence[str]) -> Int32 | None:
    """Corners of each polygon of the parts."""
    if sequence.polygons is None:
        return None
    starts = np.append(polygon_starts(sequence.polygons.astype(np.int64)), len(sequence.faces))
    spans = [np.searchsorted(starts, part.triangles) for part in sequence.parts if part.name in names]
    return np.concatenate([sequence.polygons[first:stop] for first, stop in spans])


def _chosen(named: Mapping[str, Any], rows: dict[str, Int64]) -> dict[str, Any]:
    """Attributes or fields with the rows that are left."""
    return {name: each.select(rows[each.domain]) if each.domain in rows else each for name, each in named.items()}
