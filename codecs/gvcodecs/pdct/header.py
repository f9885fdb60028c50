"""The sections of a ``pdct`` bitstream, and the header that tells how to read them.

============  ===========================================================================
``mesh``      base frame (frame 0) of the points, on its lattice, and connectivity (`gvpipe.connectivity.welded_mesh`)
``order``     vertex order, empty if the codec's own (`gvpipe.connectivity.seams`)
``still``     points that never move, and their positions (`stillness`); absent if all move
``clip.N``    frames of clip N (`clip`); clip c starts at frame ``c * F // clips``
============  ===========================================================================

Version 1 has no section ``still``, and every vertex is a point: ``mesh`` and ``order`` are those of
`gvpipe.connectivity.base_mesh`. If no point moves, there are no clips.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from gvcodecs.pdct.dictionary import Surface
from gvpipe.connectivity.base_mesh import BaseMesh
from gvpipe.connectivity.welded_mesh import WeldedMesh
from gvpipe.container.bitstream import Bitstream
from gvpipe.container.segments import HUGE, read_segments
from gvpipe.errors import CorruptFile
from gvpipe.mesh.lattice import Lattice

VERSION_POINTS = 2  # vertices that share a trajectory are one point; sections `still` and `holds`
MAX_CLIPS = 4000


@dataclass(frozen=True)
class Header:
    """What a reader must know beside the sections.

    Args:
        clips: how many.
        base: lattice of the base frame, model units.
    """

    clips: int
    base: Lattice

    def to_json(self) -> dict[str, Any]:
        """Return the header as JSON values."""
        return {"clips": self.clips, "base": [*self.base.origin, self.base.step]}

    @classmethod
    def of(cls, bitstream: Bitstream) -> Header:
        """Mirror of `to_json`; raises `CorruptFile` for values out of range."""
        return cls(read_segments(bitstream, MAX_CLIPS, "clips"), check_lattice(bitstream.header.get("base")))


def check_lattice(values: Any) -> Lattice:
    """Return the lattice that ``values``, an origin and a step, name; raises `CorruptFile` for anything else."""
    is_list = isinstance(values, list) and len(values) == 4
    if not is_list or not all(isinstance(v, int | float) and abs(v) < HUGE for v in values) or not values[3] > 0:
        raise CorruptFile(f"header: base is {values!r}; an origin and a step above 0 are needed")
    return Lattice((values[0], values[1], values[2]), values[3])


def surface_of(mesh: BaseMesh, lattice: Lattice) -> Surface:
    """What all clips share where every vertex is a point; signals follow the codec's order, a walk over the surface."""
    return Surface(lattice.points_at(mesh.points), mesh.faces, np.argsort(mesh.visits))


def surface_of_points(mesh: WeldedMesh, lattice: Lattice) -> Surface:
    """What all clips share, from the decoded base frame; points are numbered along the walk."""
    return Surface(lattice.points_at(mesh.lattice), mesh.point_faces, np.arange(len(mesh.lattice)))
