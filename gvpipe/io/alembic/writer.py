"""A sequence as an Alembic archive of the Ogawa kind: polygon meshes in world space, a sample per frame.

Alembic's polygons are clockwise seen from outside, so they are turned round; each keeps its first corner. Materials become face
sets of their names.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from gvpipe.foundation import notes
from gvpipe.foundation.arrays import Array, Float32, Int32, Int64
from gvpipe.foundation.errors import InputError
from gvpipe.foundation.notes import not_held
from gvpipe.io.alembic.archive import EXTRA
from gvpipe.io.alembic.param_writer import ParamWriter, filled, is_held
from gvpipe.io.library.writing_process import write_by
from gvpipe.io.losses import renamed_note, shadow_note, shadowed, unit_note, wide_note
from gvpipe.io.scene.export import ExportMesh, export_layer, export_meshes, uncovered
from gvpipe.io.scene.mesh import Layer
from gvpipe.io.scene.normals import SceneNormals
from gvpipe.model.sequence import MeshSequence

BYTES = 16 << 20  # of a field's frames at a time


def write_alembic(sequence: MeshSequence, path: Path) -> tuple[str, ...]:
    """Write a sequence as .abc; returns what the format cannot hold.

    Alembic's library dies where it cannot write, so it runs in a process of its own.

    Raises:
        InputError: alembic3d is missing, or a position is not finite.
        OutputError: the file cannot be written.
    """
    if importlib.util.find_spec("alembic3d") is None:
        raise InputError(f"{path}: {EXTRA}")
    return write_by(__name__, "write_here", sequence, path)


def write_here(sequence: MeshSequence, path: Path, name: str) -> tuple[str, ...]:
    """The same in this process; a file that cannot be written is left as it is."""
    meshes = export_meshes(sequence, name)
    normals = SceneNormals(sequence, "Alembic")
    taken = _write_archive(sequence, meshes, normals, str(path))  # the library closes the file when its objects are gone
    return notes_of(sequence, meshes, normals, taken)


def notes_of(
    sequence: MeshSequence, meshes: list[ExportMesh], normals: SceneNormals, taken: list[tuple[str, str]]
) -> tuple[str, ...]:
    """What Alembic cannot hold of a sequence; ``taken`` has the old and the new names of nodes whose names others had."""
    return (*normals.notes, *_notes(sequence, meshes), *_name_notes(sequence, taken))


def _write_archive(sequence: MeshSequence, meshes: list[ExportMesh], normals: SceneNormals, path: str) -> list[tuple[str, str]]:
    """Write the file; return the old and the new names of nodes whose names were taken."""
    from alembic3d import Abc, AbcCoreAbstract

    archive = Abc.CreateArchiveWithInfo(path, float(sequence.fps), "gvpipe", sequence.metadata.source or sequence.name)
    sampling = AbcCoreAbstract.TimeSampling(1.0 / sequence.fps, float(sequence.metadata.start_time))
    tree = Tree(archive.getTop())
    writers = [MeshWriter(tree, mesh, sequence, normals, sampling) for mesh in meshes]
    write_samples(sequence, normals, writers)
    return tree.renamed


class SampleWriter(Protocol):
    """What takes the samples of a mesh, one frame after the other."""

    def write(self, positions: Float32, normals: Float32 | None) -> None: ...

    def write_field(self, name: str, kind: str, domain: str, block: Array) -> None: ...


def write_samples(sequence: MeshSequence, normals: SceneNormals, writers: Sequence[SampleWriter]) -> None:
    """Give all writers each frame of a sequence, in world space, and then each block of its fields that Alembic holds."""
    for first, block in sequence.chunks():
        for i, frame in enumerate(block):
            turned = normals.of(first + i, frame)
            whole = (frame + sequence.origin).astype(np.float32) if sequence.origin.any() else frame
            for writer in writers:
                writer.write(whole, turned)
    for name, field in normals.fields.items():
        if not is_held(field.kind, field.n_components):
            continue
        step = max(1, BYTES // (4 * field.shape[1] * field.n_components))
        for first in range(0, len(field), step):
            block = field.read(first, min(first + step, len(field)))
            for writer in writers:
                writer.write_field(name, field.kind, field.domain, block)


class Tree:
    """The nodes above the meshes: transforms that move nothing, one for each path."""

    def __init__(self, top: Any) -> None:
        self._made: dict[tuple[str, ...], Any] = {(): top}
        self._taken: dict[tuple[str, ...], set[str]] = {}
        self.renamed: list[tuple[str, str]] = []  # names of nodes, old and new

    def parent(self, path: str) -> Any:
        """The transform of a path, made with those above it."""
        from alembic3d import AbcGeom

        names = tuple(name.replace("/", "_") for name in path.split("/") if name)
        for depth in range(1, len(names) + 1):
            chain = names[:depth]
            if chain not in self._made:
                self._made[chain] = AbcGeom.OXform(self._made[chain[:-1]], self._free(chain[:-1], chain[-1]))
        return self._made[names]

    def mesh(self, path: str, name: str) -> Any:
        """A new mesh below a path; below the top it gets a transform of its own name, as programs expect."""
        from alembic3d import AbcGeom

        above = tuple(part.replace("/", "_") for part in (path or name).split("/") if part)
        return AbcGeom.OPolyMesh(self.parent("/".join(above)), self._free(above, name.replace("/", "_")))

    def _free(self, chain: tuple[str, ...], name: str) -> str:
        """A name that no other node of that parent has."""
        taken = self._taken.setdefault(chain, set())
        free, number = name or "mesh", 1
        while free in taken:
            free, number = f"{name}_{number}", number + 1
        taken.add(free)
        self.renamed += [(name, free)] if name and free != name else []
        return free


class MeshWriter:
    """Writes one mesh: all that it has with the first frame, points alone with the others."""

    def __init__(self, tree: Tree, mesh: ExportMesh, sequence: MeshSequence, normals: SceneNormals, sampling: Any) -> None:
        self._mesh, self._sequence, self._normals = mesh, sequence, normals
        self._rows = normals.rows(mesh)
        self._object = tree.mesh(mesh.parent, mesh.name)  # it must outlive its schema
        self._schema = self._object.getSchema()
        self._schema.setTimeSampling(sampling)
        self._order = turned_corners(mesh)
        self._params = ParamWriter(self._schema, self._order, sampling)
        self._is_first = True

    def write(self, points: Any, normals: Any) -> None:
        """Write the next frame, given all of the sequence's points ``(V, 3)`` and its normals ``(N, 3)`` or None."""
        import imath
        from alembic3d import AbcGeom

        sample = AbcGeom.OPolyMeshSchemaSample()
        sample.setPositions(filled(imath.V3fArray, points[slice(*self._mesh.vertices)]))
        if self._is_first:
            sample.setFaceIndices(filled(imath.IntArray, self._mesh.corners[self._order].astype(np.int32)))
            sample.setFaceCounts(filled(imath.IntArray, self._mesh.counts))
            self._describe(sample)
        if normals is not None:
            sample.setNormals(self._params.sample(self._normals.layer(normals, self._mesh, self._rows)))
        self._schema.set(sample)
        if self._is_first:
            self._write_face_sets()
            self._is_first = False

    def write_field(self, name: str, kind: str, domain: str, block: Any) -> None:
        """Write some frames ``(n, R, C)`` of a field."""
        self._params.write_samples(name, kind, *field_rows(self._mesh, domain, block))

    def _describe(self, sample: Any) -> None:
        """Add texture coordinates and normals to the first sample, and the other attributes beside."""
        for layer in held_layers(self._normals, self._mesh):
            if layer.name == layer.kind == "uv":
                sample.setUVs(self._params.sample(layer))
            elif layer.name == layer.kind == "normal":
                sample.setNormals(self._params.sample(layer))
            else:
                self._params.write(layer)

    def _write_face_sets(self) -> None:
        import imath
        from alembic3d import AbcGeom

        for name, polygons in face_sets(self._sequence, self._mesh):
            self._schema.createFaceSet(name).getSchema().set(AbcGeom.OFaceSetSchemaSample(filled(imath.IntArray, polygons)))


