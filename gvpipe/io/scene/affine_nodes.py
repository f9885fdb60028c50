"""Affine motions as two nodes each, for scenes whose nodes know translation, rotation and scale alone.

``A = U S V^T`` (singular value decomposition): a node with translation t, rotation U and scale S, and below it one with
rotation V^T. Their product is ``[A | t]``. U and V are not unique. Axes can swap and turn, and where two scales are equal, any
turn between their axes will do. Each moment takes the choice that is nearest to the one before.

Players interpolate each of the four by itself. Between frames the joint should be near the mean of its two matrices: near for
the way that it goes, since what turns evenly leaves the straight way. A joint has keys where it needs them for that: at few
frames where it moves evenly, and between frames where its factors turn fast.
"""

from __future__ import annotations

from itertools import permutations, product
from typing import NamedTuple

import numpy as np

from gvpipe.foundation.arrays import Array, Bool, Float64, Int32, Int64
from gvpipe.model.skin import Skin, extent_of, joint_means

BLOCK = 32  # joints that are looked at together; what that takes is many times their matrices
PER_FRAME = 4  # moments from a frame to the next: a power of two
COARSEST = 32 * PER_FRAME  # moments of the longest span between keys
AT_FRAMES, BETWEEN = 4e-6, 1e-3  # of the diagonal: how far off a joint may be, at frames and between them
OF_ERROR, OF_RMSE = 0.02, 0.3  # of a skin's largest error, and of its root mean square: the same, at frames
OF_STEP = 0.15  # of the way from a frame to the next: the same, between them; an even turn by 60 degrees stays within
EQUAL = 1e-6  # part of the largest scale by which scales may differ and count as equal


class AffineNodes(NamedTuple):
    """J motions at G moments.

    Args:
        translations: ``(G, J, 3)``.
        rotations: ``(G, J, 4)`` quaternions x, y, z, w of the outer node.
        scales: ``(G, J, 3)``; one may be below 0.
        inner: ``(G, J, 4)`` quaternions of the inner node.
    """

    translations: Float64
    rotations: Float64
    scales: Float64
    inner: Float64


class Keys(NamedTuple):
    """When each joint has a key.

    Args:
        nodes: at all moments, ``per_frame`` of them from each frame to the next; they move points relative to the pivots.
        is_key: ``(G, J)``; the first and the last moment always are.
        pivots: ``(J, 3)``: the middle of what follows each joint, so that a turn about it moves little else.
        reach: ``(J,)``: how far from its pivot a vertex that follows a joint, or hangs on it, is in the bind pose, at most.
        precision: how far off a joint may be at frames, as a distance.
    """

    nodes: AffineNodes
    is_key: Bool
    pivots: Float64
    reach: Float64
    precision: float
    per_frame: int = PER_FRAME


def find_keys(skin: Skin) -> Keys:
    """The nodes and keys of a skin's joints: few where players find what lies between, more where they would not.

    Joints that have parents are relative to these, and have keys at frames alone: players turn them as bones turn.
    """
    pivots = joint_pivots(skin)
    diagonal = extent_of(skin.bind)
    at_frames = max(AT_FRAMES, np.nan_to_num(min(OF_ERROR * skin.error, OF_RMSE * skin.rmse)))
    if skin.parents is not None:
        return _find_tree_keys(skin, skin.parents, pivots, diagonal * at_frames)
    corners = _corners(*_boxes(skin), pivots)
    tolerances = diagonal * at_frames, diagonal * max(BETWEEN, at_frames)
    found = []
    for first in range(0, skin.joints, BLOCK):
        own = slice(first, first + BLOCK)
        moments = _between_frames(moved_to(skin.transforms[:, own], pivots[own]))
        nodes = factor(moments)
        frames = moments[::PER_FRAME]
        steps = _farthest(frames[1:] - frames[:-1], corners[own])  # (F - 1, J) from a frame to the next
        allowed = np.full(moments.shape[:2], tolerances[0])
        for k in range(1, PER_FRAME):
            allowed[k::PER_FRAME] = np.maximum(tolerances[1], OF_STEP * steps)
        found.append((nodes, _choose(nodes, moments, corners[own], allowed)))
    nodes = AffineNodes(*(np.concatenate(parts, axis=1) for parts in zip(*(one for one, _ in found), strict=True)))
    is_key = np.concatenate([one for _, one in found], axis=1)
    reach = np.linalg.norm(corners[:, :, :3], axis=2).max(axis=1)
    return Keys(nodes, is_key, pivots, reach, tolerances[0])


