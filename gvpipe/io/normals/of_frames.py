"""Normals of each frame of a sequence, for formats that write them.

Static normals would be wrong in all frames but the first. So each frame has its own: a field's, those that follow from its
surface by a rule, or those of the first frame turned with the surface (`turned_normals`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gvpipe.attributes.surface_normals import surface_normals
from gvpipe.foundation.arrays import Array, Float32, Int32, Int64
from gvpipe.io.normals.own import entries_of, own_rule
from gvpipe.io.normals.turned import TurnedNormals
from gvpipe.model.sequence import MeshSequence


@dataclass(frozen=True)
class FrameNormals:
    """The normals that frames are written with.

    Args:
        indices: ``(3 T,)`` the normal of each corner; None: vertex i has normal i.
        first: ``(N, 3)`` of the first frame.
        positions: ``(V, 3)`` of the first frame; frames of equal positions have its normals.
        rule: by which those of other frames follow; ``""``: they are a field of the sequence, or turned.
        entries, faces: for the rule.
        turned: gives those of other frames, where no rule does.
    """

    indices: Int32 | None
    first: Float32
    positions: Float32
    rule: str
    entries: Int64
    faces: Int32
    turned: TurnedNormals | None = None

    def of(self, positions: Float32, fields: Mapping[str, Array]) -> Float32:
        """Normals ``(N, 3)`` of a frame."""
        if "normal" in fields:
            return np.asarray(fields["normal"], np.float32)
        if np.array_equal(positions, self.positions):
            return self.first
        if self.turned is not None:
            return self.turned.of(positions)
        own: Float32 = surface_normals(positions[None], self.faces, self.entries, self.rule)[0]
        if self.indices is not None:
            return own
        result = np.zeros((len(positions), 3), np.float32)
        result[self.faces.reshape(-1)] = own[self.entries]
        return result


def frame_normals(sequence: MeshSequence) -> FrameNormals | None:
    """The normals to write: a field, or an attribute; None if there are none.

    Those of later frames follow by the rule that holds in the first frame. Without such a rule they are turned.
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
    turned = TurnedNormals(given, positions, sequence.faces) if rule is None and sequence.n_frames > 1 else None
    indices = None if given.domain == "vertex" else entries.astype(np.int32)
    first = np.asarray(given, np.float32)
    first = first if indices is None else first[corners]
    return FrameNormals(indices, first, positions, rule or "", entries, sequence.faces, turned)


def turned_note(normals: FrameNormals | None, format_name: str) -> tuple[str, ...]:
    """What to say of normals that are turned: a line, or none."""
    if normals is None or normals.turned is None:
        return ()
    return (f"normals follow from no rule; in {format_name} those of later frames are turned with the surface",)