def turned_corners(mesh: ExportMesh) -> Int64:
    """The order of polygon corners in the file: each polygon turned round, its first corner kept."""
    starts = np.cumsum(mesh.counts) - mesh.counts
    rank = np.arange(len(mesh.corners)) - np.repeat(starts, mesh.counts)
    turned = np.repeat(starts, mesh.counts) + np.where(rank > 0, np.repeat(mesh.counts, mesh.counts) - rank, 0)
    return turned.astype(np.int64)


def held_layers(normals: SceneNormals, mesh: ExportMesh) -> Iterator[Layer]:
    """The attributes of a mesh that Alembic has parameters for."""
    for name, attribute in normals.attributes.items():
        if name not in normals.fields:
            layer = export_layer(name, attribute, mesh)
            if len(layer.values) and is_held(layer.kind, layer.values.shape[1]):
                yield layer


def field_rows(mesh: ExportMesh, domain: str, block: Array) -> tuple[str, Array]:
    """The domain of a field in the file, and its rows ``(n, rows, C)`` on one mesh."""
    if domain == "vertex":
        return "vertex", block[:, slice(*mesh.vertices)]
    counts = mesh.counts.astype(np.int64) - 2
    return "polygon", block[:, mesh.triangles[0] + np.cumsum(counts) - counts]


