"""The sections of a ``pca`` bitstream, and the header that tells how to read them.

====================  ======================================================================================
``mesh``, ``order``   triangles, seams and vertex order (`gvpipe.bare_mesh`)
``basis.N``           mean and principal trajectories of segment N (`gvpipe.trajectory_basis`)
``coefficients.N``    feature vectors of segment N, coarse to fine (`gvpipe.row_coding`, `gvpipe.hierarchy`)
====================  ======================================================================================
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from gvpipe.bitstream import Bitstream
from gvpipe.errors import CorruptFile
from gvpipe.row_prediction import PREDICTORS
from gvpipe.segments import count_longest

MAX_SEGMENTS = 2000  # two sections each, of the 4096 that a bitstream may have
SMALL, LARGE = 2.0**-131, 2.0**129  # no step of a float32 model lies beyond
MAX_SEGMENT = 100_000  # frames


@dataclass(frozen=True)
class Header:
    """What a reader must know beside the sections.

    Args:
        predictor: of the coefficients.
        beta: exponent of the radial function (rbf).
        segments: how many; segment s starts at frame ``s * F // segments``.
        steps: quantisation step of each segment, model units.
    """

    predictor: str
    beta: float
    segments: int
    steps: tuple[float, ...]

    def to_json(self) -> dict[str, Any]:
        """Return the header as JSON values."""
        return {"predictor": self.predictor, "beta": self.beta, "segments": self.segments, "steps": list(self.steps)}

    @classmethod
    def of(cls, bitstream: Bitstream) -> Header:
        """Mirror of `to_json`; raises `CorruptFile` for values out of range."""
        predictor = bitstream.header.get("predictor")
        if predictor not in PREDICTORS:
            raise CorruptFile(f"header: no predictor {predictor!r}; there are {', '.join(PREDICTORS)}")
        segments = bitstream.integer("segments", 1, min(MAX_SEGMENTS, bitstream.n_frames))
        steps = bitstream.header.get("steps")
        if not (
            isinstance(steps, list)
            and len(steps) == segments
            and all(type(step) in (int, float) and SMALL < step < LARGE for step in steps)
        ):
            raise CorruptFile(f"header: steps are not {segments} positive numbers; get the file again from its source")
        if count_longest(bitstream.n_frames, segments) > MAX_SEGMENT:
            raise CorruptFile(
                f"header: {bitstream.n_frames} frames in {segments} segments; at most {MAX_SEGMENT} each are allowed"
            )
        return cls(predictor, float(bitstream.number("beta", 0.1, 1.99)), segments, tuple(map(float, steps)))
