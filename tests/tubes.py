"""A torus, unevenly sampled, and the laplacian codec's surface and header of it."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from gvcodecs.laplacian import Laplacian
from gvcodecs.laplacian.domain import Surface, build_surface
from gvcodecs.laplacian.header import CoefficientCoding
from gvcodecs.laplacian.laplace_operators import laplacian
from gvpipe.container.bitstream import Bitstream
from gvpipe.mesh.graph_kernels import link_vertices
from gvpipe.metrics.comparison import compare
from gvpipe.model.sequence import MeshSequence
from gvpipe.trajectory.product_kernels import Rows

CODING = CoefficientCoding("mean-value", "kalman", 16, "hierarchy", 0.75, 1 / 16, 1.2, 1.5)


def tube(around: int, along: int) -> tuple[np.ndarray, np.ndarray]:
    """A closed tube (a torus in connectivity), unevenly sampled."""
    u, v = np.meshgrid(np.arange(around), np.arange(along), indexing="ij")
    angle, turn = 2 * np.pi * u / around, 2 * np.pi * v / along
    angle, turn = angle + 0.5 * np.sin(angle), turn + 0.6 * np.sin(turn)
    radius = 2 + 0.7 * np.cos(angle)
    points = np.c_[(radius * np.cos(turn)).ravel(), (radius * np.sin(turn)).ravel(), 0.7 * np.sin(angle).ravel()]
    corner = np.array([[((u + i) % around * along + (v + j) % along).ravel() for j in (0, 1)] for i in (0, 1)])
    (a, c), (b, d) = corner
    return points, np.concatenate([np.c_[a, b, c], np.c_[b, d, c]]).astype(np.int32)


def decoded(bitstream: Bitstream, like: MeshSequence) -> MeshSequence:
    reader = Laplacian.reader(bitstream)
    return MeshSequence(reader.read(0, bitstream.n_frames), reader.faces, like.fps)


def kg(sequence: MeshSequence, bitstream: Bitstream) -> float:
    error = compare(sequence, decoded(bitstream, sequence)).kg
    assert error is not None
    return error


def surface_of(shape: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, Surface]:
    points, faces = shape
    return points, build_surface(faces.astype(np.int32), len(points))


def operator_of(points: np.ndarray, faces: np.ndarray, operator: str = "mean-value") -> Rows:
    """The Laplacian of a mesh, by rows."""
    faces = np.ascontiguousarray(faces, np.int32)
    return laplacian(np.ascontiguousarray(points, np.float64), faces, link_vertices(faces, len(points)), operator)


def matrix_of(rows: Rows) -> sparse.csr_array:
    """The same matrix as SciPy has it."""
    n = len(rows.starts) - 1
    return sparse.csr_array((rows.values, rows.columns, rows.starts), shape=(n, n))