def face_sets(sequence: MeshSequence, mesh: ExportMesh) -> Iterator[tuple[str, Int32]]:
    """A name, and numbers of polygons, of each part with a material; no two have one name."""
    taken: set[str] = set()
    for first, stop, material in mesh.groups:
        name = sequence.materials[material].name if material is not None else ""
        if not name:
            continue
        plain = free = name.replace("/", "_")
        while free in taken:
            free = f"{plain}_{len(taken)}"
        taken.add(free)
        yield free, np.arange(first, stop, dtype=np.int32)


def _name_notes(sequence: MeshSequence, taken: list[tuple[str, str]]) -> tuple[str, ...]:
    """What was done to names and units: Alembic has neither units nor names with a slash, and one thing of a name.

    ``taken`` has the old and the new names of nodes whose names others had.
    """
    names = (*sequence.attributes, *sequence.fields, *(part.name for part in sequence.parts))
    changed = [(name, name.replace("/", "_")) for name in (*names, *(each.name for each in sequence.materials))]
    twice = shadow_note(shadowed(sequence), "Alembic")
    return (*twice, *renamed_note([*changed, *taken], "Alembic"), *unit_note(sequence, "Alembic"))


def _notes(sequence: MeshSequence, meshes: list[ExportMesh]) -> tuple[str, ...]:
    wide = [name for name, each in sequence.attributes.items() if not is_held(each.kind, each.values.shape[1])]
    wide += [name for name, each in sequence.fields.items() if not is_held(each.kind, each.n_components)]
    said = list(not_held("Alembic", wide))
    if sequence.materials:
        said.append("Alembic has no materials; face sets have their names, and textures were left out")
    lost = uncovered(sequence, meshes)
    if lost:
        said.append(f"{lost} vertices belong to no part; Alembic holds meshes alone, so they were left out")
    said += wide_note(sequence, "Alembic")
    if sequence.origin.any():
        said.append(f"Alembic holds float32 points; the origin {notes.show_origin(sequence.origin)} was added to them")
    about = sequence.metadata
    if about.up_axis or about.metres_per_unit:
        said.append("Alembic has no up axis and no unit; positions are as they were")
    return tuple(said)
