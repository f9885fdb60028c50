"""The meshes of a USD stage: which are read, their polygons, and the subsets that have a material each."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from gvpipe.foundation.arrays import Array, Int64
from gvpipe.foundation.errors import TopologyChange
from gvpipe.io.left_behind import LeftBehind
from gvpipe.io.scene.frames import first_frame_of
from gvpipe.io.usd.instances import Instance, find_instances, is_hidden_below
from gvpipe.io.usd.materials import Materials
from gvpipe.io.usd.motion import visibility_samples
from gvpipe.io.usd.primvars import is_passed_over, varies_in

HIDDEN_PURPOSES = ("guide", "proxy")
TAKEN = {  # types of prims that are read, or that only hold others
    "Xform", "Scope", "Material", "Shader", "NodeGraph", "GeomSubset", "SkelRoot", "Skeleton", "SkelAnimation", "BlendShape",
}  # fmt: skip
MOTION = "velocities", "accelerations", "angularVelocities"
NAMES = "userProperties:blender:object_name", "userProperties:blender:data_name"  # of prims, written again
MATERIALS = "materialBind"  # the family of subsets that are read


@dataclass(frozen=True)
class Found:
    """The meshes of a stage that are read, and what the user should know of the others.

    Args:
        meshes: each with the instance of a point instancer that shows it, or None.
        notes: a line each.
        left: what else the stage has.
    """

    meshes: tuple[tuple[Any, Instance | None], ...]
    notes: tuple[str, ...]
    left: LeftBehind


def find_meshes(stage: Any) -> Found:
    """Find the meshes, in the order of the stage, those in instances and those that point instancers show too.

    Meshes that are never visible, guides and proxies are left out, unless there are no others.
    """
    from pxr import Usd, UsdGeom

    shown: list[tuple[Any, Instance | None]] = []
    hidden: list[tuple[Any, Instance | None]] = []
    left = LeftBehind()
    prims = iter(Usd.PrimRange(stage.GetPseudoRoot(), Usd.TraverseInstanceProxies()))
    for prim in prims:
        sets = prim.GetVariantSets()
        several = [name for name in sets.GetNames() if len(sets.GetVariantSet(name).GetVariantNames()) > 1]
        left.add_all(f"other variants of set {name}" for name in several)
        custom = [str(each.GetName()) for each in prim.GetAuthoredAttributes() if each.IsCustom()]
        left.add_all(f"attribute {name}" for name in custom if name not in NAMES)
        if prim.IsA(UsdGeom.PointInstancer):
            prims.PruneChildren()  # what lies below is shown where its points are
            found, others = find_instances(prim, stage.GetStartTimeCode())
            left.add("point instancers in prototypes", others.count("PointInstancer"))
            left.add_all(f"{kind} prims" for kind in others if kind and kind not in {*TAKEN, "PointInstancer"})
            left.add_all(f"{name} of an instancer" for name in _own_primvars(prim))
            pairs: list[tuple[Any, Instance | None]] = [*found]
        elif prim.IsA(UsdGeom.Mesh):
            pairs = [(UsdGeom.Mesh(prim), None)]
        else:
            kind = str(prim.GetTypeName())
            if kind and kind not in TAKEN:
                left.add(f"{kind} prims")
            continue
        for mesh, instance in pairs:
            root = instance.instancer.prim if instance else mesh.GetPrim()
            is_hidden = _is_never_visible(root, stage) or UsdGeom.Imageable(mesh).ComputePurpose() in HIDDEN_PURPOSES
            is_hidden |= instance is not None and is_hidden_below(mesh, instance.root)
            (hidden if is_hidden else shown).append((mesh, instance))
    notes = []
    if hidden and shown:
        some = f"{len(hidden)} of {len(hidden) + len(shown)} meshes"
        notes.append(f"{some} are invisible, guides or proxies; they were left out, such as {_path(hidden[0][0])}")
    elif hidden:
        notes.append(f"all {len(hidden)} meshes are invisible, guides or proxies; they were read nevertheless")
    meshes = shown or hidden
    for mesh, _ in meshes:
        left.add_all(_left_of(mesh))
    cages = sum(mesh.GetSubdivisionSchemeAttr().Get() not in (None, "none") for mesh, _ in meshes)
    if cages:
        notes.append(f"{cages} of {len(meshes)} meshes are cages of subdivision surfaces; the cages were read as they are")
    return Found(tuple(meshes), tuple(notes), left)


def animated_inputs(stage: Any, span: tuple[float, float] | None) -> Iterator[str]:
    """What of shaders changes over time, or from a time to another: materials stand still here."""
    from pxr import Usd, UsdShade

    for prim in Usd.PrimRange(stage.GetPseudoRoot(), Usd.TraverseInstanceProxies()):
        if prim.IsA(UsdShade.Shader) or prim.IsA(UsdShade.NodeGraph):  # materials are node graphs
            inputs = UsdShade.ConnectableAPI(prim).GetInputs()
            yield from (f"animation of {each.GetBaseName()}" for each in inputs if varies_in(each.GetAttr(), span))


def _left_of(mesh: Any) -> list[str]:
    """What a mesh has beside points, polygons and primvars that are read."""
    from pxr import UsdGeom

    left = [name for name in (*MOTION, "holeIndices") if mesh.GetPrim().GetAttribute(name).HasAuthoredValue()]
    families = {UsdGeom.Subset(each).GetFamilyNameAttr().Get() or "" for each in UsdGeom.Subset.GetAllGeomSubsets(mesh)}
    left += [f"subsets of family {name!r}" for name in sorted(families - {MATERIALS})]
    primvars = UsdGeom.PrimvarsAPI(mesh.GetPrim()).FindPrimvarsWithInheritance()
    return [*left, *(f"primvar {each.GetPrimvarName()}" for each in primvars if each.HasValue() and is_passed_over(each))]


def _own_primvars(prim: Any) -> list[str]:
    """Primvars of an instancer, a value for each instance, and their velocities."""
    from pxr import UsdGeom

    motion = [name for name in MOTION if prim.GetAttribute(name).HasAuthoredValue()]
    return motion + [f"primvar {each.GetPrimvarName()}" for each in UsdGeom.PrimvarsAPI(prim).GetPrimvarsWithAuthoredValues()]


def _is_never_visible(prim: Any, stage: Any) -> bool:
    from pxr import UsdGeom

    invisible = UsdGeom.Tokens.invisible
    drawn = UsdGeom.Imageable(prim)
    times = visibility_samples(prim) or [stage.GetStartTimeCode()]
    return all(drawn.ComputeVisibility(time) == invisible for time in times)


def polygons_of(mesh: Any, times: Array, where: str, start: int = 0) -> tuple[Int64, Int64]:
    """Return corners per polygon ``(P,)`` and the vertex of each corner.

    Args:
        mesh: the UsdGeom.Mesh.
        times: time codes of the frames.
        where: the file, for messages.
        start: number of the first frame.

    Raises:
        TopologyChange: they change in these frames.
    """
    result = []
    for attribute in (mesh.GetFaceVertexCountsAttr(), mesh.GetFaceVertexIndicesAttr()):
        first = _integers(attribute, float(times[0]))
        for moment in _moments(attribute, times):
            if not np.array_equal(_integers(attribute, moment), first):
                number = start + first_frame_of(moment, times)
                what = f"the topology of mesh {_path(mesh)} changes at frame {number} (time code {moment:g})"
                raise TopologyChange.at(f"{where}: {what}", number, start)
        result.append(first)
    return result[0], result[1]


def changing_frames(mesh: Any, times: Array) -> Iterator[int]:
    """The first frame, at ``times``, where corners per polygon differ, and the first where the vertices of corners do."""
    for attribute in (mesh.GetFaceVertexCountsAttr(), mesh.GetFaceVertexIndicesAttr()):
        moments = _moments(attribute, times)
        first = _integers(attribute, float(times[0]))
        for moment in moments:
            if not np.array_equal(_integers(attribute, moment), first):
                yield first_frame_of(moment, times)
                break


def _moments(attribute: Any, times: Array) -> list[float]:
    """Times of samples behind the first frame."""
    if not attribute.ValueMightBeTimeVarying():
        return []
    samples = attribute.GetTimeSamples()
    return samples[bisect_right(samples, times[0]) : bisect_right(samples, times[-1] + 1e-6)]  # type: ignore[no-any-return]


def groups_of(mesh: Any, n_polygons: int, materials: Materials, time: float) -> tuple[Int64, tuple[int | None, ...]]:
    """Return the group ``(P,)`` of each polygon and the material of each group: one per subset that binds materials.

    Polygons of no subset are group 0; those of several are of the first.
    """
    from pxr import UsdGeom, UsdShade

    groups = np.zeros(n_polygons, np.int64)
    bound: list[int | None] = [materials.of(mesh.GetPrim())]
    for subset in UsdShade.MaterialBindingAPI(mesh.GetPrim()).GetMaterialBindSubsets():
        if subset.GetElementTypeAttr().Get() != UsdGeom.Tokens.face:
            continue
        indices = _integers(subset.GetIndicesAttr(), time)
        indices = indices[(indices >= 0) & (indices < n_polygons)]
        groups[indices[groups[indices] == 0]] = len(bound)
        bound.append(materials.of(subset.GetPrim()))
    return groups, tuple(bound)


def _integers(attribute: Any, time: float) -> Int64:
    from pxr import Usd

    value = attribute.Get(time)
    if value is None:
        value = attribute.Get(Usd.TimeCode.EarliestTime())
    return np.array(value if value is not None else (), np.int64).reshape(-1)


def _path(mesh: Any) -> str:
    return str(mesh.GetPrim().GetPath())
