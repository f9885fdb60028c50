"""Normals of a moving scene (`frame_normals`), cut into its meshes, for formats that have a sample of them per frame."""

from __future__ import annotations

import numpy as np

from gvpipe.asset.attribute import Attribute
from gvpipe.foundation.arrays import Array, Float32, Int64
from gvpipe.io.normals.of_frames import FrameNormals, frame_normals, turned_note
from gvpipe.io.scene.export import ExportMesh
from gvpipe.io.scene.mesh import Layer
from gvpipe.model.sequence import MeshSequence


class SceneNormals:
    """The normals of a sequence's frames, and the attributes and fields that remain beside them."""

    def __init__(self, sequence: MeshSequence, format_name: str) -> None:
        self._sequence = sequence
        moves = sequence.n_frames > 1
        self._frames: FrameNormals | None = frame_normals(sequence) if moves else None
        held = {"normal"} if moves else set()
        self.attributes: dict[str, Attribute] = {name: each for name, each in sequence.attributes.items() if name not in held}
        self.fields = {name: each for name, each in sequence.fields.items() if name not in held or self._frames is None}
        self.notes = turned_note(self._frames, format_name)

    def of(self, frame: int, positions: Float32) -> Float32 | None:
        """Normals ``(N, 3)`` of a frame, given its positions ``(V, 3)`` relative to the origin; None if there are none."""
        if self._frames is None:
            return None
        field = self._sequence.fields.get("normal")
        return self._frames.of(positions, {} if field is None else {"normal": field.read(frame, frame + 1)[0]})

    def layer(self, values: Array, mesh: ExportMesh, rows: tuple[Array, Int64] | None) -> Layer:
        """The normals of one mesh, given those of the frame and what `rows` gave for the mesh."""
        if rows is None:
            return Layer("normal", "normal", "vertex", values[slice(*mesh.vertices)])
        return Layer("normal", "normal", "corner", values[rows[0]], rows[1])

    def rows(self, mesh: ExportMesh) -> tuple[Array, Int64] | None:
        """The normals that a mesh uses, and the place of each corner's among them; None for normals of vertices."""
        if self._frames is None or self._frames.indices is None:
            return None
        used, places = np.unique(self._frames.indices[mesh.source], return_inverse=True)
        return used, places.reshape(-1).astype(np.int64)
