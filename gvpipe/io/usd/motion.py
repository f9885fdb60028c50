"""How a USD mesh moves: points at a time, blend shapes, skinning, transforms, all evaluated by the library."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from gvpipe.foundation.arrays import Array, Float64


class Skins:
    """The skinned meshes of a stage: for each its skeleton and what binds it."""

    def __init__(self, stage: Any) -> None:
        from pxr import Usd, UsdSkel

        self._cache = UsdSkel.Cache()  # it must outlive its queries
        self._bound: dict[str, tuple[Skeleton, Any]] = {}
        everything = Usd.TraverseInstanceProxies()
        for prim in Usd.PrimRange(stage.GetPseudoRoot(), everything):
            if not prim.IsA(UsdSkel.Root):
                continue
            root = UsdSkel.Root(prim)
            self._cache.Populate(root, everything)
            for binding in self._cache.ComputeSkelBindings(root, everything):
                skeleton = Skeleton(self._cache.GetSkelQuery(binding.GetSkeleton()), binding.GetSkeleton().GetPrim())
                for query in binding.GetSkinningTargets():
                    self._bound[str(query.GetPrim().GetPath())] = (skeleton, query)

    def of(self, prim: Any) -> tuple[Skeleton, Any] | None:
        """The skeleton of a mesh and its skinning query, or None."""
        return self._bound.get(str(prim.GetPath()))


class Skeleton:
    """A skeleton with its animation; what several meshes share is computed once per time."""

    def __init__(self, query: Any, prim: Any) -> None:
        self.query = query
        self.prim = prim  # inside of an instance, where the query's own is the prototype's
        self.animation = query.GetAnimQuery()
        self._time: float | None = None
        self._transforms: Any = None

    @property
    def moves(self) -> bool:
        """Whether its joints or its blend shapes' weights change over time."""
        if not self.animation:
            return False
        return bool(self.animation.JointTransformsMightBeTimeVarying() or self.animation.BlendShapeWeightsMightBeTimeVarying())

    def samples(self) -> list[float]:
        """Times of its samples."""
        if not self.animation:
            return []
        return [*self.animation.GetJointTransformTimeSamples(), *self.animation.GetBlendShapeWeightTimeSamples()]

    def transforms(self, time: float) -> Any:
        """Skinning transforms of its joints, as the library's array of matrices."""
        if time != self._time:
            self._transforms, self._time = self.query.ComputeSkinningTransforms(time), time
        return self._transforms

    def weights(self, time: float) -> Any:
        """Weights of its blend shapes, or None."""
        return self.animation.ComputeBlendShapeWeights(time) if self.animation else None


