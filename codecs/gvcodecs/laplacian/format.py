"""The sections of a ``laplacian`` bitstream, and the header that tells how to read them.

====================  ======================================================================================
``mesh``, ``order``   triangles, seams and vertex order (`gvpipe.bare_mesh`)
``average``           the average mesh (`average_coding`); absent where nothing needs it
``basis.N``           mean and principal trajectories of segment N (`gvpipe.trajectory_basis`)
``anchors.N``         coefficients of the anchors, coarse to fine (`gvpipe.row_coding`, `anchors`)
``deltas.N``          delta trajectories of the other points (`gvpipe.row_coding`, `delta_rows`)
====================  ======================================================================================
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from gvcodecs.laplacian.anchors import ANCHOR_CHOICES
from gvcodecs.laplacian.delta_rows import DELTA_PREDICTIONS
from gvcodecs.laplacian.operators import OPERATORS
from gvpipe.bitstream import Bitstream
from gvpipe.errors import CorruptFile
from gvpipe.segments import count_longest

MAX_SEGMENTS = 1300  # three sections each, of the 4096 that a bitstream may have
MAX_SEGMENT = 100_000  # frames
MAX_SPACING = 1 << 20  # points per anchor
SMALL, LARGE = 2.0**-131, 2.0**129  # no step of a float32 model lies beyond
LEAST_RATIO, MOST_RATIO = 2.0**-10, 2.0**10  # of steps
FINEST, COARSEST = 2.0**-20, 1.0  # step of the average, mean edge lengths
MOST_POWER = 2.0


@dataclass(frozen=True)
class Header:
    """What a reader must know beside the sections.

    Args:
        operator: whose deltas are coded.
        delta_prediction: how they are predicted.
        anchors: points per anchor.
        anchor_choice: which points are anchors.
        edge_power: steps of deltas go with this power of the edge lengths around a point.
        average_step: quantisation step of the average mesh, mean edge lengths.
        anchor_ratio, basis_ratio: steps of anchors and of the basis, in steps of deltas.
        segments: how many; segment s starts at frame ``s * F // segments``.
        steps: quantisation step of each segment's deltas, model units.
    """

    operator: str
    delta_prediction: str
    anchors: int
    anchor_choice: str
    edge_power: float
    average_step: float
    anchor_ratio: float
    basis_ratio: float
    segments: int
    steps: tuple[float, ...]

    @property
    def needs_average(self) -> bool:
        """Whether there is an average mesh: the combinatorial operator needs none but for section 7's prediction."""
        return self.operator != "tutte" or self.delta_prediction == "rigid"

    def to_json(self) -> dict[str, Any]:
        """Return the header as JSON values."""
        return {**asdict(self), "steps": list(self.steps)}

    @classmethod
    def of(cls, bitstream: Bitstream) -> Header:
        """Mirror of `to_json`; raises `CorruptFile` for values out of range."""
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
        return cls(
            _choice(bitstream, "operator", OPERATORS),
            _choice(bitstream, "delta_prediction", DELTA_PREDICTIONS),
            bitstream.integer("anchors", 1, MAX_SPACING),
            _choice(bitstream, "anchor_choice", ANCHOR_CHOICES),
            float(bitstream.number("edge_power", 0, MOST_POWER)),
            float(bitstream.number("average_step", FINEST, COARSEST)),
            float(bitstream.number("anchor_ratio", LEAST_RATIO, MOST_RATIO)),
            float(bitstream.number("basis_ratio", LEAST_RATIO, MOST_RATIO)),
            segments,
            tuple(map(float, steps)),
        )


def _choice(bitstream: Bitstream, key: str, choices: tuple[str, ...]) -> str:
    value = bitstream.header.get(key)
    if value not in choices:
        raise CorruptFile(f"header: no {key} {value!r}; there are {', '.join(choices)}")
    return str(value)
