"""Vertex positions whose edge lengths and dihedral angles come closest to given ones.

What is made small is the sum over edges of squared relative length errors, plus BENDING times the sum over hinges of squared
angle errors, weighted with the trust in each angle. Levenberg-Marquardt: each step solves the sparse normal equations anew
(3 unknowns per vertex; faces that share an edge couple their vertices) by conjugate gradients, whose time and memory grow no
faster than the mesh. The damping also holds what edge shapes leave open: the place and
the turn of each component.

Source: Froehlich and Botsch, "Example-driven deformations based on discrete shells", 2011, for the least squares. The codec's
paper projects by levels, after Winkler et al. 2010; started from aligned frames, a few plain steps reach the same.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from gvcodecs.laplacian.edge_shape import EdgeShape
from gvcodecs.laplacian.vectors import dot
from gvpipe.foundation.arrays import Float64, Integers
from gvpipe.foundation.elementary import arctan2
from gvpipe.trajectory.sparse_rows import as_rows

BENDING = 0.1  # squared relative length error that a squared radian weighs as much as
SHORTEST = 2e-2  # least length that divides, in mean edge lengths
FLATTEST = 1e-2  # least height over edge of a face that divides
MAX_STEPS = 3  # solutions, which take nearly all of the time; more save the codec no bits
GRADIENTS = 200  # of conjugate gradients: fewer cost the codec bits, more save none
CLOSE = 1e-8  # part of the right side: solved
GAIN = 0.02  # part of its squared error by which a component must still improve for another step to follow
EXACT = 1e-12  # squared error of an edge that is none: a sequence that does not move starts there
DAMPING, RELAX, TIGHTEN = 1e-3, 0.1, 10.0  # first damping, in diagonal entries, and its factors after a step taken or refused
LEAST = 1e-9  # on the diagonal, for vertices without edges


@dataclass(frozen=True)
class _State:
    """Points ``(V, 3)`` in mean edge lengths, weighted errors of edges and hinges ``(E + H,)`` and their derivatives."""

    points: Float64
    errors: Float64
    jacobian: sparse.csr_array


def fit_shape(shape: EdgeShape, start: Float64, labels: Integers) -> Float64:
    """Return points ``(V, 3)`` near ``start`` whose edge shape comes closest to ``shape``, model units.

    Components ``labels (V,)`` share a factorisation and nothing else: each is damped, and its steps taken or refused, alone.
    """
    unit = float(shape.lengths.mean()) if len(shape.lengths) else 0.0
    if not unit > 0:
        return start
    label_of_error = labels[np.concatenate([shape.edges[:, 0], shape.hinges[:, 0]])]
    n_components = int(labels.max()) + 1
    damping = np.full(n_components, DAMPING)
    state = _measure(shape, unit, start / unit)
    energy = np.bincount(label_of_error, state.errors**2, n_components)
    for _ in range(MAX_STEPS):
        moved = state.points - _solve(state, np.repeat(damping[labels], 3)).reshape(-1, 3)
        tried = np.bincount(label_of_error, _measure(shape, unit, moved).errors ** 2, n_components)
        better = tried < energy
        unsettled = float(energy[~better | (tried < (1 - GAIN) * energy)].sum())
        state = _measure(shape, unit, np.where(better[labels, None], moved, state.points))
        energy = np.where(better, tried, energy)
        damping *= np.where(better, RELAX, TIGHTEN)
        if unsettled <= max(GAIN * energy.sum(), EXACT * len(state.errors)):
            break
    return state.points * unit


def _solve(state: _State, damping: Float64) -> Float64:
    """Solve the normal equations ``(3V, 3V)`` roughly; ``damping (3V,)`` is in diagonal entries."""
    from gvcodecs.laplacian.gradient_kernels import solve_damped

    jacobian = state.jacobian
    diagonal = np.bincount(jacobian.indices, jacobian.data**2, jacobian.shape[1])
    return solve_damped(as_rows(jacobian), damping * diagonal + LEAST, state.errors, CLOSE, GRADIENTS)


def _measure(shape: EdgeShape, unit: float, points: Float64) -> _State:
    length_errors, along_edges = _length_errors(shape, unit, points)
    angle_errors, along_hinges = _angle_errors(shape, points)
    n_edges, n_hinges = len(length_errors), len(angle_errors)
    vertices = np.concatenate([shape.edges.ravel(), shape.hinges.ravel()]).astype(np.int64)
    starts = np.concatenate([6 * np.arange(n_edges), 6 * n_edges + 12 * np.arange(n_hinges + 1)])
    values = np.concatenate([along_edges.ravel(), along_hinges.ravel()])
    columns = (3 * vertices[:, None] + np.arange(3)).ravel()
    jacobian = sparse.csr_array((values, columns, starts), shape=(n_edges + n_hinges, points.size))
    return _State(points, np.concatenate([length_errors, angle_errors]), jacobian)


def _length_errors(shape: EdgeShape, unit: float, points: Float64) -> tuple[Float64, Float64]:
    """Relative errors ``(E,)`` of lengths, and their derivatives ``(E, 2, 3)`` by the edges' ends."""
    i, j = shape.edges.T
    side = points[j] - points[i]
    length = np.sqrt(dot(side, side))
    wanted = shape.lengths / unit
    weight = 1 / np.maximum(wanted, SHORTEST)
    toward = side * (weight / np.maximum(length, SHORTEST))[:, None]
    return (length - wanted) * weight, np.stack([-toward, toward], axis=1)


def _angle_errors(shape: EdgeShape, points: Float64) -> tuple[Float64, Float64]:
    """Weighted errors ``(H,)`` of dihedral angles, and their derivatives ``(H, 4, 3)`` by the hinges' vertices."""
    i, j, k, l = shape.hinges.T  # noqa: E741 - vertices i j k l
    edge, one, other = points[j] - points[i], points[k] - points[i], points[l] - points[i]
    normal_one, normal_other = np.cross(edge, one), np.cross(other, edge)  # twice the area long
    squared = np.maximum(dot(edge, edge), SHORTEST**2)
    length = np.sqrt(squared)
    angle = arctan2(dot(normal_one, other) * length, dot(normal_one, normal_other))
    weight = np.sqrt(BENDING) * shape.trust
    error = np.remainder(angle - shape.angles + np.pi, 2 * np.pi) - np.pi
    least = (FLATTEST * squared) ** 2
    by_k = normal_one * (weight * length / np.maximum(dot(normal_one, normal_one), least))[:, None]
    by_l = normal_other * (weight * length / np.maximum(dot(normal_other, normal_other), least))[:, None]
    share_k, share_l = (dot(one, edge) / squared)[:, None], (dot(other, edge) / squared)[:, None]  # of j; of i the rest
    by_i = -(1 - share_k) * by_k - (1 - share_l) * by_l
    by_j = -share_k * by_k - share_l * by_l
    return weight * error, np.stack([by_i, by_j, by_k, by_l], axis=1)
