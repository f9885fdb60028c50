"""Normals of each frame of a GLB, one for each of its split vertices (`split`), as `gvpipe.io.normals.of_frames` gives them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from gvpipe.foundation.arrays import Array, Float32, Int64
from gvpipe.io.gltf.attribute_writing import GltfAttribute, as_gltf
from gvpipe.io.gltf.split import Split
from gvpipe.io.normals.of_frames import FrameNormals, frame_normals, turned_note
from gvpipe.model.sequence import MeshSequence

NORMAL = "NORMAL"


class SplitNormals:
    """Normals of the split vertices, frame by frame.

    Args:
        frames: normals of the sequence.
        split: its vertices.

    Attributes:
        is_field: whether they are a field of the sequence.
        notes: what was done to them, a line each.
    """

    def __init__(self, frames: FrameNormals, split: Split, is_field: bool) -> None:
        self._frames, self.is_field = frames, is_field
        self._rows: Int64 = split.sources
        self._has_none = np.zeros(len(split.sources), bool)  # vertices without a triangle have no corner's normal
        if frames.indices is not None and split.corners is not None:
            self._rows = frames.indices[np.maximum(split.corners, 0)].astype(np.int64)
            self._has_none = split.corners < 0
        self.notes = turned_note(frames, "glTF")

    def of(self, positions: Float32, fields: Mapping[str, Array]) -> GltfAttribute:
        """Normals ``(W, 3)`` of a frame, of length 1.

        Args:
            positions: ``(V, 3)``, before the split.
            fields: values ``(V, C)`` of the frame's fields by name; ``"normal"`` is among them if they are a field.
        """
        rows = self._frames.of(positions, fields)[self._rows]
        rows[self._has_none] = 0
        made = as_gltf(NORMAL, "normal", rows)
        assert made is not None  # normals are floats, which glTF holds
        return made


def split_normals(sequence: MeshSequence, split: Split) -> SplitNormals | None:
    """The normals of a sequence's frames; None if it has none, or has one frame whose attribute says all."""
    is_field = "normal" in sequence.fields
    if sequence.n_frames == 1 and not is_field:
        return None
    frames = frame_normals(sequence)
    return None if frames is None else SplitNormals(frames, split, is_field and not len(frames.first))
