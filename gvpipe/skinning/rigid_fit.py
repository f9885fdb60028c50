"""Skeletons of rigid joints: each turns, goes and grows alike along all axes, for engines whose bones know no shear.

Joints and weights of an affine skeleton are one start, clusters that move rigidly (`gvpipe.skinning.rigid_clusters`) the other.
From each, and further from the better one, two steps take turns, on some of the frames:

1. Joint after joint, the motion that mends most of what the others leave (Horn, 1987; Le and Deng, "Smooth Skinning
   Decomposition with Rigid Bones", 2012, section 4.3, with a scale).
2. The weights of each vertex over the joints that it and its neighbours follow: least squares, none below 0, four of them at
   most (there, section 4.2; the smallest joints leave first).

At last step 1 finds the motions of all frames. Joints that move the same vertices are tied to a tree, each about the point that
moves least against its parent.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gvpipe.foundation.arrays import Bool, Float64, Floats, Int32, Int64
from gvpipe.foundation.progress import Progress, silent
from gvpipe.mesh.topology import adjacency
from gvpipe.metrics.vertex_errors import frame_diagonal
from gvpipe.model.sequence import MeshSequence
from gvpipe.model.skin import INFLUENCES, Skin, joint_means
from gvpipe.skinning.rigid_clusters import split_clusters

if TYPE_CHECKING:
    from scipy import sparse

FRAMES = 32  # that weights are fitted on
CLUSTER_FRAMES = 12  # of these, that clusters are found in
TRIED, ROUNDS = 5, 10  # rounds of both steps: from each start, and from the better of them
SWEEPS = 3  # over all joints, in each
CANDIDATES = 8  # joints that a vertex may follow, of which four stay
BLOCK = 1024  # vertices whose weights are fitted together
OWN = 4.0  # times, what a vertex follows counts more than what a neighbour follows
POINT = 1e-15  # mean squared distance from the middle, in diagonals: what has less is one point
LEAST_SCALE = 1e-6
SHRUNK = 0.05  # of its largest size: a joint that gets smaller has none below it
PARTS = 4096  # of a weight: their sums are exact
TOWARDS_MIDDLE = 1e-3  # of a pivot's energy, towards the middle of what two joints share


class Members(NamedTuple):
    """Which vertices follow each joint: those of joint j are rows ``starts[j]`` to ``starts[j + 1]``.

    Args:
        vertices, weights: ``(n,)``.
        starts: ``(J + 1,)``.
    """

    vertices: Int64
    weights: Float64
    starts: Int64

    @classmethod
    def of(cls, indices: Int32, weights: Float64, n_joints: int) -> Members:
        """The members, given ``indices (V, 4)`` and ``weights (V, 4)``."""
        vertices, column = np.nonzero(weights)
        joints = indices[vertices, column]
        order = np.argsort(joints, kind="stable")
        starts = np.searchsorted(joints[order], np.arange(n_joints + 1))
        return cls(vertices[order], weights[vertices, column][order], starts)

    def at(self, joint: int) -> tuple[Int64, Float64]:
        """Vertices and weights of a joint."""
        own = slice(self.starts[joint], self.starts[joint + 1])
        return self.vertices[own], self.weights[own]


def make_rigid(skin: Skin, sequence: MeshSequence, report: Progress = silent) -> Skin:
    """A skeleton of rigid joints, tied to a tree, in place of an affine one; the bind pose is the first frame.

    Args:
        skin: whose joints and weights begin.
        sequence: that it is for.
        report: hears of the stage.
    """
    first = sequence.read(0, 1)[0]
    diagonal = frame_diagonal(sequence) or 1.0
    centre = (first.min(axis=0).astype(np.float64) + first.max(axis=0)) / 2
    bind = (first - centre) / diagonal
    chosen = np.unique(np.linspace(0, sequence.n_frames - 1, FRAMES).astype(int)).tolist()
    some = np.stack([(sequence.read(k, k + 1)[0] - centre) / diagonal for k in chosen])
    around = adjacency(sequence.faces, len(bind))
    starts = ((skin.indices, skin.weights.astype(np.float64)), _clusters(bind, some, skin.joints))
    found = [_alternate(bind, some, around, *start, skin.joints, TRIED) for start in starts]
    report("rigid skin", 2 * TRIED / (2 * TRIED + ROUNDS + 1))
    _, indices, weights = min(found, key=lambda one: one[0])
    _, indices, weights = _alternate(bind, some, around, indices, weights, skin.joints, ROUNDS)
    members = Members.of(indices, weights, skin.joints)
    report("rigid skin", (2 * TRIED + ROUNDS) / (2 * TRIED + ROUNDS + 1))
    transforms = np.tile(np.eye(4), (sequence.n_frames, skin.joints, 1, 1))
    for start, block in sequence.chunks():
        frames = (block - centre) / diagonal
        own = _begin(bind, frames, members)
        _mend(own, bind, frames, members, 2 * SWEEPS)
        linear = np.swapaxes(own[..., :3], 0, 1)
        transforms[start : start + len(block), :, :3, :3] = linear
        transforms[start : start + len(block), :, :3, 3] = diagonal * np.swapaxes(own[..., 3], 0, 1) + centre - linear @ centre
    report("rigid skin", 1.0)
    used, numbers = np.unique(np.where(weights > 0, indices, indices[:, :1]), return_inverse=True)
    renumbered: Int32 = np.where(weights > 0, numbers.reshape(indices.shape), 0).astype(np.int32)
    made = Skin(renumbered, weights.astype(np.float32), first, transforms[:, used])
    parents, pivots = _tie(made, around)
    return replace(made, parents=parents, pivots=pivots)


def _clusters(bind: Float64, frames: Float64, count: int) -> tuple[Int32, Float64]:
    """Joints and weights ``(V, 4)`` of vertices that follow one each."""
    some = frames[np.unique(np.linspace(0, len(frames) - 1, CLUSTER_FRAMES).astype(int))]

    def as_influences(labels: Int64) -> tuple[Int32, Float64]:
        indices, weights = np.zeros((len(bind), INFLUENCES), np.int32), np.zeros((len(bind), INFLUENCES))
        indices[:, 0], weights[:, 0] = labels, 1
        return indices, weights

    def squared_distances(labels: Int64, n: int) -> Float64:
        motions = _begin(bind, some, Members.of(*as_influences(labels), n))
        return np.stack([np.square(some - _moved(motion, bind)).sum(axis=(0, 2)) for motion in motions])

    return as_influences(split_clusters(bind, count, squared_distances))


def _alternate(
    bind: Float64, frames: Float64, around: sparse.csr_array, indices: Int32, weights: Float64, n_joints: int, rounds: int
) -> tuple[float, Int32, Float64]:
    """Both steps in turn, for some rounds; returns what is left at the last motions, and joints and weights ``(V, 4)``."""
    members, left = Members.of(indices, weights, n_joints), 0.0
    motions = _begin(bind, frames, members)
    for _ in range(rounds):
        left = _mend(motions, bind, frames, members, SWEEPS)
        indices, weights = _fit_weights(motions, bind, frames, around, indices, weights)
        members = Members.of(indices, weights, n_joints)
    return left, indices, weights


def _begin(bind: Float64, frames: Float64, members: Members) -> Float64:
    """``(J, F, 3, 4)``: each joint as if its vertices followed it alone."""
    result = np.tile(np.eye(3, 4), (len(members.starts) - 1, len(frames), 1, 1))
    for j in range(len(result)):
        vertices, weights = members.at(j)
        if len(vertices):
            result[j] = similar(bind[vertices], weights, frames[:, vertices])
    return result


def _mend(motions: Float64, bind: Float64, frames: Float64, members: Members, sweeps: int) -> float:
    """Step 1: change ``motions (J, F, 3, 4)`` in place, and return the sum of squares that they leave."""
    left = frames.copy()  # what all joints leave
    for j, motion in enumerate(motions):
        vertices, weights = members.at(j)
        left[:, vertices] -= weights[:, None] * _moved(motion, bind[vertices])
    for _ in range(sweeps):
        for j, motion in enumerate(motions):
            vertices, weights = members.at(j)
            if not len(vertices):
                continue
            others = left[:, vertices] + weights[:, None] * _moved(motion, bind[vertices])  # what the other joints leave
            motions[j] = similar(bind[vertices], weights * weights, others / weights[:, None])
            left[:, vertices] = others - weights[:, None] * _moved(motions[j], bind[vertices])
    return float(np.square(left).sum())


def _moved(motion: Float64, points: Float64) -> Float64:
    """``(F, n, 3)``: points ``(n, 3)`` by a motion ``(F, 3, 4)``."""
    return np.asarray(points @ np.swapaxes(motion[:, :, :3], 1, 2) + motion[:, None, :, 3])


def similar(points: Float64, weights: Float64, targets: Float64) -> Float64:
    """``(F, 3, 4)``: rotation, scale and translation that bring ``points (n, 3)`` nearest to ``targets (F, n, 3)``.

    Source: Umeyama, Least-squares estimation of transformation parameters between two point patterns, 1991.
    """
    share = weights / weights.sum()
    middle, middles = share @ points, np.einsum("n,fnc->fc", share, targets)
    around = points - middle
    u, d, vt = np.linalg.svd(np.swapaxes(targets - middles[:, None], 1, 2) @ (share[:, None] * around))
    signs = np.ones_like(d)
    signs[:, 2] = np.where(np.linalg.det(u @ vt) < 0, -1.0, 1.0)
    size = float(share @ np.square(around).sum(axis=1))
    # what is one point here has no size to grow; what becomes one keeps a size that others can hang on
    scale = np.maximum((signs * d).sum(axis=1) / size, LEAST_SCALE) if size > POINT else np.ones(len(d))
    linear = scale[:, None, None] * ((u * signs[:, None, :]) @ vt)
    return np.concatenate([linear, (middles - linear @ middle)[:, :, None]], axis=2)


def _fit_weights(
    motions: Float64, bind: Float64, frames: Float64, around: sparse.csr_array, indices: Int32, weights: Float64
) -> tuple[Int32, Float64]:
    """Step 2: joints and weights ``(V, 4)`` of every vertex."""
    n, followed = len(bind), _followed(indices, weights, len(motions))
    near = (around @ followed + OWN * followed).tocsr()
    found, parts = np.zeros((n, INFLUENCES), np.int32), np.zeros((n, INFLUENCES))
    for first in range(0, n, BLOCK):
        own = slice(first, min(first + BLOCK, n))
        scores = near[own].toarray()
        candidates = np.argsort(-scores, axis=1, kind="stable")[:, :CANDIDATES]
        is_in = np.take_along_axis(scores, candidates, axis=1) > 0
        moved = motions[candidates]  # (m, C, F, 3, 4)
        steps = np.einsum("mcfab,mb->mcfa", moved[..., :3], bind[own]) + moved[..., 3] - bind[own][:, None, None]
        wanted = np.swapaxes(frames[:, own], 0, 1) - bind[own][:, None]
        flat, goal = steps.reshape(*steps.shape[:2], -1), wanted.reshape(len(wanted), -1)
        solved = _sparse_weights(flat @ np.swapaxes(flat, 1, 2), (flat @ goal[:, :, None])[:, :, 0], is_in)
        missing = ((0, 0), (0, max(0, INFLUENCES - solved.shape[1])))  # of fewer than four joints
        solved, candidates = np.pad(solved, missing), np.pad(candidates, missing)
        best = np.argsort(-solved, axis=1, kind="stable")[:, :INFLUENCES]
        rounded = np.rint(PARTS * np.take_along_axis(solved, best, axis=1))
        rounded[:, 0] += PARTS - rounded.sum(axis=1)
        parts[own] = rounded / PARTS
        found[own] = np.where(rounded > 0, np.take_along_axis(candidates, best, axis=1), 0)
    return found, parts


def _followed(indices: Int32, weights: Floats, n_joints: int) -> sparse.csr_array:
    """``(V, J)``: how much each vertex follows each joint."""
    from scipy import sparse

    n = len(indices)
    rows = np.repeat(np.arange(n), INFLUENCES)
    return sparse.coo_array((weights.ravel(), (rows, indices.ravel())), shape=(n, n_joints)).tocsr()


def _sparse_weights(gram: Float64, given: Float64, is_in: Bool) -> Float64:
    """``(m, C)`` that add up to 1, none below 0, four above it at most, of about least ``w G w - 2 w given``.

    Of joints that would get less than nothing, and of those that are too many, the least leaves, and the rest is solved anew.
    """
    is_in = is_in.copy()
    while True:
        solved = np.where(is_in, _solve(gram, given, is_in), np.inf)
        least = solved.argmin(axis=1)
        leaves = (np.take_along_axis(solved, least[:, None], axis=1)[:, 0] < 0) | (is_in.sum(axis=1) > INFLUENCES)
        leaves &= is_in.sum(axis=1) > 1
        if not leaves.any():
            return np.where(is_in, solved, 0.0)
        is_in[np.flatnonzero(leaves), least[leaves]] = False


def _solve(gram: Float64, given: Float64, is_in: Bool) -> Float64:
    """Least squares over the joints that are in, whose weights add up to 1."""
    n, count = given.shape
    system = np.zeros((n, count + 1, count + 1))
    system[:, :count, :count] = np.where(is_in[:, :, None] & is_in[:, None, :], gram, 0.0)
    diagonal = np.arange(count)
    ridge = 1e-9 * np.trace(gram, axis1=1, axis2=2)[:, None] / count + 1e-15
    system[:, diagonal, diagonal] += np.where(is_in, ridge, 1.0)
    system[:, :count, count] = system[:, count, :count] = is_in
    right = np.concatenate([np.where(is_in, given, 0.0), np.ones((n, 1))], axis=1)
    return np.asarray(np.linalg.solve(system, right[:, :, None])[:, :count, 0])


def _tie(skin: Skin, around: sparse.csr_array) -> tuple[Int32, Float64]:
    """The parent ``(J,)`` of each joint, -1 for roots, and the points ``(J, 3)`` that they turn about.

    Joints that share most vertices, or whose vertices are neighbours, are tied: a spanning tree. Its roots are those that
    vertices follow most.
    """
    from scipy import sparse
    from scipy.sparse.csgraph import breadth_first_order, connected_components, minimum_spanning_tree

    own = _followed(skin.indices, skin.weights, skin.joints)
    followed = (around @ own + OWN * own).tocsr()
    shared = (followed.T @ followed).toarray()
    sums = shared.sum(axis=1)
    np.fill_diagonal(shared, 0)
    tree = minimum_spanning_tree(sparse.csr_array(np.where(shared > 0, 1 / np.where(shared > 0, shared, 1.0), 0.0)))
    parents = np.full(skin.joints, -1, np.int32)
    count, label = connected_components(tree, directed=False)
    for group in range(count):
        joints = np.flatnonzero(label == group)
        root = int(joints[sums[joints].argmax()])
        order, before = breadth_first_order(tree, root, directed=False)
        parents[order[1:]] = before[order[1:]]
    sizes = np.cbrt(np.abs(np.linalg.det(skin.transforms[:, :, :3, :3])))
    shrinks = sizes.min(axis=0) < SHRUNK * np.maximum(sizes.max(axis=0), 1)
    parents[(parents >= 0) & shrinks[parents]] = -1  # nothing hangs on what nearly vanishes, which would have to undo that
    pivots = joint_means(skin, skin.bind)
    for j in np.flatnonzero(parents >= 0):
        pivots[j] = _hinge(skin, followed, int(parents[j]), int(j))
    return parents, pivots.astype(np.float32).astype(np.float64)


def _hinge(skin: Skin, followed: sparse.csr_array, parent: int, joint: int) -> Float64:
    """The point ``(3,)`` of the bind pose that two joints move most alike."""
    both = followed[:, [parent, joint]].toarray().prod(axis=1)
    middle = np.asarray(both @ skin.bind / both.sum())
    apart = skin.transforms[:, joint, :3] - skin.transforms[:, parent, :3]  # (F, 3, 4)
    linear, shift = apart[:, :, :3], apart[:, :, 3] + apart[:, :, :3] @ middle
    normal = np.einsum("fab,fac->bc", linear, linear)
    normal += (TOWARDS_MIDDLE * np.trace(normal) + 1e-12) * np.eye(3)
    return np.asarray(middle - np.linalg.solve(normal, np.einsum("fab,fa->b", linear, shift)))
