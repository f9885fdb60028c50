"""A square cloth that falls on a ball, drapes and swings to rest.

- Solver: extended position-based dynamics, one pass in each of many small substeps (M. Macklin et al., Small Steps in Physics
  Simulation, SCA 2019).
- Stretch and shear: distance constraints along the edges. No two of one colour share a vertex, so one colour is one
  vectorised Gauss-Seidel update.
- Bending: the quadratic energy of M. Bergou et al. (A Quadratic Bending Model for Inextensible Surfaces, SGP 2006), as an
  explicit force. At these substeps it is far from its stability limit.
- Cloth against cloth departs from both papers: vertices far apart in the material repel each other at short range. That
  needs no triangle tests at this resolution.

Frame: y up, metres, seconds.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import scipy.sparse as sp
from animation import Animation
from scipy.spatial import Delaunay, cKDTree

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

SEED = 7
FPS = 30.0
N_FRAMES = 110
N_SUBSTEPS = 30  # per frame
N_SIDE = 45  # vertices along one side of the cloth
SIDE = 1.9  # m
BALL_CENTRE = np.array([0.0, 1.0, 0.0])  # m
BALL_RADIUS = 0.4  # m
CONTACT_GAP = 0.006  # m; vertices stay this far off, so that the flat triangles between them clear the ball
GRAVITY = 9.81  # m/s^2
FRICTION = 0.35  # Coulomb, cloth on ball
STRETCH_COMPLIANCE = 1e-8  # m^2/N for unit vertex mass
SQUEEZE_COMPLIANCE = 1.4e-4  # m^2/N; cloth that did not give way when pushed together would crumple
BEND_STIFFNESS = 5e-3  # m^4/s^2, by area density: felt; thinner cloth folds more finely than this mesh can
AIR_DRAG = 0.3  # 1/s, all directions
NORMAL_DRAG = 5.0  # 1/s, against motion across the cloth's plane
SETTLING_DRAG = 6.0  # 1/s, added over the last third, so that the clip ends at rest
CLOTH_GAP = 0.03  # m between layers; above edge / sqrt(3), so that no vertex slips through a triangle


def make_cloth() -> Animation:
    """Return the simulated clip: 110 frames, 2025 vertices, open boundary."""
    material, faces = triangulate_cloth()
    dt = 1.0 / (FPS * N_SUBSTEPS)
    colours = colour_constraints(edges_of(faces))
    constraints = [(i, j, np.sqrt(_dot(material[i] - material[j]))) for i, j in colours]
    bending = BEND_STIFFNESS * bending_matrix(material, faces)
    position, velocity = start_pose(material)
    frames = [position.copy()]
    for frame in range(1, N_FRAMES):
        settling = SETTLING_DRAG * float(np.clip(frame / N_FRAMES * 3.0 - 2.0, 0.0, 1.0))
        for substep in range(N_SUBSTEPS):
            if substep % 6 == 0:
                near = layers_near(position, material)
            normals = vertex_normals(position, faces)
            velocity[:, 1] -= GRAVITY * dt
            velocity *= 1.0 - (AIR_DRAG + settling) * dt
            velocity -= dt * (bending @ position)
            velocity -= (NORMAL_DRAG * dt * _inner(velocity, normals))[:, None] * normals
            previous = position.copy()
            position = position + velocity * dt
            for i, j, rest in constraints:
                solve_distances(position, i, j, rest, dt)
            push_layers_apart(position, near)
            collide_with_ball(position, previous)
            velocity = (position - previous) / dt
        frames.append(position.copy())
    return Animation(np.stack(frames), faces, FPS)


def triangulate_cloth() -> tuple[Floats, npt.NDArray[np.int32]]:
    """Triangulate a jittered grid (Delaunay): irregular triangles fold alike in all directions, regular ones do not.

    Returns:
        Material coordinates (V, 3), m, with y = 0, and faces (T, 3), counter-clockwise from above.
    """
    rng = np.random.default_rng(SEED)
    steps = np.linspace(-0.5, 0.5, N_SIDE) * SIDE
    grid = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1)  # (N, N, 2)
    # Not next to the boundary, whose vertices stay in line: slivers there would be stiff enough to blow up.
    grid[2:-2, 2:-2] += rng.uniform(-0.25, 0.25, (N_SIDE - 4, N_SIDE - 4, 2)) * (SIDE / (N_SIDE - 1))
    flat = grid.reshape(-1, 2)  # (N, N, 2) -> (V, 2)
    faces = Delaunay(flat).simplices.astype(np.int32)
    a, b, c = flat[faces[:, 0]], flat[faces[:, 1]], flat[faces[:, 2]]
    # In a right-handed frame with y up, x towards z is clockwise seen from above.
    clockwise = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0] > 0
    faces[clockwise] = faces[clockwise][:, ::-1]
    return np.stack([flat[:, 0], np.zeros(len(flat)), flat[:, 1]], axis=1), faces


def edges_of(faces: npt.NDArray[np.int32]) -> Ints:
    """Return the undirected edges (E, 2)."""
    sides = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    return np.unique(np.sort(sides, axis=1), axis=0).astype(np.int64)


def bending_matrix(material: Floats, faces: npt.NDArray[np.int32]) -> sp.csr_matrix:
    """Return the (V, V) matrix, 1/m^4, from positions to minus the accelerations by bending, for unit stiffness.

    It is L^T M^-1 L / m. L is the cotangent Laplacian, M the vertex areas of the flat cloth, m the mean area: the solver gives
    all vertices one mass. L has no rows at the boundary, since a free edge carries no bending moment.
    """
    n_vertices = len(material)
    entries, rows, columns = [], [], []
    area = np.zeros(n_vertices)
    for k in range(3):
        i, j, o = faces[:, (k + 1) % 3], faces[:, (k + 2) % 3], faces[:, k]
        to_i, to_j = material[i] - material[o], material[j] - material[o]
        double_area = np.sqrt(_dot(np.cross(to_i, to_j)))
        cotangent = 0.5 * _inner(to_i, to_j) / double_area
        entries += [cotangent, cotangent, -cotangent, -cotangent]
        rows += [i, j, i, j]
        columns += [j, i, i, j]
        area += np.bincount(o, weights=double_area / 6.0, minlength=n_vertices)
    indices = (np.concatenate(rows), np.concatenate(columns))
    laplacian = sp.csr_matrix((np.concatenate(entries), indices), shape=(n_vertices, n_vertices))
    inside = (np.abs(material[:, [0, 2]]) < 0.5 * SIDE - 1e-9).all(axis=1)
    return sp.csr_matrix(laplacian.T @ sp.diags(inside / area) @ laplacian / area.mean())


def colour_constraints(pairs: Ints) -> list[tuple[Ints, Ints]]:
    """Split vertex pairs (E, 2) into colours; within one, no vertex occurs twice.

    Each colour is a maximal matching found in parallel. A pair joins if its random rank is the lowest at both of its ends; the
    pairs that it blocks wait for the next colour.
    """
    rng = np.random.default_rng(SEED)
    n_vertices = int(pairs.max()) + 1
    colours = []
    while len(pairs):
        rank = rng.permutation(len(pairs))
        chosen = np.zeros(len(pairs), dtype=bool)
        free = np.ones(len(pairs), dtype=bool)
        while free.any():
            lowest = np.full(n_vertices, len(pairs))
            np.minimum.at(lowest, pairs[free].ravel(), np.repeat(rank[free], 2))
            chosen |= free & (lowest[pairs] == rank[:, None]).all(axis=1)
            taken = np.zeros(n_vertices, dtype=bool)
            taken[pairs[chosen].ravel()] = True
            free &= ~taken[pairs].any(axis=1)
        colours.append((pairs[chosen, 0], pairs[chosen, 1]))
        pairs = pairs[~chosen]
    return colours


def start_pose(material: Floats) -> tuple[Floats, Floats]:
    """Return position (V, 3), m, and velocity (V, 3), m/s: above the ball, tilted, off centre, turning slowly."""
    tilt, turn, spin = 0.16, 0.35, 1.6  # rad, rad, rad/s
    x, z = material[:, 0], material[:, 2]
    x, z = x * np.cos(turn) + z * np.sin(turn), z * np.cos(turn) - x * np.sin(turn)
    above = BALL_CENTRE[1] + BALL_RADIUS + 0.16
    position = np.stack([x * np.cos(tilt) + 0.05, above + x * np.sin(tilt), z - 0.03], axis=1)
    velocity = np.stack([spin * z, np.zeros_like(x), -spin * x], axis=1)
    return position, velocity


def vertex_normals(position: Floats, faces: npt.NDArray[np.int32]) -> Floats:
    """Return unit normals (V, 3), weighted by area."""
    a, b, c = position[faces[:, 0]], position[faces[:, 1]], position[faces[:, 2]]
    corner_normals = np.repeat(np.cross(b - a, c - a), 3, axis=0)
    normals = _sum_at(faces.ravel(), corner_normals, len(position))
    return normals / np.sqrt(_dot(normals))[:, None]


def solve_distances(position: Floats, i: Ints, j: Ints, rest: Floats, dt: float) -> None:
    """Move each pair (i, j) towards its rest distance in m, in place, for a step of dt s."""
    apart = position[i] - position[j]
    length = np.sqrt(_dot(apart))
    compliance = np.where(length > rest, STRETCH_COMPLIANCE, SQUEEZE_COMPLIANCE)
    apart *= ((rest - length) / (length * (2.0 + compliance / dt**2)))[:, None]
    position[i] += apart
    position[j] -= apart


def layers_near(position: Floats, material: Floats) -> Ints:
    """Return pairs (N, 2) close in space but not in the cloth, with a margin for the motion of a few substeps."""
    reach = 1.6 * CLOTH_GAP
    pairs = cKDTree(position).query_pairs(reach, output_type="ndarray").astype(np.int64)
    pairs = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]
    far_in_cloth = _dot(material[pairs[:, 0]] - material[pairs[:, 1]]) > (3.0 * CLOTH_GAP) ** 2
    selected: Ints = pairs[far_in_cloth]
    return selected


def push_layers_apart(position: Floats, pairs: Ints) -> None:
    """Push close pairs out to CLOTH_GAP, in place; each vertex moves by the mean of its pushes (Jacobi)."""
    if not len(pairs):
        return
    apart = position[pairs[:, 0]] - position[pairs[:, 1]]
    length = np.maximum(np.sqrt(_dot(apart)), 1e-9)
    # Half-strength pushes: a full one makes resting folds buzz.
    push = apart * (0.25 * np.maximum(CLOTH_GAP - length, 0.0) / length)[:, None]
    ends = pairs.T.ravel()
    total = _sum_at(ends, np.concatenate([push, -push]), len(position))
    active = np.concatenate([length, length]) < CLOTH_GAP
    count = np.bincount(ends, weights=active, minlength=len(position))
    position += total / np.maximum(count, 1.0)[:, None]


def collide_with_ball(position: Floats, previous: Floats) -> None:
    """Move vertices out of the ball and slow them by friction, in place."""
    radial = position - BALL_CENTRE
    distance = np.sqrt(_dot(radial))
    hit = np.flatnonzero(distance < BALL_RADIUS + CONTACT_GAP)
    normal = radial[hit] / distance[hit, None]
    depth = BALL_RADIUS + CONTACT_GAP - distance[hit]
    moved = position[hit] + depth[:, None] * normal - previous[hit]
    slide = moved - _inner(moved, normal)[:, None] * normal
    held = np.minimum(FRICTION * depth / np.maximum(np.sqrt(_dot(slide)), 1e-12), 1.0)
    position[hit] += depth[:, None] * normal - held[:, None] * slide


def _inner(a: Floats, b: Floats) -> Floats:
    # Written out: the order of the additions is then fixed on every machine, and so are the simulated folds.
    inner: Floats = a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1] + a[:, 2] * b[:, 2]
    return inner


def _dot(a: Floats) -> Floats:
    return _inner(a, a)


def _sum_at(index: npt.NDArray[Any], values: Floats, n: int) -> Floats:
    return np.stack([np.bincount(index, weights=values[:, k], minlength=n) for k in range(3)], axis=1)
