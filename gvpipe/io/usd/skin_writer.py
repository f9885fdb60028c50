"""A sequence's motion as a UsdSkel skeleton: the bind pose once, and a transform of each joint in each frame.

A joint's motion is affine. It is two joints of USD (`gvpipe.io.scene.affine_nodes`), whose product programs work out. USD has
scales as half floats, so that vertices may be off by 1 / 4096 of their distance from their joint's middle.

Source: Pixar, OpenUSD, UsdSkel schemas (Skeleton, SkelAnimation, BindingAPI).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from gvpipe.foundation.arrays import Float64
from gvpipe.foundation.errors import InputError
from gvpipe.io.scene.affine_nodes import AffineNodes, factor, joint_pivots, moved_to
from gvpipe.io.scene.export import ExportMesh
from gvpipe.model.skin import INFLUENCES, Skin, extent_of

MOST_HALF = 65504.0  # the largest half float
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

    skeleton = UsdSkel.Skeleton.Define(stage, f"{root}/Skeleton")
    names = [name for j in range(skin.joints) for name in (f"joint_{j}_frame", f"joint_{j}_frame/joint_{j}")]
    pivots = joint_pivots(skin)
    bind = [Gf.Matrix4d().SetTranslate(Gf.Vec3d(*pivot)) for pivot in pivots.tolist()]
    skeleton.CreateJointsAttr(Vt.TokenArray(names))
    skeleton.CreateBindTransformsAttr(Vt.Matrix4dArray([each for each in bind for _ in range(2)]))
    skeleton.CreateRestTransformsAttr(Vt.Matrix4dArray([each for one in bind for each in (one, Gf.Matrix4d(1))]))
    animation = UsdSkel.Animation.Define(stage, f"{root}/Skeleton/Animation")
    animation.CreateJointsAttr(Vt.TokenArray(names))
    _write_samples(animation, factor(moved_to(skin.transforms, pivots)), start, name)
    UsdSkel.BindingAPI.Apply(skeleton.GetPrim()).CreateAnimationSourceRel().SetTargets([animation.GetPath()])
    for drawn, mesh in meshes:
        own = slice(*mesh.vertices)
        binding = UsdSkel.BindingAPI.Apply(drawn.GetPrim())
        binding.CreateSkeletonRel().SetTargets([Sdf.Path(f"{root}/Skeleton")])
        inner = 2 * skin.indices[own].reshape(-1) + 1
        binding.CreateJointIndicesPrimvar(False, INFLUENCES).Set(Vt.IntArray.FromNumpy(inner.astype(np.int32)))
        weights = np.ascontiguousarray(skin.weights[own].reshape(-1), np.float32)
        binding.CreateJointWeightsPrimvar(False, INFLUENCES).Set(Vt.FloatArray.FromNumpy(weights))
        binding.CreateGeomBindTransformAttr(Gf.Matrix4d(1))


def _write_samples(animation: Any, nodes: AffineNodes, start: float, name: str) -> None:
    """Translations, rotations and scales of the joints ``(F, J)``, each with the one below it."""
    from pxr import Usd, Vt

    translations, rotations, scales = (
        animation.CreateTranslationsAttr(),
        animation.CreateRotationsAttr(),
        animation.CreateScalesAttr(),
    )
    n_frames, n_joints = nodes.scales.shape[:2]
    largest = float(np.abs(nodes.scales).max(initial=0))
    if largest > MOST_HALF:
        raise InputError(
            f"{name}: a joint grows to {largest:g} times the bind pose, and USD's scales end at {MOST_HALF:g}; write a .glb, "
            "or points without a skeleton"
        )
    moves = np.zeros((n_frames, n_joints, 2, 3))
    moves[:, :, 0] = nodes.translations
    sizes = np.ones((n_frames, n_joints, 2, 3))
    sizes[:, :, 0] = nodes.scales
    turns = np.stack([nodes.rotations, nodes.inner], axis=2)
    for k in range(n_frames):
        time = Usd.TimeCode(start + k) if n_frames > 1 else Usd.TimeCode.Default()
        translations.Set(Vt.Vec3fArray.FromNumpy(moves[k].reshape(-1, 3).astype(np.float32)), time)
        rotations.Set(Vt.QuatfArray.FromNumpy(turns[k].reshape(-1, 4).astype(np.float32)), time)  # x, y, z, w, as USD keeps it
        scales.Set(Vt.Vec3hArray.FromNumpy(sizes[k].reshape(-1, 3).astype(np.float16)), time)


def is_first_frame(skin: Skin) -> bool:
    """Whether the bind pose is the first frame, whose normals are then those of the bind pose."""
    off: Float64 = np.linalg.norm(skin.evaluate(0).astype(np.float64) - skin.bind, axis=1)
    return float(off.max(initial=0)) <= MOVES_FIRST * extent_of(skin.bind)
