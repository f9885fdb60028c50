"""The sections of a ``pca`` bitstream, and the header that tells how to read them.

====================  ======================================================================================
``mesh``, ``order``   triangles, seams and vertex order (`gvpipe.connectivity.topology_only`)
``still``             points that never move, and their positions (`gvpipe.trajectory.still_points`); absent if all move
``basis.N``           mean and principal trajectories of segment N (`gvpipe.trajectory.basis`)
``coefficients.N``    feature vectors of segment N, some components first, then coarse to fine (`gvcodecs.pca.coefficients`)
====================  ======================================================================================

Where no point moves, segments have no sections.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from gvpipe.container.bitstream import Bitstream
from gvpipe.container.segments import read_segments, read_steps
from gvpipe.trajectory.prediction import PREDICTORS

MAX_SEGMENTS = 2000  # two sections each, of the 4096 that a bitstream may have
VERSION = 1  # of this layout


@dataclass(frozen=True)
class Header:
    """What a reader must know beside the sections.

    Args:
        predictor: of the coefficients.
        beta: exponent of the radial function (rbf).
        segments: how many; segment s starts at frame ``s * F // segments``.
        steps: quantisation step of each segment, model units; 1 where no point moves.
        has_first: coefficients say how many components come first (`gvcodecs.pca.coefficients`).
    """

    predictor: str
    beta: float
    segments: int
    steps: tuple[float, ...]
    has_first: bool

    def to_json(self) -> dict[str, Any]:
        """Return the header as JSON values."""
        first = {"first": True} if self.has_first else {}
        return {"predictor": self.predictor, "beta": self.beta, "segments": self.segments, "steps": list(self.steps), **first}

    @classmethod
    def of(cls, bitstream: Bitstream) -> Header:
        """Mirror of `to_json`; raises `CorruptFile` for values out of range."""
        fields, segments = bitstream.fields, read_segments(bitstream, MAX_SEGMENTS)
        predictor = fields.choice("predictor", PREDICTORS)
        has_first = fields.flag("first")
        if has_first and predictor != "kalman":
            raise fields.wrong("first", f"false with predictor {predictor}")
        return cls(predictor, fields.number("beta", 0.1, 1.99), segments, read_steps(bitstream, segments), has_first)