def _find_tree_keys(skin: Skin, parents: Int32, pivots: Float64, precision: float) -> Keys:
    """As `find_keys`. What a joint is off by moves all that hangs on it, so that a chain shares the precision.

    Where a parent grows, what its child is off by grows with it.
    """
    placed = moved_to(skin.transforms, pivots)
    local = under_parents(placed, parents)
    order, depth = from_roots(parents)
    low, high = _boxes(skin)
    for j in order[::-1]:
        if parents[j] >= 0:
            low[parents[j]], high[parents[j]] = np.minimum(low[parents[j]], low[j]), np.maximum(high[parents[j]], high[j])
    corners, nodes = _corners(low, high, pivots), factor(local)
    grown = float(np.cbrt(np.abs(np.linalg.det(placed[:, parents[parents >= 0], :3, :3]))).max(initial=1.0))
    shared = precision / (depth.max() + 1) / grown
    is_key = _choose(nodes, local, corners, np.full(local.shape[:2], shared))
    reach = np.linalg.norm(corners[:, :, :3], axis=2).max(axis=1)
    return Keys(nodes, is_key, pivots, reach, shared, 1)


def under_parents(placed: Float64, parents: Int32) -> Float64:
    """Transforms ``(F, J, 4, 4)`` of a scene, each relative to its parent's, if it has one."""
    above = np.where(parents[None, :, None, None] >= 0, placed[:, np.maximum(parents, 0)], np.eye(4))
    return np.asarray(np.linalg.solve(above, placed), np.float64)


def from_roots(parents: Int32) -> tuple[list[int], Int64]:
    """Joints, each after its parent; and how many are above each."""
    depth = np.full(len(parents), -1)
    depth[parents < 0] = 0
    order = np.flatnonzero(parents < 0).tolist()
    for joint in order:  # grows
        below = np.flatnonzero(parents == joint)
        depth[below] = depth[joint] + 1
        order.extend(below.tolist())
    return order, depth


