"""A sequence's motion as a UsdSkel skeleton: the bind pose once, and a transform of each joint in each frame.

A joint's motion is affine. It is two joints of USD (`gvpipe.io.scene.affine_nodes`), whose product programs work out. A rigid
joint is one of USD's, below its parent. Corrective shapes are blend shapes of the meshes that they change. USD has scales as
half floats, so that vertices may be off by 1 / 4096 of their distance from their joint's middle.

Source: Pixar, OpenUSD, UsdSkel schemas (Skeleton, SkelAnimation, BindingAPI).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from gvpipe.foundation.arrays import Float32, Float64, Int32
from gvpipe.foundation.errors import InputError
from gvpipe.io.scene.affine_nodes import AffineNodes, factor, from_roots, joint_pivots, moved_to, under_parents
from gvpipe.io.scene.export import ExportMesh
from gvpipe.model.skin import INFLUENCES, Skin, extent_of, joint_means

LEAST_HALF, MOST_HALF = 2.0**-14, 65504.0  # the range of half floats that have all their digits
MOVES_FIRST = 1e-3  # of the diagonal: the first frame is the bind pose if no vertex is farther off


def write_skeleton(stage: Any, root: str, skin: Skin, meshes: list[tuple[Any, ExportMesh]], start: float, name: str) -> None:
    """Add a skeleton below a SkelRoot, its animation, and how meshes follow it, whose points are the bind pose.

    Args:
        stage: of USD.
        root: path of its SkelRoot.
        skin: of the sequence's vertices.
        meshes: as USD has them.
        start: time code of the first frame.
        name: of the file, for messages.

    Raises:
        InputError: a joint grows by more than a half float holds.
    """
    from pxr import Gf, Sdf, UsdSkel, Vt

    pivots = joint_pivots(skin)
    placed = moved_to(skin.transforms, pivots)
    skeleton = UsdSkel.Skeleton.Define(stage, f"{root}/Skeleton")
    animation = UsdSkel.Animation.Define(stage, f"{root}/Skeleton/Animation")
    if skin.parents is None:
        own_row = 2 * np.arange(skin.joints) + 1
        names = [name for j in range(skin.joints) for name in (f"joint_{j}_frame", f"joint_{j}_frame/joint_{j}")]
        bind = np.repeat(pivots, 2, axis=0)
        rest = np.where(np.arange(len(bind))[:, None] % 2, 0.0, bind)
        nodes = _in_pairs(factor(placed))
    else:
        order, _ = from_roots(skin.parents)
        own_row = np.argsort(order)
        names = _paths(order, skin.parents)
        bind = pivots[order]
        rest = bind - np.where(skin.parents[order, None] >= 0, pivots[skin.parents[order]], 0.0)
        middles = joint_means(skin, skin.bind) - pivots
        nodes = factor(under_parents(_as_halves(placed, order, skin.parents, middles), skin.parents)[:, order])
    for described in (skeleton.CreateJointsAttr, animation.CreateJointsAttr):
        described(Vt.TokenArray(names))
    skeleton.CreateBindTransformsAttr(_shifts(bind))
    skeleton.CreateRestTransformsAttr(_shifts(rest))
    _write_samples(animation, nodes, start, name)
    UsdSkel.BindingAPI.Apply(skeleton.GetPrim()).CreateAnimationSourceRel().SetTargets([animation.GetPath()])
    _write_shape_weights(animation, skin, start)
    for drawn, mesh in meshes:
        own = slice(*mesh.vertices)
        binding = UsdSkel.BindingAPI.Apply(drawn.GetPrim())
        binding.CreateSkeletonRel().SetTargets([Sdf.Path(f"{root}/Skeleton")])
        joints = own_row[skin.indices[own].reshape(-1)]
        binding.CreateJointIndicesPrimvar(False, INFLUENCES).Set(Vt.IntArray.FromNumpy(joints.astype(np.int32)))
        weights = np.ascontiguousarray(skin.weights[own].reshape(-1), np.float32)
        binding.CreateJointWeightsPrimvar(False, INFLUENCES).Set(Vt.FloatArray.FromNumpy(weights))
        _write_shapes(stage, drawn.GetPrim(), binding, skin.shapes[:, own])
        binding.CreateGeomBindTransformAttr(Gf.Matrix4d(1))


def _paths(order: list[int], parents: Int32) -> list[str]:
    """The path of each joint, in order: parents come first."""
    paths: dict[int, str] = {}
    for j in order:
        above = f"{paths[int(parents[j])]}/" if parents[j] >= 0 else ""
        paths[j] = f"{above}joint_{j}"
    return [paths[j] for j in order]


def _as_halves(placed: Float64, order: list[int], parents: Int32, middles: Float64) -> Float64:
    """Transforms ``(F, J, 4, 4)`` of rigid joints, whose sizes over their parents' are half floats.

    The middle ``(J, 3)`` of what follows a joint stays where it was. So a joint is off by its own rounding alone, not by that
    of all joints above it. Sizes without such a float stay.
    """
    result = placed.copy()
    sizes = np.cbrt(np.abs(np.linalg.det(placed[..., :3, :3])))
    rounded = np.ones_like(sizes)
    for j in order:
        above = rounded[:, parents[j]] if parents[j] >= 0 else 1.0
        own = sizes[:, j] / above
        is_held = (own >= LEAST_HALF) & (own <= MOST_HALF)
        rounded[:, j] = above * np.where(is_held, np.clip(own, LEAST_HALF, MOST_HALF).astype(np.float16), own)
        result[:, j, :3, :3] *= (rounded[:, j] / sizes[:, j])[:, None, None]
        result[:, j, :3, 3] += (placed[:, j, :3, :3] - result[:, j, :3, :3]) @ middles[j]
    return result


def _in_pairs(nodes: AffineNodes) -> AffineNodes:
    """Nodes ``(F, 2 J, ...)``: each outer one, and after it the inner one, which only turns."""
    n_frames, n_joints = nodes.scales.shape[:2]
    moves, sizes = np.zeros((n_frames, n_joints, 2, 3)), np.ones((n_frames, n_joints, 2, 3))
    moves[:, :, 0], sizes[:, :, 0] = nodes.translations, nodes.scales
    turns = np.stack([nodes.rotations, nodes.inner], axis=2)
    shape = n_frames, 2 * n_joints
    return AffineNodes(moves.reshape(*shape, 3), turns.reshape(*shape, 4), sizes.reshape(*shape, 3), turns.reshape(*shape, 4))


def _shifts(points: Float64) -> Any:
    """Matrices that move to ``points (J, 3)``."""
    from pxr import Gf, Vt

    return Vt.Matrix4dArray([Gf.Matrix4d().SetTranslate(Gf.Vec3d(*point)) for point in points.tolist()])


def _write_shapes(stage: Any, prim: Any, binding: Any, shapes: Float32) -> None:
    """Add blend shapes ``(C, n, 3)`` below a mesh, those that change it, of the points that they move."""
    from pxr import UsdSkel, Vt

    used = np.flatnonzero(shapes.any(axis=(1, 2))).tolist()
    if not used:
        return
    paths = []
    for number in used:
        shape = UsdSkel.BlendShape.Define(stage, prim.GetPath().AppendChild(_shape_name(number)))
        moved = np.flatnonzero(shapes[number].any(axis=1)).astype(np.int32)
        shape.CreateOffsetsAttr(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(shapes[number, moved])))
        shape.CreatePointIndicesAttr(Vt.IntArray.FromNumpy(moved))
        paths.append(shape.GetPath())
    binding.CreateBlendShapesAttr(Vt.TokenArray([_shape_name(number) for number in used]))
    binding.CreateBlendShapeTargetsRel().SetTargets(paths)


def _write_shape_weights(animation: Any, skin: Skin, start: float) -> None:
    from pxr import Vt

    if not len(skin.shapes):
        return
    animation.CreateBlendShapesAttr(Vt.TokenArray([_shape_name(number) for number in range(len(skin.shapes))]))
    weights = animation.CreateBlendShapeWeightsAttr()
    for k in range(skin.n_frames):
        weights.Set(Vt.FloatArray.FromNumpy(skin.shape_weights[k].astype(np.float32)), _time(k, start, skin.n_frames))


def _shape_name(number: int) -> str:
    return f"corrective_{number}"


def _time(frame: int, start: float, n_frames: int) -> Any:
    from pxr import Usd

    return Usd.TimeCode(start + frame) if n_frames > 1 else Usd.TimeCode.Default()


def _write_samples(animation: Any, nodes: AffineNodes, start: float, name: str) -> None:
    """Translations, rotations and scales of joints ``(F, J)``; their inner nodes are not looked at."""
    from pxr import Vt

    translations, rotations, scales = (
        animation.CreateTranslationsAttr(),
        animation.CreateRotationsAttr(),
        animation.CreateScalesAttr(),
    )
    n_frames = len(nodes.scales)
    largest = float(np.abs(nodes.scales).max(initial=0))
    if largest > MOST_HALF:
        raise InputError(
            f"{name}: a joint grows to {largest:g} times the bind pose, and USD's scales end at {MOST_HALF:g}; write a .glb, "
            "or points without a skeleton"
        )
    for k in range(n_frames):
        time = _time(k, start, n_frames)
        translations.Set(Vt.Vec3fArray.FromNumpy(nodes.translations[k].astype(np.float32)), time)
        rotations.Set(Vt.QuatfArray.FromNumpy(nodes.rotations[k].astype(np.float32)), time)  # x, y, z, w, as USD keeps it
        scales.Set(Vt.Vec3hArray.FromNumpy(nodes.scales[k].astype(np.float16)), time)


def is_first_frame(skin: Skin) -> bool:
    """Whether the bind pose is the first frame, whose normals are then those of the bind pose."""
    off: Float64 = np.linalg.norm(skin.evaluate(0).astype(np.float64) - skin.bind, axis=1)
    return float(off.max(initial=0)) <= MOVES_FIRST * extent_of(skin.bind)
