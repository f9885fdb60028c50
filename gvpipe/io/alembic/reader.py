"""An Alembic archive as a `MeshSequence`: meshes become parts in world space, frames are read when they are asked for.

Alembic's polygons are clockwise seen from outside; here they are turned round. Face sets become parts, their names materials.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from gvpipe.asset.material import Material
from gvpipe.asset.metadata import Metadata
from gvpipe.foundation.arrays import Float64, Int64
from gvpipe.foundation.errors import InputError, TopologyChange
from gvpipe.foundation.notes import DEFAULT_FPS
from gvpipe.io.alembic.archive import Node, find_meshes, open_archive, sample_of
from gvpipe.io.alembic.motion import AlembicMotion, around
from gvpipe.io.alembic.numbers import as_integers
from gvpipe.io.alembic.params import changing_normals, layers_of, left_of, sampled_of
from gvpipe.io.damage import reading
from gvpipe.io.left_behind import LeftBehind
from gvpipe.io.options import ReadOptions
from gvpipe.io.scene.fields import join_fields, misfits
from gvpipe.io.scene.frames import SceneFrames, even_times, first_frame_of
from gvpipe.io.scene.hiding import hidden_note
from gvpipe.io.scene.layers import join_layers
from gvpipe.io.scene.mesh import SceneMesh, join
from gvpipe.model.sequence import MeshSequence


def read_archive(path: Path, options: ReadOptions) -> tuple[MeshSequence, bool]:
    """Read the meshes of an Alembic archive, in the file's units, with the transforms above them, and whether normals change.

    Args:
        path: an .abc of the Ogawa kind.
        options: `fps` samples the archive's range at that rate instead of at its samples; `frames` are those that are read.

    Raises:
        InputError: alembic3d is missing, the file is damaged or of the HDF5 kind, it has no mesh, a mesh's topology
            changes in the frames that are read, a position is not finite.
    """
    archive = open_archive(path)
    with reading(path, "Alembic"):
        return _read_meshes(archive, path, options)


def _read_meshes(archive: Any, path: Path, options: ReadOptions) -> tuple[MeshSequence, bool]:
    where = str(path)
    nodes, others = find_meshes(archive)
    motions = [motion for motion in map(AlembicMotion, nodes) if motion.has_points]
    shown = [motion for motion in motions if not motion.is_never_shown]
    if not motions:
        held = f"; it holds {', '.join(sorted(set(others)))}" if others else ""
        raise InputError(f"{where} has no polygon mesh{held}; a mesh with triangles is needed")
    notes = []
    if shown and len(shown) < len(motions):
        notes.append(f"{len(motions) - len(shown)} of {len(motions)} meshes are hidden; they were left out")
    motions = shown or motions
    cages = sum("SubD" in motion.node.kind for motion in motions)
    if cages:
        notes.append(f"{cages} of {len(motions)} meshes are cages of subdivision surfaces; the cages were read as they are")
    notes += hidden_note(sum(motion.flickers for motion in motions))
    left = LeftBehind()
    left.add_all(f"{kind} objects" for kind in others)
    samples = np.unique(np.fromiter((time for motion in motions for time in motion.samples()), np.float64))
    times, fps, time_notes = even_times(samples, options.fps, DEFAULT_FPS, where)
    first, stop = options.span(len(times), where)
    times = times[first:stop]
    start = float(times[0])
    for motion in motions:
        motion.n_vertices = motion.count(start)
    changes_at = _first_change([motion.node for motion in motions], times) if options.memory else None
    times = times[:changes_at]
    motions = [motion for motion in motions if motion.n_vertices]
    if not motions:
        raise InputError(f"{where}: no mesh has points at frame {first} (second {start:g}); leave it out (--frames)")
    frames = SceneFrames(motions, times, where, "second", first, [where])
    frames.changes_at = None if changes_at is None else first + changes_at
    materials: list[str] = []
    last = float(times[-1]) if options.memory else None
    read = [_read_mesh(motion, materials, (times, where, first), last) for motion in motions]
    meshes = [mesh for mesh, _ in read]
    joined = join(meshes, where)
    attributes, layer_notes = join_layers(meshes, joined.fans, frames.first)
    sampled = [sampled_of(motion.node.schema, mesh, start, last) for motion, mesh in zip(motions, meshes, strict=True)]
    fields, torn = join_fields(sampled, [mesh.n_vertices for mesh in meshes], joined.fans, times, where)
    left.add_all(misfits("parameter", [*(names for _, names in read), torn]))
    for motion, own in zip(motions, sampled, strict=True):
        left.add_all(left_of(motion.node, own if len(times) > 1 else (), start, last))
    sequence = MeshSequence(
        frames,
        joined.faces,
        fps,
        attributes,
        where,
        frames.origin,
        (*notes, *time_notes, *layer_notes),
        fields=fields,
        parts=joined.parts,
        polygons=joined.polygons,
        materials=tuple(Material(name) for name in materials),
        metadata=_metadata(archive, path, start),
        not_carried=left.names,
    )
    return sequence, any(changing_normals(motion.node.schema) for motion in motions)


def _read_mesh(
    motion: AlembicMotion, materials: list[str], frames: tuple[Float64, str, int], last: float | None
) -> tuple[SceneMesh, list[str]]:
    """One mesh with its layers, and the names of parameters that were left out; new materials are added to the list.

    Args:
        motion, materials: what is read.
        frames: their times, the file, and the number of the first.
        last: as of `layers_of`.
    """
    node, time = motion.node, float(frames[0][0])
    counts, corners = _polygons(node, *frames)
    groups, names = _face_sets(node.schema, len(counts), time)
    materials.extend(name for name in names if name and name not in materials)
    bound = tuple(materials.index(name) if name else None for name in names)
    turn = motion.world(time)[:3, :3]
    is_mirrored = bool(np.linalg.det(turn) < 0)
    parent, _, name = node.path.strip("/").rpartition("/")
    plain = SceneMesh(name, parent, motion.n_vertices, counts, corners, groups, bound, not is_mirrored)
    layers, left = layers_of(node.schema, plain, time, turn, last)
    return replace(plain, layers=layers), left


def _polygons(node: Node, times: Float64, where: str, start: int) -> tuple[Int64, Int64]:
    """Corners per polygon and the vertex of each corner; raises `TopologyChange` where they change in the frames."""
    found = []
    for held in (node.schema.getFaceCountsProperty(), node.schema.getFaceIndicesProperty()):
        first = _integers(held, around(held, float(times[0]))[0])
        for number, moment in _moments(held, times):
            if not np.array_equal(_integers(held, number), first):
                at = start + first_frame_of(moment, times)
                what = f"the topology of mesh {node.path} changes at frame {at} (second {moment:g})"
                raise TopologyChange.at(f"{where}: {what}", at, start)
        found.append(first)
    return found[0], found[1]


def _integers(held: Any, number: int) -> Int64:
    return as_integers(sample_of(held, number))


def _first_change(nodes: list[Node], times: Float64) -> int | None:
    """The first of some frames whose polygons are not those of the first; None: there is none."""
    found = []
    for node in nodes:
        for held in (node.schema.getFaceCountsProperty(), node.schema.getFaceIndicesProperty()):
            first = _integers(held, around(held, float(times[0]))[0])
            for number, moment in _moments(held, times):
                if not np.array_equal(_integers(held, number), first):
                    found.append(first_frame_of(moment, times))
                    break
    return min(found, default=None)


def _moments(held: Any, times: Float64) -> Iterator[tuple[int, float]]:
    """Numbers and times of samples of a property behind the first frame."""
    sampling, count = held.getTimeSampling(), 1 if held.isConstant() else held.getNumSamples()
    for number in range(sampling.getFloorIndex(float(times[0]), count) if count > 1 else 1, count):
        moment = float(sampling.getSampleTime(number))
        if moment > times[-1] + 1e-6:
            break
        if moment > times[0]:
            yield number, moment


def _face_sets(schema: Any, n_polygons: int, time: float) -> tuple[Int64, list[str]]:
    """The group of each polygon, and the name of each group: 0 for polygons of no set, then one per face set.

    The library lists face sets by name; here they are in the order of their first polygons.
    """
    from alembic3d import Abc

    sets: list[tuple[Int64, str]] = []
    for name in map(str, schema.getFaceSetNames()):
        held = schema.getFaceSet(name)  # it must outlive its schema
        indices = as_integers(held.getSchema().getValue(Abc.ISampleSelector(time)).getFaces())
        indices = indices[(indices >= 0) & (indices < n_polygons)]
        if len(indices) or held.getSchema().isConstant():  # a set of other shots of a capture is empty
            sets.append((indices, name))
    groups = np.zeros(n_polygons, np.int64)
    ordered = sorted(sets, key=lambda each: int(each[0].min(initial=n_polygons)))
    for number, (indices, _) in enumerate(ordered, start=1):
        groups[indices[groups[indices] == 0]] = number
    return groups, ["", *(name for _, name in ordered)]


def _metadata(archive: Any, path: Path, start: float) -> Metadata:
    from alembic3d import Abc

    about = Abc.GetArchiveInfo(archive)
    texts = {f"alembic {key}": str(about[key]) for key in ("appName", "userDescription") if about.get(key)}
    return Metadata("", None, start, path.name, texts)
