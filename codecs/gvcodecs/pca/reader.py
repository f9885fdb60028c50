"""From a ``pca`` bitstream back to frames, any of them, at any level of detail.

The first frame of a segment costs its whole decoding; each after that one product of a small matrix with the coefficients.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gvcodecs.pca.coefficients import decode_coefficients
from gvcodecs.pca.header import Header
from gvpipe.connectivity.topology_only import Topology, open_mesh
from gvpipe.container.bitstream import Bitstream
from gvpipe.container.segments import segment_starts
from gvpipe.foundation.arrays import Float32, Int32
from gvpipe.foundation.errors import InputError
from gvpipe.mesh.hierarchy import build_hierarchy, keep_hierarchy, level_faces
from gvpipe.trajectory.basis import decode_basis
from gvpipe.trajectory.causal_order import CausalOrder
from gvpipe.trajectory.causal_selection import leave_out
from gvpipe.trajectory.coefficient_coding import decode_vectors
from gvpipe.trajectory.reconstruction import Segment, read_frames
from gvpipe.trajectory.spatial_neighbours import ask_parallelograms, hierarchy_order, parallelogram_order
from gvpipe.trajectory.still_points import read_still

if TYPE_CHECKING:
    from gvpipe.mesh.hierarchy_kernels import Hierarchy


class PcaReader:
    """Frames of a ``pca`` bitstream.

    Level 0 is the mesh as it was given. Level k > 0 has the points (one for all vertices of a seam) that are decoded when the
    k finest blocks of the hierarchy are left out.

    Raises:
        CorruptFile: a section does not hold what it must.
    """

    def __init__(self, bitstream: Bitstream) -> None:
        self._header = Header.of(bitstream)
        self._bitstream = bitstream
        self._mesh, self._hierarchy, order = _read_connectivity(bitstream, self._header.predictor)
        self._still = read_still(bitstream, self._mesh)
        self._causal = leave_out(order, self._still.flags)
        self._bounds = segment_starts(bitstream.n_frames, self._header.segments)
        self._kept: tuple[tuple[int, int], Segment] | None = None  # segment and level, which has its own points alone

    @property
    def n_frames(self) -> int:
        """F, the number of frames."""
        return self._bitstream.n_frames

    @property
    def faces(self) -> Int32:
        """``(T, 3) int32`` triangles of level 0."""
        return self._mesh.faces

    @property
    def levels(self) -> list[int]:
        """Vertex counts of the levels of detail, level 0 first."""
        return [self._bitstream.n_vertices, *coarse_levels(self._hierarchy)]

    def level_faces(self, lod: int) -> Int32:
        """Return the triangles ``(n, 3) int32`` of a level, in the order of the vertices that `read` returns for it."""
        self._check_level(lod)
        if lod == 0:
            return self._mesh.faces
        waves_left = int(self._hierarchy.waves[-1 - lod])
        numbers = np.zeros(self._mesh.n_points, np.int32)
        alive = self._alive(lod)
        numbers[alive] = np.arange(len(alive))
        return numbers[level_faces(self._mesh.point_faces, self._mesh.n_points, waves_left)]

    def level_points(self, lod: int) -> tuple[Int32, Int32]:
        """Return the point ``(V,) int32`` of each vertex of level 0, and that of each vertex of a level above 0, ascending."""
        self._check_level(lod)
        return self._mesh.points, self._alive(lod)

    def read(self, start: int, stop: int, lod: int = 0) -> Float32:
        """Return frames ``start`` to ``stop`` of a level: ``(stop - start, V, 3) float32``, model units.

        Raises:
            CorruptFile: a segment does not decode.
            InputError: there is no such level.
        """
        self._check_level(lod)
        vertices = self._mesh.points if lod == 0 else self._alive(lod)
        if not self._still.n_moving:
            return np.repeat(self._still.positions[None, vertices], stop - start, axis=0)
        rows = vertices if lod == 0 else np.arange(len(vertices))  # of a segment's coefficients
        frames = read_frames(start, stop, self._bounds, rows, lambda s: self._decode(s, lod))
        self._still.overwrite(frames, vertices)
        return frames

    def _decode(self, s: int, lod: int) -> Segment:
        if self._kept is None or self._kept[0] != (s, lod):
            step = self._header.steps[s]
            n_frames = self._bounds[s + 1] - self._bounds[s]
            name = f"basis.{s}"
            budget = self._bitstream.budget
            basis = decode_basis(self._bitstream.section(name), n_frames, self._still.n_moving, step, name, budget=budget)
            given = self._still.given(basis, budget)
            name = f"coefficients.{s}"
            if given is not None and self._header.predictor == "lsp":
                given = np.ascontiguousarray(given[:, ::-1])
            data, n_components = self._bitstream.section(name), basis.vectors.shape[1]
            n_blocks = self._count_blocks(lod) if lod else None
            if self._header.has_first:
                orders = self._causal, self._first_order
                coefficients = decode_coefficients(data, n_components, step, *orders, name=name, n_blocks=n_blocks, given=given)
            else:
                how = self._header.predictor, self._header.beta, given
                coefficients = decode_vectors(data, n_components, step, self._causal, name, n_blocks, *how)
            if lod:
                coefficients = coefficients[self._alive(lod)]
            if self._header.predictor == "lsp":
                coefficients = np.ascontiguousarray(coefficients[:, ::-1])
            self._kept = (s, lod), Segment(basis, coefficients)
        return self._kept[1]

    def _first_order(self) -> CausalOrder:
        """The order of first components (`gvcodecs.pca.coefficients`), for one segment: it takes as much as the hierarchy."""
        n_points, faces = self._mesh.n_points, self._mesh.point_faces
        ask_parallelograms(self._bitstream.budget, n_points, len(faces))
        return leave_out(parallelogram_order(faces, n_points), self._still.flags)

    def _count_blocks(self, lod: int) -> int:
        """How many blocks of coefficients a level needs: those of its points that move."""
        n_moving = int((~self._still.flags[self._alive(lod)]).sum())
        return int(np.searchsorted(self._causal.blocks, n_moving))

    def _alive(self, lod: int) -> Int32:
        """Points of a level, ascending."""
        return np.sort(self._hierarchy.order[: self._hierarchy.blocks[-1 - lod]])

    def _check_level(self, lod: int) -> None:
        if not 0 <= lod < len(self.levels):
            raise InputError(f"level {lod}: there are levels 0..{len(self.levels) - 1}")


def _read_connectivity(bitstream: Bitstream, predictor: str) -> tuple[Topology, Hierarchy, CausalOrder]:
    """What follows from connectivity alone; files of a data set that have the same bytes there share it."""

    def read() -> tuple[Topology, Hierarchy, CausalOrder]:
        with open_mesh(bitstream) as (opened, mesh):
            keep_hierarchy(bitstream.budget, opened.n_points, len(opened.point_faces))
            hierarchy = build_hierarchy(opened.point_faces, opened.n_points)
            return mesh(), hierarchy, causal_order(hierarchy, predictor)

    if bitstream.shared is None:
        return read()
    found = bitstream.shared(f"pca {predictor}", (bitstream.section("mesh"), bitstream.section("order")), read)
    bitstream.check_size(len(found[0].points), len(found[0].faces))
    return found


def coarse_levels(hierarchy: Hierarchy) -> tuple[int, ...]:
    """Vertex counts of the levels of detail, from level 1 on."""
    return tuple(int(n) for n in hierarchy.blocks[-2:0:-1])


def causal_order(hierarchy: Hierarchy, predictor: str) -> CausalOrder:
    """The order of a mesh's points in encoder and decoder."""
    return hierarchy_order(hierarchy, predictor == "kalman")
