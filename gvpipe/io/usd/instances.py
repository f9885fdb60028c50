"""Point instancers: meshes that are repeated at points, each with a transform of its own, which may move.

An instance of a prototype shows each mesh below the prototype's root. A point is moved from the mesh to the prototype's root,
by the instance's transform, then as the instancer is.

Source: OpenUSD, UsdGeomPointInstancer.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from gvpipe.foundation.arrays import Bool, Float64
from gvpipe.io.usd.motion import Skins, UsdMotion

MOST = 1_000_000  # instances of a stage


class Instancer:
    """A point instancer, whose transforms are computed once for each time.

    Args:
        prim: of it.
        start: time code at which its instances are counted.
    """

    def __init__(self, prim: Any, start: float) -> None:
        from pxr import UsdGeom

        self.prim, self._start = prim, start
        self.schema = UsdGeom.PointInstancer(prim)
        self.prototypes = [prim.GetStage().GetPrimAtPath(path) for path in self.schema.GetPrototypesRel().GetForwardedTargets()]
        self.numbers = np.array(self.schema.GetProtoIndicesAttr().Get(start) or (), np.int64).reshape(-1)
        attributes = (
            self.schema.GetPositionsAttr(), self.schema.GetOrientationsAttr(), self.schema.GetScalesAttr(),
            self.schema.GetProtoIndicesAttr(), self.schema.GetInvisibleIdsAttr(), self.schema.GetVelocitiesAttr(),
        )  # fmt: skip
        self._moving = [each for each in attributes if each and each.ValueMightBeTimeVarying()]
        self.moves = bool(self._moving)
        self._time: float | None = None
        self._found: tuple[Float64, Bool] = np.zeros((0, 4, 4)), np.zeros(0, bool)

    def samples(self) -> Iterable[float]:
        """Times of its samples."""
        for attribute in self._moving:
            yield from attribute.GetTimeSamples()

    def at(self, time: float) -> tuple[Float64, Bool]:
        """Transforms ``(n, 4, 4)`` of all instances, applied to rows, and which are shown ``(n,)``.

        Raises:
            ValueError: there are others than at the start.
        """
        from pxr import Usd, UsdGeom

        if time != self._time:
            kind = UsdGeom.PointInstancer
            when = Usd.TimeCode(time)
            made = self.schema.ComputeInstanceTransformsAtTime(when, when, kind.IncludeProtoXform, kind.IgnoreMask)
            transforms = np.array(made, np.float64).reshape(-1, 4, 4)
            numbers = np.array(self.schema.GetProtoIndicesAttr().Get(when) or (), np.int64).reshape(-1)
            if len(transforms) != len(self.numbers) or not np.array_equal(numbers, self.numbers):
                raise ValueError(f"instancer {self.prim.GetPath()} has other instances than at first, which is not read")
            mask = self.schema.ComputeMaskAtTime(when)
            shown = np.array(mask, bool) if len(mask) else np.ones(len(numbers), bool)
            self._found, self._time = (transforms, shown), time
        return self._found


@dataclass(frozen=True)
class Instance:
    """One mesh of one instance.

    Args:
        instancer: that shows it.
        root: of its prototype.
        number: of the instance.
    """

    instancer: Instancer
    root: Any
    number: int


class InstanceMotion(UsdMotion):
    """How a mesh of an instance moves; see `UsdMotion`."""

    def __init__(self, mesh: Any, skins: Skins, places: Any, start: float, instance: Instance) -> None:
        self._instance = instance
        super().__init__(mesh, skins, places, start)
        self.name = f"{self.name} of instance {instance.number} of {instance.instancer.prim.GetPath()}"
        self.moves = self.moves or instance.instancer.moves

    def samples(self) -> Iterable[float]:
        """Times of all samples that move it or change its polygons."""
        yield from super().samples()
        yield from self._instance.instancer.samples()

    def is_hidden(self, time: float) -> bool:
        """Whether it is not shown at a time code."""
        return bool(super().is_hidden(time) or not self._instance.instancer.at(time)[1][self._instance.number])

    def _world(self, time: float) -> Float64:
        local = super()._world(time)
        root, instancer = (
            np.array(self._places.GetLocalToWorldTransform(prim), np.float64)
            for prim in (self._instance.root, self._instance.instancer.prim)
        )
        return np.asarray(local @ np.linalg.inv(root) @ self._instance.instancer.at(time)[0][self._instance.number] @ instancer)


def find_instances(prim: Any, start: float) -> tuple[list[tuple[Any, Instance]], list[str]]:
    """The meshes that a point instancer shows, instance after instance, and the types of all other prims in its prototypes."""
    from pxr import Usd, UsdGeom

    instancer = Instancer(prim, start)
    others: list[str] = []
    meshes: list[list[Any]] = []
    for root in instancer.prototypes:
        below = list(Usd.PrimRange(root, Usd.TraverseInstanceProxies())) if root else []
        others += [str(each.GetTypeName()) for each in below if not each.IsA(UsdGeom.Mesh)]
        meshes.append([UsdGeom.Mesh(each) for each in below if each.IsA(UsdGeom.Mesh)])
    if len(instancer.numbers) > MOST:
        raise ValueError(f"instancer {prim.GetPath()} has {len(instancer.numbers)} instances; at most {MOST} are read")
    found = [
        (mesh, Instance(instancer, instancer.prototypes[prototype], number))
        for number, prototype in enumerate(instancer.numbers.tolist())
        if 0 <= prototype < len(meshes)
        for mesh in meshes[prototype]
    ]
    return found, others


def is_hidden_below(mesh: Any, root: Any) -> bool:
    """Whether a mesh, or what holds it in its prototype, is never shown; what hides the prototype's parents does not count."""
    from pxr import UsdGeom

    prim = mesh.GetPrim()
    while prim and prim.GetPath().HasPrefix(root.GetPath()):
        visibility = UsdGeom.Imageable(prim).GetVisibilityAttr()
        if visibility and not visibility.ValueMightBeTimeVarying() and visibility.Get() == UsdGeom.Tokens.invisible:
            return True
        prim = prim.GetParent()
    return False
