"""The sections of a ``pdct`` bitstream, and the header that tells how to read them.

============  ===========================================================================
``mesh``      base frame (frame 0) of the points, on its lattice, and connectivity (`gvpipe.connectivity.welded_mesh`)
``order``     vertex order, empty if the codec's own (`gvpipe.connectivity.seams`)
``still``     points that never move, and their positions (`stillness`); absent if all move
``clip.N``    frames of clip N (`clip`); clip c starts at frame ``c * F // clips``, or at ``c * clip``
============  ===========================================================================

If no point moves, there are no clips. Files that are written as frames come do not know F, nor which vertices share a
trajectory: all clips but the last have ``clip`` frames, every vertex is a point, and there is no section ``still``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from gvcodecs.pdct.dictionary import BaseFrame
from gvpipe.connectivity.lattice_field import read_lattice
from gvpipe.connectivity.welded_mesh import WeldedMesh
from gvpipe.container.bitstream import Bitstream
from gvpipe.container.segments import MAX_SEGMENT, count_segments, read_segments, segment_starts
from gvpipe.foundation.errors import CorruptFile
from gvpipe.mesh.lattice import Lattice

VERSION = 1  # of this layout
MAX_CLIPS = 4000


@dataclass(frozen=True)
class Header:
    """What a reader must know beside the sections.

    Args:
        clips: how many.
        base: lattice of the base frame, model units.
        clip: frames of each clip but the last; 0: even cuts.
    """

    clips: int
    base: Lattice
    clip: int = 0

    def to_json(self) -> dict[str, Any]:
        """Return the header as JSON values."""
        cuts = {"clip": self.clip} if self.clip else {"clips": self.clips}
        return {**cuts, "base": [*self.base.origin, self.base.step]}

    def starts(self, n_frames: int) -> list[int]:
        """First frame of every clip, and F."""
        if not self.clip:
            return segment_starts(n_frames, self.clips)
        return [*range(0, n_frames, self.clip), n_frames]

    @classmethod
    def of(cls, bitstream: Bitstream) -> Header:
        """Mirror of `to_json`; raises `CorruptFile` for values out of range."""
        base = read_lattice(bitstream.fields)
        if "clip" not in bitstream.header:
            return cls(read_segments(bitstream, MAX_CLIPS, "clips"), base)
        clip = bitstream.fields.integer("clip", 1, MAX_SEGMENT)
        clips = count_segments(bitstream.n_frames, clip)
        if clips > MAX_CLIPS:
            raise CorruptFile(f"header: {bitstream.n_frames} frames in clips of {clip}; at most {MAX_CLIPS} clips are allowed")
        return cls(clips, base, clip)


def surface_of(mesh: WeldedMesh, lattice: Lattice) -> BaseFrame:
    """What all clips share, from the decoded base frame; points are numbered along the traversal."""
    return BaseFrame(lattice.points_at(mesh.lattice), mesh.point_faces, np.arange(len(mesh.lattice)))
