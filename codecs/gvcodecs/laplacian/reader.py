"""From a ``laplacian`` bitstream back to frames.

Opening it factors the extended Laplacian, the first frame of a segment costs the segment's decoding, and each after that one
product of a small matrix with the coefficients.
"""

from __future__ import annotations

import numpy as np

from gvcodecs.laplacian.average_coding import NAME, decode_average
from gvcodecs.laplacian.coefficients import decode_coefficients
from gvcodecs.laplacian.domain import Domain, Surface, build_domain, build_surface
from gvcodecs.laplacian.header import Header
from gvcodecs.laplacian.normal_equations import Singular
from gvpipe.connectivity.topology_only import open_mesh
from gvpipe.container.bitstream import Bitstream
from gvpipe.container.segments import segment_starts
from gvpipe.foundation.arrays import Float32, Int32
from gvpipe.foundation.errors import corrupt_section
from gvpipe.mesh.hierarchy import keep_hierarchy
from gvpipe.trajectory.basis import decode_basis
from gvpipe.trajectory.reconstruction import Segment, read_frames
from gvpipe.trajectory.still_points import read_still


class LaplacianReader:
    """Frames of a ``laplacian`` bitstream.

    Raises:
        CorruptFile: a section does not hold what it must.
        OverBudget: mesh or factors take more than the file may; `TooMuchFill` where the triangles connect points at random.
    """

    def __init__(self, bitstream: Bitstream) -> None:
        self._header = Header.of(bitstream)
        self._bitstream = bitstream
        with open_mesh(bitstream) as (opened, mesh):
            keep_hierarchy(bitstream.budget, opened.n_points, len(opened.point_faces))
            surface = build_surface(opened.point_faces, opened.n_points)
            self._mesh = mesh()
        self._still = read_still(bitstream, self._mesh)
        try:
            self._domain = self._build_domain(surface)
        except Singular as exc:
            raise corrupt_section("average", "its Laplacian cannot be inverted") from exc
        self._bounds = segment_starts(bitstream.n_frames, self._header.segments)
        self._kept: tuple[int, Segment] | None = None

    @property
    def n_frames(self) -> int:
        """F, the number of frames."""
        return self._bitstream.n_frames

    @property
    def faces(self) -> Int32:
        """``(T, 3) int32`` triangles."""
        return self._mesh.faces

    def read(self, start: int, stop: int) -> Float32:
        """Return frames ``start`` to ``stop``: ``(stop - start, V, 3) float32``, model units.

        Raises:
            CorruptFile: a segment does not decode.
        """
        if not self._still.n_moving:
            return np.repeat(self._still.positions[None, self._mesh.points], stop - start, axis=0)
        frames = read_frames(start, stop, self._bounds, self._mesh.points, self._decode)
        self._still.overwrite(frames, self._mesh.points)
        return frames

    def _build_domain(self, surface: Surface) -> Domain:
        average = None
        if self._header.coding.needs_average:
            average = decode_average(self._bitstream.section(NAME), surface, self._header.coding, self._bitstream.budget)
        return build_domain(surface, average, self._header.coding, self._still.flags, self._bitstream.budget)

    def _decode(self, s: int) -> Segment:
        if self._kept is None or self._kept[0] != s:
            step, section = self._header.steps[s], self._bitstream.section
            name, n_frames = f"basis.{s}", self._bounds[s + 1] - self._bounds[s]
            basis = decode_basis(
                section(name),
                n_frames,
                self._still.n_moving,
                step * self._header.coding.basis_ratio,
                name,
                budget=self._bitstream.budget,
            )
            names = (f"anchors.{s}", f"deltas.{s}")
            anchors, deltas = (section(name) for name in names)
            n_components, given = basis.vectors.shape[1], self._still.given(basis, self._bitstream.budget)
            domain, coding = self._domain, self._header.coding
            domain.system.equations.ask_to_solve(n_components)
            coefficients = decode_coefficients(anchors, deltas, n_components, step, domain, coding, names, given)
            self._kept = s, Segment(basis, np.ascontiguousarray(coefficients))
        return self._kept[1]
