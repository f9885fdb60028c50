"""The edge shape of a mesh: its edge lengths, and the dihedral angles where two faces meet, averaged over frames.

Neither changes when a mesh moves as a whole, nor where it bends elsewhere: their averages keep the size that averages of
positions lose. Angles are averaged on the circle, where a frame's vote counts little if one of the two faces has collapsed:
angles about pi, and faces that define no normal, do no harm.

Source: Vasa, Marras, Hormann and Brunnett, "Compressing dynamic meshes with geometric Laplacians", 2014, section 5, after
Winkler, Drieseberg, Alexa and Hormann, "Multi-scale geometry interpolation", 2010.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gvpipe.foundation.arrays import Float32, Float64, Int32
from gvpipe.foundation.elementary import arctan2
from gvpipe.mesh.topology import unique_edges


@dataclass(frozen=True)
class EdgeShape:
    """What edges measure, on average over frames.

    Args:
        edges: ``(E, 2)`` vertex pairs, each once, ascending.
        lengths: ``(E,)`` mean length, model units.
        hinges: ``(H, 4)`` vertices i j k l of two faces i j k and j i l that meet.
        angles: ``(H,)`` mean dihedral angle, radians, -pi..pi, 0 in the plane.
        trust: ``(H,)`` mean height of the two faces over their edge, at most 1: how much an angle can be held to.
    """

    edges: Int32
    lengths: Float64
    hinges: Int32
    angles: Float64
    trust: Float64


class EdgeShapeSum:
    """Sums over the frames added so far, of a mesh with ``faces (T, 3)``."""

    def __init__(self, faces: Int32) -> None:
        self._edges, self._hinges = unique_edges(faces), find_hinges(faces)
        self._lengths, self._votes = np.zeros(len(self._edges)), np.zeros((len(self._hinges), 3))
        self._n_frames = 0

    def add(self, frames: Float32) -> None:
        """Add frames ``(n, V, 3)``, model units."""
        from gvcodecs.laplacian.edge_kernels import add_lengths, add_votes

        add_lengths(frames, self._edges, self._lengths)
        add_votes(frames, self._hinges, self._votes)
        self._n_frames += len(frames)

    def average(self) -> EdgeShape:
        """Return the averages."""
        cosines, sines, trust = self._votes.T
        lengths = self._lengths / self._n_frames
        return EdgeShape(self._edges, lengths, self._hinges, arctan2(sines, cosines), trust / self._n_frames)


def find_hinges(faces: Int32) -> Int32:
    """Return ``(H, 4)``: faces that meet at an edge, in pairs; three and more at one edge are paired as a chain."""
    sides = np.concatenate([faces[:, [i, (i + 1) % 3, (i + 2) % 3]] for i in range(3)])
    proper = (sides[:, 0] != sides[:, 1]) & (sides[:, 1] != sides[:, 2]) & (sides[:, 2] != sides[:, 0])
    low, high, opposite = np.unique(np.column_stack([np.sort(sides[proper, :2], axis=1), sides[proper, 2]]), axis=0).T
    meet = np.flatnonzero((low[1:] == low[:-1]) & (high[1:] == high[:-1]))
    return np.column_stack([low[meet], high[meet], opposite[meet], opposite[meet + 1]]).astype(np.int32)
