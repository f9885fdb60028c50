"""A capture as an Alembic archive: polygon meshes of changing (heterogeneous) topology, a sample of everything per frame.

What a shot does not have, be it a mesh, a parameter or a face set, is empty in its frames. The library
stores equal samples once.
"""

from __future__ import annotations

import importlib.util
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gvpipe.foundation.arrays import Array
from gvpipe.foundation.errors import InputError
from gvpipe.io.alembic.archive import EXTRA
from gvpipe.io.alembic.param_writer import ParamWriter, filled, param_types
from gvpipe.io.alembic.writer import Tree, face_sets, field_rows, held_layers, notes_of, turned_corners, write_samples
from gvpipe.io.library.writing_process import write_by
from gvpipe.io.library.writing_worker import AskedShots
from gvpipe.io.scene.export import ExportMesh, export_meshes
from gvpipe.io.scene.mesh import Layer
from gvpipe.io.scene.normals import SceneNormals
from gvpipe.model.capture import Capture
from gvpipe.model.sequence import MeshSequence


def write_capture(capture: Capture, path: Path) -> tuple[str, ...]:
    """Write a capture as .abc; returns what the format cannot hold.

    Raises:
        InputError: alembic3d is missing, or a position is not finite.
        OutputError: the file cannot be written.
    """
    if importlib.util.find_spec("alembic3d") is None:
        raise InputError(f"{path}: {EXTRA}")
    return write_by(__name__, "write_here", capture, path)


def write_here(shots: AskedShots, path: Path, name: str) -> tuple[str, ...]:
    """The same in this process; a file that cannot be written is left as it is."""
    archive: CaptureArchive | None = None
    said: list[str] = []
    for shot in shots:
        archive = archive or CaptureArchive(str(path), shot)
        said += archive.add(shot, name)
    return tuple(dict.fromkeys(said))  # the library closes the file when its objects are gone


class CaptureArchive:
    """An archive that takes shots, one behind the other."""

    def __init__(self, path: str, first: MeshSequence) -> None:
        from alembic3d import Abc, AbcCoreAbstract

        self._archive = Abc.CreateArchiveWithInfo(path, float(first.fps), "gvpipe", first.metadata.source or first.name)
        self._sampling = AbcCoreAbstract.TimeSampling(1.0 / first.fps, float(first.metadata.start_time))
        self._tree = Tree(self._archive.getTop())
        self._meshes: dict[tuple[str, str, int], ChangingMesh] = {}
        self._n_frames = 0

    def add(self, shot: MeshSequence, name: str) -> list[str]:
        """Write a shot; returns notes."""
        exported, normals = export_meshes(shot, name), SceneNormals(shot, "Alembic")
        own = []
        counts: dict[tuple[str, str], int] = {}
        for mesh in exported:
            label = (mesh.parent, mesh.name)
            key = (*label, counts.setdefault(label, 0))
            counts[label] += 1
            if key not in self._meshes:
                self._meshes[key] = ChangingMesh(self._tree.mesh(mesh.parent, mesh.name), self._sampling)
                self._meshes[key].pad(self._n_frames)
            own.append(self._meshes[key])
        for writer, mesh in zip(own, exported, strict=True):
            writer.begin(shot, mesh, normals)
        write_samples(shot, normals, own)
        self._n_frames += len(shot)
        said = [note for writer in own for note in writer.notes]
        for writer in self._meshes.values():
            writer.pad(self._n_frames)
        return [*said, *notes_of(shot, exported, normals, self._tree.renamed)]


@dataclass
class _Param:
    """A parameter that has a sample for each of so many frames."""

    held: Any
    form: tuple[str, str, bool]  # the library's name of its type, its domain, and whether it is indexed
    n_frames: int