def _choose(nodes: AffineNodes, moments: Float64, corners: Float64, allowed: Float64) -> Bool:
    """``(G, J)``: where joints have keys, so that they are no farther off than ``allowed (G, J)``.

    Spans of `COARSEST` moments are halved, for each joint by itself, until it is near enough at all moments inside.
    """
    last = len(moments) - 1
    is_key = np.zeros(moments.shape[:2], bool)
    is_key[::COARSEST] = is_key[-1] = True
    if not last:
        return is_key
    step = COARSEST
    while step > 1:
        starts = np.arange(0, last, step)
        stops = np.minimum(starts + step, last)
        is_far = np.zeros((len(starts), moments.shape[1]), bool)
        for offset in range(1, step):
            at = np.minimum(starts + offset, stops)
            guess = matrices(_between(nodes, starts, stops, (at - starts) / (stops - starts)))
            is_far |= _farthest(guess - moments[at], corners) > allowed[at]
        is_far &= is_key[starts] & is_key[stops]
        middles = np.minimum(starts + step // 2, stops)
        is_key[middles] |= is_far
        step //= 2
    return is_key


def joint_pivots(skin: Skin) -> Float64:
    """``(J, 3)``: the middle of what follows each joint, as float32 has it."""
    own = joint_means(skin, skin.bind) if skin.pivots is None else skin.pivots
    return own.astype(np.float32).astype(np.float64)


def moved_to(transforms: Float64, pivots: Float64) -> Float64:
    """``transforms (F, J, 4, 4)`` of points relative to ``pivots (J, 3)``, rather than to the origin."""
    shifts = np.tile(np.eye(4), (len(pivots), 1, 1))
    shifts[:, :3, 3] = pivots
    return np.asarray(transforms @ shifts)


def _farthest(differences: Float64, corners: Float64) -> Float64:
    """``(n, J)``: how far differences of transforms ``(n, J, 4, 4)`` move the corners of each joint's box, at most."""
    moved = np.einsum("gjab,jcb->gjca", differences[..., :3, :], corners)
    return np.asarray(np.sqrt(np.square(moved).sum(axis=3).max(axis=2)))


def _between_frames(transforms: Float64) -> Float64:
    """``(G, J, 4, 4)`` at frames and between them, where matrices are means."""
    n_frames = len(transforms)
    result = np.empty((PER_FRAME * (n_frames - 1) + 1, *transforms.shape[1:]))
    for k in range(PER_FRAME):
        last = n_frames - (k > 0)
        part = k / PER_FRAME
        result[k::PER_FRAME] = transforms[:last] if not k else (1 - part) * transforms[:-1] + part * transforms[1:]
    return result


def _boxes(skin: Skin) -> tuple[Float64, Float64]:
    """Lowest and highest coordinates ``(J, 3)`` of the vertices that follow each joint; infinite where none does."""
    low, high = np.full((skin.joints, 3), np.inf), np.full((skin.joints, 3), -np.inf)
    vertices, column = np.nonzero(skin.weights)
    joints = skin.indices[vertices, column]
    np.minimum.at(low, joints, skin.bind[vertices])
    np.maximum.at(high, joints, skin.bind[vertices])
    return low, high


def _corners(low: Float64, high: Float64, pivots: Float64) -> Float64:
    """``(J, 8, 4)``: corners of each joint's box, relative to its pivot, with a 1; at the pivot where a box is infinite."""
    is_used = np.isfinite(low[:, :1])
    box = np.stack([np.where(is_used, low - pivots, 0), np.where(is_used, high - pivots, 0)])  # (2, J, 3)
    return np.stack(
        [np.stack([*(box[choice[axis], :, axis] for axis in range(3)), np.ones(len(pivots))], axis=1)
         for choice in product((0, 1), repeat=3)],
        axis=1,
    )  # fmt: skip


def _between(nodes: AffineNodes, start: Int64, stop: Int64, part: Float64) -> AffineNodes:
    """What players show between two moments, at a part ``(n,)`` of the way."""
    at = part[:, None, None]
    return AffineNodes(
        (1 - at) * nodes.translations[start] + at * nodes.translations[stop],
        _turned(nodes.rotations[start], nodes.rotations[stop], at),
        (1 - at) * nodes.scales[start] + at * nodes.scales[stop],
        _turned(nodes.inner[start], nodes.inner[stop], at),
    )


def _turned(one: Float64, two: Float64, at: Float64) -> Float64:
    """Rotations between two, by the shorter way and at an even rate (Shoemake, 1985)."""
    cosine = (one * two).sum(axis=-1, keepdims=True)
    two, cosine = np.where(cosine < 0, -two, two), np.minimum(np.abs(cosine), 1.0)
    angle = np.arccos(cosine)
    sine = np.sin(angle)
    is_small = sine < 1e-6
    safe = np.where(is_small, 1.0, sine)
    first = np.where(is_small, 1 - at, np.sin((1 - at) * angle) / safe)
    second = np.where(is_small, at, np.sin(at * angle) / safe)
    mixed = first * one + second * two
    return np.asarray(mixed / np.linalg.norm(mixed, axis=-1, keepdims=True))


def matrices(nodes: AffineNodes) -> Float64:
    """Mirror of `factor`: ``(G, J, 4, 4)``."""
    from scipy.spatial.transform import Rotation

    def turned(quaternions: Float64) -> Float64:
        found = Rotation.from_quat(quaternions.reshape(-1, 4)).as_matrix()
        return np.asarray(found.reshape(*quaternions.shape[:-1], 3, 3))

    result = np.zeros((*nodes.translations.shape[:2], 4, 4))
    result[..., :3, :3] = (turned(nodes.rotations) * nodes.scales[..., None, :]) @ turned(nodes.inner)
    result[..., :3, 3], result[..., 3, 3] = nodes.translations, 1
    return result


def factor(transforms: Float64) -> AffineNodes:
    """The nodes of ``transforms (G, J, 4, 4)``, for columns, one moment after the other."""
    outer, scales, inner = _decompose(transforms[..., :3, :3])
    before = np.tile(np.eye(3), (transforms.shape[1], 1, 1))
    turned, last, signs = before, before, np.ones((transforms.shape[1], 3))
    for k in range(len(transforms)):
        outer[k], scales[k], inner[k] = _nearest(outer[k], scales[k], inner[k], turned, last)
        _turn_freely(outer[k], scales[k], inner[k], last, signs)
        turned, last, signs = outer[k], inner[k], np.where(scales[k] < 0, -1.0, 1.0)
    return AffineNodes(
        np.ascontiguousarray(transforms[..., :3, 3]),
        _quaternions(outer),
        scales,
        _quaternions(np.swapaxes(inner, -1, -2)),
    )


def _decompose(linear: Float64) -> tuple[Float64, Float64, Float64]:
    """``U (..., 3, 3)``, ``S (..., 3)`` and ``V (..., 3, 3)``; U and V are rotations, so that a scale may be below 0."""
    u, s, vt = np.linalg.svd(linear)
    v = np.ascontiguousarray(np.swapaxes(vt, -1, -2))
    for rotation in (u, v):
        is_mirror = np.linalg.det(rotation) < 0
        rotation[is_mirror, :, 2] *= -1
        s[is_mirror, 2] *= -1
    return u, s, v


def _turns() -> Float64:
    """``(24, 3, 3)``: the rotations that take axes to axes."""
    made = []
    for order in permutations(range(3)):
        for signs in product((1, -1), repeat=3):
            turn = np.zeros((3, 3))
            turn[list(order), range(3)] = signs
            made.append(turn)
    every = np.array(made)
    return np.asarray(every[np.linalg.det(every) > 0])


TURNS = _turns()


def _nearest(u: Float64, s: Float64, v: Float64, turned: Float64, last: Float64) -> tuple[Float64, Float64, Float64]:
    """The choice of ``u, v (J, 3, 3)`` and ``s (J, 3)`` that is nearest to the rotations of the moment before."""
    likeness = np.swapaxes(u, -1, -2) @ turned + np.swapaxes(v, -1, -2) @ last
    turn = TURNS[np.einsum("pij,nij->np", TURNS, likeness).argmax(axis=1)]
    u, v, s = u @ turn, v @ turn, np.einsum("nij,ni->nj", np.abs(turn), s)
    largest = np.abs(s).max(axis=1)
    for axes in ((0, 1), (0, 2), (1, 2)):
        is_equal = np.ptp(s[:, axes], axis=1) <= EQUAL * largest
        if is_equal.any():
            own = _aligned(u[is_equal], v[is_equal], turned[is_equal], last[is_equal], axes)
            u[is_equal], v[is_equal] = u[is_equal] @ own, v[is_equal] @ own
    return u, s, v


def _turn_freely(u: Float64, s: Float64, v: Float64, last: Float64, signs: Float64) -> None:
    """Where all scales are equal, keep V and the signs of the scales, which may be any, and let U say the rest; in place."""
    size = np.abs(s)
    free = np.flatnonzero((np.ptp(size, axis=1) <= EQUAL * size.max(axis=1)) & (size.min(axis=1) > 0))
    if not len(free):
        return
    kept = signs[free].copy()
    kept[kept.prod(axis=1) != np.sign(s[free].prod(axis=1)), 2] *= -1
    linear = (u[free] * s[free, None, :]) @ np.swapaxes(v[free], -1, -2)
    v[free], s[free] = last[free], kept * size[free]
    u[free] = linear @ last[free] / s[free, None, :]


def _aligned(u: Float64, v: Float64, turned: Float64, last: Float64, axes: tuple[int, ...]) -> Float64:
    """The turn ``(n, 3, 3)`` between axes of equal scales that comes nearest to the moment before (Kabsch, 1976)."""
    likeness = np.swapaxes(u, -1, -2) @ turned + np.swapaxes(v, -1, -2) @ last
    block = likeness[:, axes][:, :, axes]
    a, _, bt = np.linalg.svd(block)
    a[np.linalg.det(a @ bt) < 0, :, -1] *= -1
    result = np.tile(np.eye(3), (len(u), 1, 1))
    result[np.ix_(range(len(u)), axes, axes)] = a @ bt
    return result


def _quaternions(rotations: Float64) -> Float64:
    """Quaternions ``(G, J, 4)`` of rotations ``(G, J, 3, 3)``, each in the half space of the moment before."""
    from scipy.spatial.transform import Rotation

    n_frames, n_joints = rotations.shape[:2]
    found = Rotation.from_matrix(rotations.reshape(-1, 3, 3)).as_quat().reshape(n_frames, n_joints, 4)
    flips: Bool = np.asarray((found[1:] * found[:-1]).sum(axis=-1) < 0)
    signs = np.cumprod(np.where(np.concatenate([np.zeros((1, n_joints), bool), flips]), -1.0, 1.0), axis=0)
    return np.asarray(found * signs[..., None])


def moves(values: Array, rest: Array, tolerance: float) -> bool:
    """Whether numbers ``(G, C)`` differ from those at rest ``(C,)`` at any moment."""
    return bool((np.abs(values - rest) > tolerance).any())
