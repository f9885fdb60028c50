"""What a reader knows of the base frame: which vertices move, what shares a sample, and what shares a blend.

A *slot* is what a picture has a pixel for: a point that moves. Vertices that coincide in every frame coincide when decoded, and
vertices that stand still have neither sample nor motion.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from gvcodecs.mcgv.base.welded_points import Points
from gvcodecs.mcgv.header import Header
from gvpipe.connectivity.welded_mesh import open_points
from gvpipe.container.bitstream import Bitstream
from gvpipe.foundation.arrays import Float32, Float64, Int32, Int64
from gvpipe.foundation.errors import CorruptFile, corrupt
from gvpipe.trajectory.still_vertices import decode_flags

STILL = "still"  # section: which points never move


@dataclass(frozen=True)
class Slots:
    """The base frame's S slots: what motion and pictures need of it.

    Args:
        lattice: ``(S, 3)`` their base positions, lattice units; base: the same in model units.
        points: what joins them.
    """

    lattice: Int32
    base: Float64
    points: Points

    @property
    def n_slots(self) -> int:
        """S, the number of slots."""
        return len(self.lattice)


@dataclass(frozen=True)
class DecodedBase(Slots):
    """The base frame: its slots, and its vertices.

    Args:
        faces: ``(T, 3)`` triangles over V vertices.
        rest: ``(V, 3)`` decoded base positions, model units; empty where all vertices move.
        vertices: ``(M,)`` the vertices that move, ascending.
        slot: ``(M,)`` theirs.
    """

    faces: Int32
    rest: Float32
    vertices: Int64
    slot: Int64

    def fill_still(self, positions: Float32) -> None:
        """Fill in the vertices of ``positions (n, V, 3)`` that never move."""
        if len(self.vertices) < len(self.rest):
            still = np.ones(len(self.rest), bool)
            still[self.vertices] = False
            positions[:, still] = self.rest[still]


def _place(lattice: Int32, header: Header) -> Float64:
    """Base positions ``(n, 3)`` of lattice points; raises `CorruptFile` if one is larger than float32 can hold."""
    placed = header.base.points_at(lattice)
    if not np.abs(placed).max(initial=0) <= np.finfo(np.float32).max:
        raise corrupt("header: its base frame is larger than float32 can hold")
    return placed


def read_surface(bitstream: Bitstream, header: Header) -> DecodedBase:
    """Decode the sections ``mesh``, ``order`` and ``still``; raises `CorruptFile`."""
    with open_surface(bitstream, header) as (_, finished):
        return finished()


@contextmanager
def open_surface(bitstream: Bitstream, header: Header) -> Iterator[tuple[Slots, Callable[[], DecodedBase]]]:
    """As `read_surface`: give the slots, and a function that waits for all of it. Both raise `CorruptFile`.

    What needs slots alone can be done meanwhile.
    """
    with open_points(bitstream) as (opened, finished):
        n_points = len(opened.lattice)
        has_still = STILL in bitstream.sections
        still = decode_flags(bitstream.section(STILL), n_points, STILL) if has_still else np.zeros(n_points, bool)
        moves = np.flatnonzero(~still)
        if not len(moves):
            raise CorruptFile("section 'still' is corrupt: one point at least has samples; get the file again from its source")
        placed, all_move = _place(opened.lattice, header), len(moves) == n_points
        lattice = opened.lattice if all_move else opened.lattice.take(moves, axis=0)
        slot_base = placed if all_move else placed.take(moves, axis=0)
        slots = Slots(lattice, slot_base, Points.moving(opened, moves))

        def finish() -> DecodedBase:
            mesh = finished()
            if all_move:
                vertices, slot, rest = np.arange(len(mesh.point)), mesh.point, np.zeros((0, 3), np.float32)
            else:
                vertices, rest = np.flatnonzero(~still[mesh.point]), placed.astype(np.float32)[mesh.point]
                slot = (np.cumsum(~still) - 1)[mesh.point[vertices]]
            return DecodedBase(**vars(slots), faces=mesh.faces, rest=rest, vertices=vertices, slot=slot)

        yield slots, finish