class ChangingMesh:
    """One mesh of an archive, whose polygons change."""

    def __init__(self, made: Any, sampling: Any) -> None:
        self._object, self._sampling = made, sampling  # the object must outlive its schema
        self._schema = made.getSchema()
        self._schema.setTimeSampling(sampling)
        self._params: dict[str, _Param] = {}
        self._face_sets: dict[str, _Param] = {}
        self._n_frames = self._shot_start = 0  # frames that are written, and those before the shot
        self.notes: list[str] = []

    def begin(self, shot: MeshSequence, mesh: ExportMesh, normals: SceneNormals) -> None:
        """Take the polygons and attributes of the frames that follow."""
        import imath
        from alembic3d import AbcGeom

        self._mesh, self._normals, self._rows = mesh, normals, normals.rows(mesh)
        order = turned_corners(mesh)
        self._writer = ParamWriter(self._schema, order, self._sampling)
        self._corners = filled(imath.IntArray, mesh.corners[order].astype(np.int32))
        self._counts = filled(imath.IntArray, mesh.counts)
        self._uv = self._still_normals = None
        self._shot_start = self._n_frames
        self.notes = []
        for layer in held_layers(normals, mesh):
            if layer.name == layer.kind == "uv":
                self._uv = self._writer.sample(layer)
            elif layer.name == layer.kind == "normal":
                self._still_normals = self._writer.sample(layer)
            else:
                self._repeat(layer, shot.n_frames)
        for name, polygons in face_sets(shot, mesh):
            sample = AbcGeom.OFaceSetSchemaSample(filled(imath.IntArray, polygons))
            held = self._face_set(name)
            for _ in range(shot.n_frames):
                held.held.getSchema().set(sample)
            held.n_frames += shot.n_frames

    def write(self, points: Array, normals: Array | None) -> None:
        """Write the next frame, given all of the shot's points ``(V, 3)`` and its normals ``(N, 3)`` or None."""
        import imath
        from alembic3d import AbcGeom

        sample = AbcGeom.OPolyMeshSchemaSample()
        sample.setPositions(filled(imath.V3fArray, points[slice(*self._mesh.vertices)]))
        sample.setFaceIndices(self._corners)
        sample.setFaceCounts(self._counts)
        turned = self._still_normals
        if normals is not None:
            turned = self._writer.sample(self._normals.layer(normals, self._mesh, self._rows))
        self._set(sample, turned, self._uv)

    def write_field(self, name: str, kind: str, domain: str, block: Array) -> None:
        """Write some frames ``(n, R, C)`` of a field of the shot."""
        own_domain, rows = field_rows(self._mesh, domain, block)
        for frame in rows:
            self._repeat(Layer(name, kind, own_domain, frame), 1)

    def pad(self, n_frames: int) -> None:
        """Write nothing for what has fewer frames."""
        import imath
        from alembic3d import AbcGeom

        nothing = filled(imath.IntArray, np.zeros(0, np.int32))
        while self._n_frames < n_frames:
            sample = AbcGeom.OPolyMeshSchemaSample()
            sample.setPositions(filled(imath.V3fArray, np.zeros((0, 3), np.float32)))
            sample.setFaceIndices(nothing)
            sample.setFaceCounts(nothing)
            self._set(sample, None, None)
        for held in self._face_sets.values():
            for _ in range(held.n_frames, n_frames):
                held.held.getSchema().set(AbcGeom.OFaceSetSchemaSample(nothing))
            held.n_frames = n_frames
        for param in self._params.values():
            self._fill(param, n_frames)

    def _set(self, sample: Any, normals: Any, uv: Any) -> None:
        """Write a frame; once a mesh has had normals or texture coordinates, it has some in every frame, if only none."""
        if normals is not None:
            sample.setNormals(normals)
        if uv is not None:
            sample.setUVs(uv)
        self._schema.set(sample)
        self._n_frames += 1

    def _repeat(self, layer: Layer, count: int) -> None:
        """Write a layer for so many frames."""
        form = (param_types(layer.kind, layer.values)[0], layer.domain, layer.indices is not None or layer.domain == "corner")
        param = self._params.get(layer.name)
        if param is None:
            made = self._writer.make(layer)
            made.setTimeSampling(self._sampling)
            param = self._params[layer.name] = _Param(made, form, 0)
        if param.form != form:
            note = f"{layer.name} is of another kind in some shots, which Alembic cannot change; there it was left out"
            self.notes += [note] if note not in self.notes else []
            return
        self._fill(param, self._shot_start)
        sample = self._writer.sample(layer)
        for _ in range(count):
            param.held.set(sample)
        param.n_frames += count

    def _fill(self, param: _Param, n_frames: int) -> None:
        """Write a sample without values up to a frame."""
        if param.n_frames < n_frames:
            sample = ParamWriter(self._schema, np.zeros(0, np.int64), self._sampling).nothing(*param.form)
            for _ in range(param.n_frames, n_frames):
                param.held.set(sample)
            param.n_frames = n_frames

    def _face_set(self, name: str) -> _Param:
        import imath
        from alembic3d import AbcGeom

        held = self._face_sets.get(name)
        if held is None:
            made = self._schema.createFaceSet(name)
            made.getSchema().setTimeSampling(self._sampling)
            held = self._face_sets[name] = _Param(made, ("", "", False), 0)
        for _ in range(held.n_frames, self._shot_start):
            held.held.getSchema().set(AbcGeom.OFaceSetSchemaSample(filled(imath.IntArray, np.zeros(0, np.int32))))
        held.n_frames = max(held.n_frames, self._shot_start)
        return held
