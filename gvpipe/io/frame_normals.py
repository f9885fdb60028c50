"""Normals of each frame of a sequence, for formats that write them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gvpipe.arrays import Array, Float32, Int32, Int64
from gvpipe.attributes.surface_normals import surface_normals
from gvpipe.io.own_normals import entries_of, own_rule
from gvpipe.sequence import MeshSequence


@dataclass(frozen=True)
class FrameNormals:
    """The normals that frames are written with.

    Args:
        indices: ``(3 T,)`` the normal of each corner; None: vertex i has normal i.
        first: ``(N, 3)`` of the first frame.
        positions: ``(V, 3)`` of the first frame; frames of equal positions have its normals.
        rule: by which those of other frames follow; ``""``: they are a field of the sequence.
        entries, faces: for the rule.
    """

    indices: Int32 | None
    first: Float32
    positions: Float32
    rule: str
    entries: Int64
    faces: Int32

    def of(self, positions: Float32, fields: Mapping[str, Array]) -> Float32:
        """Normals ``(N, 3)`` of a frame."""
        if "normal" in fields:
            return np.asarray(fields["normal"], np.float32)
        if np.array_equal(positions, self.positions):
            return self.first
        own: Float32 = surface_normals(positions[None], self.faces, self.entries, self.rule)[0]
        if self.indices is not None:
            return own
        result = np.zeros((len(positions), 3), np.float32)
        result[self.faces.reshape(-1)] = own[self.entries]
        return result


def unknown_normals(sequence: MeshSequence) -> tuple[str, ...]:
    """What to say of normals that are known in the first frame alone: they would be wrong in all others."""
    given = sequence.attributes.get("normal")
    is_unknown = given is not None and "normal" not in sequence.fields and sequence.n_frames > 1
    return ("normals that do not follow from the moving surface",) if is_unknown and frame_normals(sequence) is None else ()


def frame_normals(sequence: MeshSequence) -> FrameNormals | None:
    """The normals to write: a field, or an attribute of a still mesh, or one whose rule holds in the first frame.

    None if there are none, or if those of later frames are not known.
    """
    none = np.zeros(0, np.int64)
    field, given = sequence.fields.get("normal"), sequence.attributes.get("normal")
    if field is not None and (field.domain, field.n_components) == ("vertex", 3):
        empty = np.zeros((0, 3), np.float32)
        return FrameNormals(None, empty, empty, "", none, sequence.faces)
    if given is None or given.kind != "normal" or given.domain not in ("vertex", "corner"):
        return None
    positions = sequence.read(0, 1)[0]
    entries, corners = entries_of(given, sequence.faces)
    rows = corners if given.domain == "corner" else sequence.faces.reshape(-1)[corners]
    rule = own_rule(np.asarray(given)[rows], positions, sequence.faces, entries)
    if rule is None and sequence.n_frames > 1:
        return None
    if given.domain == "vertex":
        return FrameNormals(None, np.asarray(given), positions, rule or "", entries, sequence.faces)
    return FrameNormals(entries.astype(np.int32), np.asarray(given)[corners], positions, rule or "", entries, sequence.faces)