class UsdMotion:
    """How one mesh moves.

    Args:
        mesh: the UsdGeom.Mesh.
        skins: of the stage.
        places: the stage's cache of transforms, shared by all meshes.
        start: time code of the first frame.
    """

    def __init__(self, mesh: Any, skins: Skins, places: Any, start: float) -> None:
        self.prim = mesh.GetPrim()
        self._kept = (self.prim.GetStage(), skins)  # prims do not keep their stage alive, nor queries their cache
        self.name = str(self.prim.GetPath())
        self._points = mesh.GetPointsAttr()
        self._places = places
        skin = skins.of(self.prim)
        self._skeleton: Skeleton | None = skin[0] if skin else None
        self._query: Any = skin[1] if skin else None
        self._is_skinned = bool(self._query and self._query.HasJointInfluences())
        self._shapes = BlendShapes(self._query) if self._query and self._query.HasBlendShapes() else None
        self.moves = self._points.ValueMightBeTimeVarying() or bool(self._skeleton and self._skeleton.moves)
        self.moves = self.moves or any(part.TransformMightBeTimeVarying() for part in self._ancestors())
        self._hiding = visibility_samples(self.prim)
        self.moves = self.moves or bool(self._hiding)
        topology = (mesh.GetFaceVertexCountsAttr(), mesh.GetFaceVertexIndicesAttr())
        self._topology = [each for each in topology if each.ValueMightBeTimeVarying()]
        self._is_deformed = self._points.ValueMightBeTimeVarying() or bool(self._query)
        self._rest: Float64 | None = None  # points that never change in the mesh's own space
        self.n_vertices = len(self._points.Get(start) or ())

    @property
    def has_points(self) -> bool:
        """Whether it has points at any time."""
        return any(len(self._points.Get(time) or ()) for time in self._points.GetTimeSamples())

    def samples(self) -> Iterable[float]:
        """Times of all samples that move it or change its polygons."""
        yield from self._points.GetTimeSamples()
        for attribute in self._topology:
            yield from attribute.GetTimeSamples()
        yield from self._skeleton.samples() if self._skeleton else ()
        for part in self._ancestors():
            yield from part.GetTimeSamples()
        yield from self._hiding

    @property
    def flickers(self) -> bool:
        """Whether it is hidden for a while."""
        return bool(self._hiding)

    def is_hidden(self, time: float) -> bool:
        """Whether it is not visible at a time code; a mesh whose visibility never changes is shown."""
        from pxr import UsdGeom

        return bool(self._hiding and UsdGeom.Imageable(self.prim).ComputeVisibility(time) == UsdGeom.Tokens.invisible)

    def at(self, time: float) -> Array:
        """Positions ``(n, 3)`` in world space at a time code.

        Raises:
            ValueError: it has no points then, or skinning failed.
        """
        if self._rest is None:
            points = self._points.Get(time)
            if points is None:
                raise ValueError("it has no points")
            exact = self._deform(points, time)
            self._rest = None if self._is_deformed else exact
        else:
            exact = self._rest
        return self._place(exact, time)

    def linear(self, time: float) -> Float64:
        """How its directions turn: ``(3, 3)``, or ``(n, 3, 3)`` where each vertex has its own; rows are the images of x, y, z.

        Skinning moves a point by an affine map of its own. So the differences of moved points are that map, exactly.
        """
        world = self._world(time)[:3, :3]
        if not self._is_skinned:
            return world
        points = self._points.Get(time)
        rest = np.array(points, np.float64).reshape(-1, 3)
        reach = float(np.ptp(rest, axis=0).max(initial=0)) or 1.0
        moved = [self._skinned(rest + reach * np.eye(3)[axis], time) for axis in range(3)]
        own = (np.stack(moved, axis=1) - self._skinned(rest, time)[:, None]) / reach  # (n, axis, 3)
        return np.asarray(own @ world)

    def _deform(self, points: Any, time: float) -> Float64:
        if self._shapes and self._skeleton:
            weights = self._skeleton.weights(time)
            if weights is not None:
                points = self._shapes.apply(points, weights)
        exact = np.array(points, np.float64).reshape(-1, 3)
        return self._skinned(exact, time) if self._is_skinned else exact

    def _skinned(self, points: Float64, time: float) -> Float64:
        from pxr import Vt

        assert self._skeleton is not None
        moved = Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(points, np.float32))  # changed in place below
        if not self._query.ComputeSkinnedPoints(self._skeleton.transforms(time), moved, time):
            raise ValueError("its skinning weights or joints do not fit its skeleton")
        return np.array(moved, np.float64).reshape(-1, 3)

    def _place(self, points: Float64, time: float) -> Float64:
        world = self._world(time)
        return points if (world == np.eye(4)).all() else np.asarray(points @ world[:3, :3] + world[3, :3])

    def _world(self, time: float) -> Float64:
        """``(4, 4)``, applied to rows; of skinned meshes the skeleton's, since skinned points are in its space."""
        self._places.SetTime(time)
        prim = self._skeleton.prim if self._is_skinned and self._skeleton else self.prim
        return np.array(self._places.GetLocalToWorldTransform(prim), np.float64)

    def _ancestors(self) -> Iterable[Any]:
        """The transformable prims from the one that places it upwards."""
        from pxr import UsdGeom

        prim = self._skeleton.prim if self._is_skinned and self._skeleton else self.prim
        while prim and not prim.IsPseudoRoot():
            if prim.IsA(UsdGeom.Xformable):
                yield UsdGeom.Xformable(prim)
            prim = prim.GetParent()


def visibility_samples(prim: Any) -> list[float]:
    """Times at which the visibility of a prim may change, its own or that of one above it."""
    from pxr import UsdGeom

    found: list[float] = []
    while prim and not prim.IsPseudoRoot():
        drawn = UsdGeom.Imageable(prim)
        if drawn and drawn.GetVisibilityAttr().ValueMightBeTimeVarying():
            found += drawn.GetVisibilityAttr().GetTimeSamples()
        prim = prim.GetParent()
    return found


class BlendShapes:
    """The blend shapes of one mesh."""

    def __init__(self, query: Any) -> None:
        from pxr import UsdSkel

        self._query = UsdSkel.BlendShapeQuery(UsdSkel.BindingAPI(query.GetPrim()))
        self._mapper = query.GetBlendShapeMapper()
        self._indices = self._query.ComputeBlendShapePointIndices()
        self._offsets = self._query.ComputeSubShapePointOffsets()

    def apply(self, points: Any, weights: Any) -> Any:
        """Return the points moved by the shapes, given the animation's weights."""
        if self._mapper is not None:
            weights = self._mapper.Remap(weights)
        weighed = self._query.ComputeSubShapeWeights(weights)
        if not self._query.ComputeDeformedPoints(*weighed, self._indices, self._offsets, points):
            raise ValueError("its blend shapes do not fit its points")
        return points
