"""A USD stage as a `MeshSequence`: meshes become parts in world space, frames are evaluated when they are read."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from gvpipe.asset.metadata import Metadata
from gvpipe.foundation.arrays import Float64
from gvpipe.foundation.errors import InputError
from gvpipe.io.options import ReadOptions
from gvpipe.io.scene.fields import join_fields, misfits
from gvpipe.io.scene.frames import SceneFrames
from gvpipe.io.scene.hiding import hidden_note
from gvpipe.io.scene.layers import join_layers
from gvpipe.io.scene.mesh import SceneMesh, join
from gvpipe.io.usd.instances import InstanceMotion
from gvpipe.io.usd.materials import Materials
from gvpipe.io.usd.meshes import animated_inputs, changing_frames, find_meshes, groups_of, polygons_of
from gvpipe.io.usd.motion import Skins, UsdMotion
from gvpipe.io.usd.names import name_of, parent_path
from gvpipe.io.usd.primvars import animated_primvars, layers_of, sampled_of
from gvpipe.io.usd.stage import check_inside, open_stage, stage_times, usd_errors
from gvpipe.model.sequence import MeshSequence


def read_stage(path: Path, options: ReadOptions) -> tuple[MeshSequence, bool]:
    """Read the meshes of a USD file, in the stage's units and axes, with the world transforms of its prims, and whether normals
    change.

    Args:
        path: .usda, .usdc, .usd or .usdz; files that it refers to are read too.
        options: `fps` samples the stage's range at that rate instead of once per time code; `frames` are those that are read.

    Raises:
        InputError: the file is damaged or refers to a file that is missing or outside of its folder,
            it has no mesh, a mesh's topology changes in the frames that are read, a position is not finite.
    """
    stage = options.keep("stage", lambda: open_stage(path))
    with usd_errors(path):
        return _read_stage(stage, path, options)


def _read_stage(stage: Any, path: Path, options: ReadOptions) -> tuple[MeshSequence, bool]:
    from pxr import UsdGeom

    where = str(path)
    check_inside(stage, path)
    found = find_meshes(stage)
    skins = Skins(stage)
    places = UsdGeom.XformCache()
    start = float(stage.GetStartTimeCode())

    def moved(number: int, time: float) -> UsdMotion:
        mesh, instance = found.meshes[number]
        if instance is None:
            return UsdMotion(mesh, skins, places, time)
        return InstanceMotion(mesh, skins, places, time, instance)

    motions = [moved(number, start) for number in range(len(found.meshes))]
    there = [number for number, motion in enumerate(motions) if motion.n_vertices or motion.has_points]
    if not there:
        raise InputError(f"{where} has no polygon mesh; a mesh with triangles is needed")
    samples = (sample for number in there for sample in motions[number].samples())
    times, fps, time_notes = stage_times(stage, samples, options, where)
    first, stop = options.span(len(times), where)
    times = times[first:stop]
    if float(times[0]) != start:  # meshes may have other vertices then
        motions = [moved(number, float(times[0])) for number in range(len(found.meshes))]
    kept = [number for number in there if motions[number].n_vertices]
    if not kept:
        raise InputError(f"{where}: no mesh has points at frame {first} (time code {times[0]:g}); leave it out (--frames)")
    changes_at = _first_change([found.meshes[number][0] for number in there], times) if options.memory else None
    times = times[:changes_at]
    motions = [motions[number] for number in kept]
    frames = SceneFrames(motions, times, where, "time code", first, [layer.realPath for layer in stage.GetUsedLayers()])
    frames.changes_at = None if changes_at is None else first + changes_at
    last = float(times[-1]) if options.memory else None
    materials = Materials(path, None if last is None else float(times[0]))
    materials.times, materials.textures.first = times.tolist(), first
    found.left.add_all(animated_inputs(stage, None if last is None else (float(times[0]), last)))
    own = [found.meshes[number][0] for number in kept]
    read = [_read_mesh(mesh, motion, materials, (times, where, first), last) for mesh, motion in zip(own, motions, strict=True)]
    meshes = [mesh for mesh, _ in read]
    joined = join(meshes, where)
    attributes, layer_notes = join_layers(meshes, joined.fans, frames.first)
    sampled = [sampled_of(drawn, mesh, float(times[0]), last) for drawn, mesh in zip(own, meshes, strict=True)]
    fields, torn = join_fields(sampled, [mesh.n_vertices for mesh in meshes], joined.fans, times, where)
    taken = {name for mesh in (sampled if len(times) > 1 else []) for name in mesh}
    still = animated_primvars(own, float(times[0]), last) - taken
    found.left.add_all(f"animation of primvar {name}" for name in still)
    found.left.add_all(misfits("primvar", [*(names for _, names in read), torn]))
    drawn, images = materials.drawn()
    hiding = hidden_note(sum(motion.flickers for motion in motions))
    sequence = MeshSequence(
        frames,
        joined.faces,
        fps,
        attributes,
        where,
        frames.origin,
        (
            *found.notes,
            *hiding,
            *time_notes,
            *materials.notes(),
            *layer_notes,
        ),
        fields=fields,
        parts=joined.parts,
        polygons=joined.polygons,
        materials=drawn,
        images=images,
        metadata=_metadata(stage, path, float(times[0])),
        not_carried=(*found.left.names, *materials.left.names),
    )
    return sequence, any(_has_moving_normals(motion.prim) for motion in motions)


def _first_change(meshes: list[Any], times: Float64) -> int | None:
    """The first of some frames whose polygons are not those of the first; None: there is none."""
    return min((at for mesh in meshes for at in changing_frames(mesh, times)), default=None)


def _read_mesh(
    mesh: Any, motion: UsdMotion, materials: Materials, frames: tuple[Float64, str, int], last: float | None
) -> tuple[SceneMesh, list[str]]:
    """One mesh with its layers, and the names of primvars that were left out.

    Args:
        mesh, motion, materials: what is read.
        frames: their time codes, the file, and the number of the first.
        last: as of `layers_of`.
    """
    from pxr import UsdGeom

    prim, time = mesh.GetPrim(), float(frames[0][0])
    counts, corners = polygons_of(mesh, *frames)
    groups, bound = groups_of(mesh, len(counts), materials, time)
    turn = motion.linear(time)
    whole = turn if turn.ndim == 2 else turn.mean(axis=0)
    is_left = mesh.GetOrientationAttr().Get() == UsdGeom.Tokens.leftHanded
    is_mirrored = bool(np.linalg.det(whole) < 0)  # a mirror turns the winding round
    plain = SceneMesh(
        name_of(prim), parent_path(prim), motion.n_vertices, counts, corners, groups, bound, is_left != is_mirrored
    )
    layers, uv_names, left = layers_of(mesh, plain, time, turn, last)
    materials.name_uv(bound, uv_names)
    return replace(plain, layers=layers), left


def _has_moving_normals(prim: Any) -> bool:
    from pxr import UsdGeom

    primvar = UsdGeom.PrimvarsAPI(prim).GetPrimvar("normals")
    return bool(primvar.ValueMightBeTimeVarying() if primvar else UsdGeom.Mesh(prim).GetNormalsAttr().ValueMightBeTimeVarying())


def _metadata(stage: Any, path: Path, start: float) -> Metadata:
    from pxr import UsdGeom

    unit = float(UsdGeom.GetStageMetersPerUnit(stage))
    texts = {"usd comment": stage.GetRootLayer().comment} if stage.GetRootLayer().comment else {}
    return Metadata(
        str(UsdGeom.GetStageUpAxis(stage)).lower(),
        unit if np.isfinite(unit) and unit > 0 else None,
        start / float(stage.GetTimeCodesPerSecond()),
        path.name,
        texts,
    )
