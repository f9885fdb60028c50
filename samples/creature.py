"""A walking fox: one closed surface around a skeleton, by linear blend skinning.

Each vertex first follows the nearest bone alone. The skinning weights then diffuse along the surface, so that one leg never
pulls at the other (I. Baran and J. Popovic, Automatic Rigging and Animation of 3D Characters, SIGGRAPH 2007, section 4).

Frame: metres, y up, the fox walks along +z on the ground y = 0.
"""

from __future__ import annotations

from functools import partial

import numpy as np
import numpy.typing as npt
import scipy.sparse as sp
from animation import Animation
from fox import fox_parts
from gait import FPS, Poses, pose_fox
from implicit import RoundCone, distance_to_body, gradient_of_body, nearest_part, project_to_body
from polygonise import neighbour_mean, relax, surface_nets
from scipy.sparse.linalg import splu

Floats = npt.NDArray[np.float64]
Faces = npt.NDArray[np.int32]

# (coordinate, cell size there) along each axis in m, linear between: small at ears, muzzle and legs, large at the trunk.
GRID_X = [(-0.29, 0.029), (0.29, 0.029)]
GRID_Y = [(-0.07, 0.029), (0.38, 0.031), (0.50, 0.044), (0.70, 0.044), (0.80, 0.030), (1.20, 0.025)]
GRID_Z = [(-1.14, 0.040), (-0.50, 0.038), (-0.40, 0.029), (-0.20, 0.034), (-0.05, 0.055), (0.10, 0.044)]
GRID_Z += [(0.22, 0.029), (0.80, 0.028)]
N_RELAX = 12
SPREAD = 2.5  # edges squared; how far the skin blends between bones


def make_creature() -> Animation:
    """Return the fox walking: 102 frames."""
    parts = fox_parts()
    rest, faces = build_surface(parts)
    bones = list(dict.fromkeys(part.bone for part in parts))
    owner = np.array([bones.index(part.bone) for part in parts])[nearest_part(rest, parts)]
    weights = diffuse_weights(np.eye(len(bones))[owner], faces)
    return Animation(skin(rest, weights, bones, pose_fox()), faces, FPS)


def build_surface(parts: list[RoundCone]) -> tuple[Floats, Faces]:
    """Return rest vertices (V, 3), m, and faces (T, 3) of the body's surface."""
    axes = [graded_axis(knots) for knots in (GRID_X, GRID_Y, GRID_Z)]
    points, faces = surface_nets(partial(distance_to_body, parts=parts), axes)
    require_closed(faces)
    gradient, project = partial(gradient_of_body, parts=parts), partial(project_to_body, parts=parts)
    return relax(points, faces, gradient, project, N_RELAX), faces


def graded_axis(knots: list[tuple[float, float]]) -> Floats:
    """Return grid lines, m, from the first knot to past the last; a knot is (coordinate, cell size there)."""
    coordinates, sizes = np.array(knots).T
    lines = [float(coordinates[0])]
    while lines[-1] < coordinates[-1]:
        lines.append(lines[-1] + float(np.interp(lines[-1], coordinates, sizes)))
    return np.array(lines)


def require_closed(faces: Faces) -> None:
    """Raise ValueError unless every edge has one face on each side.

    Surface nets leave such an edge where the surface touches a grid plane; a small change of the grid then helps.
    """
    half_edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    _, n_uses = np.unique(half_edges, axis=0, return_counts=True)
    _, n_faces = np.unique(np.sort(half_edges, axis=1), axis=0, return_counts=True)
    n_bad = int((n_faces != 2).sum() + (n_uses != 1).sum())
    if n_bad:
        raise ValueError(f"{n_bad} edges are not between two faces: shift or refine GRID_X, GRID_Y or GRID_Z")


def diffuse_weights(owned: Floats, faces: Faces) -> Floats:
    """Return skinning weights (V, B), rows summing to 1, from the one-hot nearest bone (V, B)."""
    n_vertices = len(owned)
    mean = neighbour_mean(faces, n_vertices)
    # Two implicit steps: one alone leaves a crease along the border between two owners.
    step = splu(sp.csc_matrix((1.0 + SPREAD) * sp.identity(n_vertices) - SPREAD * mean))
    weights: Floats = step.solve(step.solve(owned))
    weights /= weights.sum(axis=1, keepdims=True)
    return weights


def skin(rest: Floats, weights: Floats, bones: list[str], poses: Poses) -> Floats:
    """Return the posed vertices (F, V, 3), m."""
    posed = np.zeros((len(poses[bones[0]][1]), *rest.shape))
    for bone, weight in zip(bones, weights.T, strict=True):
        rest_joint, turn, joint = poses[bone]
        posed += weight[:, None] * ((rest - rest_joint) @ turn.transpose(0, 2, 1) + joint[:, None])
    return posed
