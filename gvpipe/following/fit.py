"""A mesh moved onto the surface of a frame, by pairs of closest points in both directions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gvpipe.following.closest import ClosestPoints, Hits
from gvpipe.following.deformation import Deformation
from gvpipe.following.stages import Stage
from gvpipe.following.surface import Samples, Surface, border_sides, unit, vertex_normals
from gvpipe.foundation.arrays import Bool, Float64, Int32

MOST_EMPHASIS = 16.0  # times that a distant pair counts
LEAST_SAMPLES, MOST_SAMPLES = 4_000, 24_000  # of the frame's surface; between them, two for each triangle
STILL = 1e-5  # part of the diagonal: a round that moves vertices less, root mean square, is the last one of its stage


class Goal:
    """A frame's surface, to be fitted to.

    Args:
        surface: not empty.
        most: points of it, at most, that look for their places on the moved mesh.
    """

    def __init__(self, surface: Surface, most: int = MOST_SAMPLES) -> None:
        self.surface = surface
        samples = surface.sample(min(max(LEAST_SAMPLES, 2 * len(surface.faces)), most))
        self.points = samples.of(surface.positions, surface.faces)
        self.normals = surface.closest.normals[samples.triangles]


class MovedMesh:
    """The mesh that is fitted to one frame after the other.

    Args:
        positions: ``(V, 3)``, model units, at some frame; each vertex is used.
        faces: ``(T, 3)``, T > 0.
        diagonal: model units; what parts in a `Stage` refer to.
    """

    def __init__(self, positions: Float64, faces: Int32, diagonal: float) -> None:
        n_vertices = len(positions)
        self.faces, self._diagonal, self._n = faces, diagonal, n_vertices
        self._deformation = Deformation(faces, n_vertices)
        self._samples = _samples(positions, faces)
        sides = border_sides(faces, n_vertices)
        self._border: Bool = np.zeros(n_vertices, bool)
        self._border[np.roll(faces, -1, axis=1)[sides]] = self._border[np.roll(faces, -2, axis=1)[sides]] = True

    def fit(self, positions: Float64, rest: Float64, goal: Goal, stages: Sequence[Stage]) -> Float64:
        """Positions ``(V, 3)`` near the goal's surface.

        Args:
            positions: ``(V, 3)`` to begin with.
            rest: ``(V, 3)`` the shape whose edges keep their lengths.
            goal: of the frame.
            stages: one after the other.
        """
        for stage in stages:
            for _ in range(stage.rounds):
                before = positions
                positions = self._move(positions, positions if stage.flows else rest, goal, stage)
                if np.sqrt(np.mean((positions - before) ** 2) * 3) < STILL * self._diagonal:
                    break
        return positions

    def rotations(self, rest: Float64, positions: Float64) -> Float64:
        """Rotations ``(V, 3, 3)`` of vertices from ``rest (V, 3)`` to ``positions (V, 3)``."""
        return self._deformation.rotations(rest, positions)

    def _move(self, positions: Float64, rest: Float64, goal: Goal, stage: Stage) -> Float64:
        """One round: pairs of closest points, then least squares."""
        from gvpipe.following.fit_kernels import add_samples

        blocks, sides = self._deformation.no_equations()
        samples = self._samples
        points = samples.of(positions, self.faces)
        normals = unit(samples.of(vertex_normals(positions, self.faces), self.faces))
        reach = stage.reach * self._diagonal
        frame = goal.surface
        hits = frame.closest.find(points, normals, stage.agreement, reach)
        counts = hits.triangles >= 0
        if not stage.follows_borders:
            counts &= ~frame.on_border(hits)
        weights = self._weights(hits, counts, stage)
        add_samples(
            blocks, sides, self._deformation.places, self.faces, np.where(counts, samples.triangles, -1), samples.weights,
            frame.closest.normals[hits.triangles], hits.points, weights, weights * stage.hold,
        )  # fmt: skip
        hits = ClosestPoints(positions, self.faces).find(goal.points, goal.normals, stage.agreement, reach)
        counts = hits.triangles >= 0
        if not stage.follows_borders:
            counts &= ~(self._border[self.faces[hits.triangles]] & (hits.weights > 0)).any(axis=1)
        weights = self._weights(hits, counts, stage)
        add_samples(
            blocks, sides, self._deformation.places, self.faces, np.where(counts, hits.triangles, -1), hits.weights,
            goal.normals, goal.points, weights, weights * stage.hold,
        )  # fmt: skip
        return self._deformation.solve(blocks, sides, positions, rest, stage.stiffness)

    def _weights(self, hits: Hits, counts: Bool, stage: Stage) -> Float64:
        """Weights ``(P,)`` of pairs: all together as many as there are vertices, if all count fully."""
        ratio = np.where(counts, hits.distances, 0.0) / (stage.scale * self._diagonal)
        more = np.minimum(1 + (ratio * (stage.scale / stage.emphasis)) ** 2, MOST_EMPHASIS)
        result: Float64 = counts * more / (1 + ratio**2) ** 2 * (self._n / len(counts))
        return result


def _samples(positions: Float64, faces: Int32) -> Samples:
    """All vertices, and the middle of each triangle."""
    _, corner = np.unique(faces, return_index=True)  # one of each vertex' corners
    triangles = np.concatenate([corner // 3, np.arange(len(faces))])
    weights = np.concatenate([np.eye(3)[corner % 3], np.full((len(faces), 3), 1 / 3)])
    return Samples(triangles, weights).sorted_for(positions, faces)
