"""The average mesh of a sequence in edge shape space.

Averages of positions shrink what turns: a mesh that walks in a circle ends as a needle. Averages of edge lengths and dihedral
angles do not, and the mesh that comes closest to them is found by non-linear least squares:

1. one pass over the frames, a chunk at a time: average edge shape (`edge_shape`), mean positions, and the mean of frames turned
   and moved onto each other, each connected component by itself;
2. from that aligned mean, Levenberg-Marquardt steps toward the average edge shape (`shape_fit`);
3. each component is laid onto its aligned mean, then the whole so that a reference face agrees with its mean position.

The Laplacian's weights depend on neither size nor place: placement decides no more than the extent over which the average is
quantised, so components stay together as they are in the frames.

Source: Vasa, Marras, Hormann and Brunnett, "Compressing dynamic meshes with geometric Laplacians", 2014, section 5.
"""

from __future__ import annotations

import numpy as np

from gvcodecs.laplacian.alignment import Groups, rotations
from gvcodecs.laplacian.edge_shape import EdgeShapeSum
from gvcodecs.laplacian.shape_fit import fit_shape
from gvpipe.foundation.arrays import Float64, Int32
from gvpipe.mesh.topology import adjacency, components
from gvpipe.model.sequence import MeshSequence
from gvpipe.trajectory.gram import product

BLOCK = 8  # frames aligned at a time, to the mean of those before
ALIGNED = 64  # frames aligned at most, evenly spread: they give no more than a start


def average_mesh(sequence: MeshSequence, faces: Int32, start: int = 0, stop: int | None = None) -> Float64:
    """Return the average ``(V, 3)`` of frames ``start`` to ``stop``, model units.

    Args:
        sequence: frames are read once, and may load when read.
        faces: ``(T, 3)`` triangles on its vertices, degenerate and non-manifold ones included. They may be others than the
            sequence's own: seams should be welded.
    """
    stop = sequence.n_frames if stop is None else stop
    n_vertices = sequence.n_vertices
    whole = Groups(np.zeros(n_vertices, np.int32))
    parts = Groups(components(adjacency(faces, n_vertices))[1])
    edge_shape = EdgeShapeSum(faces)
    mean, aligned, n_aligned = np.zeros((n_vertices, 3)), np.zeros((n_vertices, 3)), 0
    stride = max(1, -(-(stop - start) // ALIGNED))
    for first, chunk in sequence.chunks(start, stop):
        edge_shape.add(chunk)
        mean += chunk.sum(axis=0, dtype=np.float64)
        chosen = chunk[-(first - start) % stride :: stride]
        for at in range(0, len(chosen), BLOCK):
            frames = chosen[at : at + BLOCK].astype(np.float64)
            frames -= frames.mean(axis=1, keepdims=True)
            target = aligned / n_aligned if n_aligned else frames[0]
            aligned += parts.turned(whole.turned(frames, target), target).sum(axis=0)
            n_aligned += len(frames)
    mean, aligned = mean / (stop - start), aligned / n_aligned
    fitted = fit_shape(edge_shape.average(), aligned, parts.labels)
    fitted += (parts.centres(aligned[None]) - parts.centres(fitted[None]))[0, parts.labels]
    return _place(parts.turned(fitted[None], aligned)[0], mean, faces)


def _place(points: Float64, mean: Float64, faces: Int32) -> Float64:
    """Move and turn points so that the face that is largest in the mean positions lies where it lies there."""
    if not len(faces):
        return np.asarray(points + (mean - points).mean(axis=0))
    side_b, side_c = (mean[faces[:, i]] - mean[faces[:, 0]] for i in (1, 2))
    reference = faces[np.argmax(np.linalg.norm(np.cross(side_b, side_c), axis=1))]
    centre, wanted = points[reference].mean(axis=0), mean[reference].mean(axis=0)
    turn = rotations(product((points[reference] - centre).T, mean[reference] - wanted))
    return np.asarray(product(points - centre, turn) + wanted)
