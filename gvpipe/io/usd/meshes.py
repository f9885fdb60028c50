"""The meshes of a USD stage: which are read, their polygons, and the subsets that have a material each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from gvpipe.arrays import Array, Int64
from gvpipe.errors import TopologyChange
from gvpipe.io.scene_frames import first_frame_of
from gvpipe.io.usd.materials import Materials

HIDDEN_PURPOSES = ("guide", "proxy")


@dataclass(frozen=True)
class Found:
    """The meshes of a stage that are read, and what the user should know of the others."""

    meshes: tuple[Any, ...]
    notes: tuple[str, ...]


def find_meshes(stage: Any) -> Found:
    """Find the meshes, in the order of the stage, those in instances too.

    Meshes that are never visible, guides and proxies are left out, unless there are no others.
    """
    from pxr import Usd, UsdGeom

    shown: list[Any] = []
    hidden: list[Any] = []
    others: dict[str, int] = {}
    n_instancers = flickering = 0
    for prim in Usd.PrimRange(stage.GetPseudoRoot(), Usd.TraverseInstanceProxies()):
        n_instancers += prim.IsA(UsdGeom.PointInstancer)
        if not prim.IsA(UsdGeom.Mesh):
            if prim.IsA(UsdGeom.Gprim):
                others[prim.GetTypeName()] = others.get(prim.GetTypeName(), 0) + 1
            continue
        changes = _visibility_changes(prim)
        flickering += changes
        drawn = UsdGeom.Imageable(prim)
        is_hidden = not changes and drawn.ComputeVisibility(stage.GetStartTimeCode()) == UsdGeom.Tokens.invisible
        is_hidden = is_hidden or drawn.ComputePurpose() in HIDDEN_PURPOSES
        (hidden if is_hidden else shown).append(UsdGeom.Mesh(prim))
    notes = []
    if hidden and shown:
        some = f"{len(hidden)} of {len(hidden) + len(shown)} meshes"
        notes.append(f"{some} are invisible, guides or proxies; they were left out, such as {_path(hidden[0])}")
    elif hidden:
        notes.append(f"all {len(hidden)} meshes are invisible, guides or proxies; they were read nevertheless")
    if flickering:
        notes.append(f"meshes whose visibility changes over time are shown always: {flickering}")
    if others:
        held = ", ".join(f"{count} {kind}" for kind, count in sorted(others.items()))
        notes.append(f"prims that are no meshes were left out: {held}")
    if n_instancers:
        notes.append(
            f"point instancers were not expanded ({n_instancers}); their prototypes were read once each, where they stand"
        )
    meshes = shown or hidden
    cages = sum(mesh.GetSubdivisionSchemeAttr().Get() not in (None, "none") for mesh in meshes)
    if cages:
        notes.append(f"{cages} of {len(meshes)} meshes are cages of subdivision surfaces; the cages were read as they are")
    return Found(tuple(meshes), tuple(notes))


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
        samples = attribute.GetTimeSamples() if attribute.ValueMightBeTimeVarying() else []
        for moment in (each for each in samples if times[0] < each <= times[-1] + 1e-6):
            if not np.array_equal(_integers(attribute, moment), first):
                number = start + first_frame_of(moment, times)
                what = f"the topology of mesh {_path(mesh)} changes at frame {number} (time code {moment:g})"
                raise TopologyChange.at(f"{where}: {what}", number, start)
        result.append(first)
    return result[0], result[1]


def groups_of(mesh: Any, n_polygons: int, materials: Materials) -> tuple[Int64, tuple[int | None, ...]]:
    """Return the group ``(P,)`` of each polygon and the material of each group: one per subset that binds materials.

    Polygons of no subset are group 0; those of several are of the first.
    """
    from pxr import UsdGeom, UsdShade

    groups = np.zeros(n_polygons, np.int64)
    bound: list[int | None] = [materials.of(mesh.GetPrim())]
    for subset in UsdShade.MaterialBindingAPI(mesh.GetPrim()).GetMaterialBindSubsets():
        if subset.GetElementTypeAttr().Get() != UsdGeom.Tokens.face:
            continue
        indices = _integers(subset.GetIndicesAttr(), 0.0)
        indices = indices[(indices >= 0) & (indices < n_polygons)]
        groups[indices[groups[indices] == 0]] = len(bound)
        bound.append(materials.of(subset.GetPrim()))
    return groups, tuple(bound)


def _visibility_changes(prim: Any) -> bool:
    from pxr import UsdGeom

    while prim and not prim.IsPseudoRoot():
        drawn = UsdGeom.Imageable(prim)
        if drawn and drawn.GetVisibilityAttr().ValueMightBeTimeVarying():
            return True
        prim = prim.GetParent()
    return False


def _integers(attribute: Any, time: float) -> Int64:
    from pxr import Usd

    value = attribute.Get(time)
    if value is None:
        value = attribute.Get(Usd.TimeCode.EarliestTime())
    return np.array(value if value is not None else (), np.int64).reshape(-1)


def _path(mesh: Any) -> str:
    return str(mesh.GetPrim().GetPath())
