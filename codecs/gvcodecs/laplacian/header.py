"""The sections of a ``laplacian`` bitstream, and the header that says how to read them.

====================  ======================================================================================
``mesh``, ``order``   triangles, seams and vertex order (`gvpipe.connectivity.topology_only`)
``still``             points that never move, and their positions (`gvpipe.trajectory.still_points`); absent if all move
``average``           the average mesh (`average_coding`); absent where nothing needs it
``basis.N``           mean and principal trajectories of segment N (`gvpipe.trajectory.basis`)
``anchors.N``         coefficients of the anchors, coarse to fine (`gvpipe.trajectory.coefficient_coding`, `anchors`)
``deltas.N``          delta trajectories of the other points (`gvpipe.trajectory.coefficient_coding`, `delta_rows`)
====================  ======================================================================================

Where no point moves, segments have no sections.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import Any

from gvcodecs.laplacian.anchors import ANCHOR_CHOICES
from gvcodecs.laplacian.delta_rows import DELTA_PREDICTIONS
from gvcodecs.laplacian.laplace_operators import OPERATORS
from gvpipe.container.bitstream import Bitstream
from gvpipe.container.segments import read_segments, read_steps

MAX_SEGMENTS = 1300  # three sections each, of the 4096 that a bitstream may have
VERSION = 1  # of this layout
MAX_SPACING = 1 << 20  # points per anchor
LEAST_RATIO, MOST_RATIO = 2.0**-10, 2.0**10  # of steps
FINEST, COARSEST = 2.0**-20, 1.0  # step of the average, mean edge lengths
MOST_POWER = 2.0


@dataclass(frozen=True)
class CoefficientCoding:
    """How coefficients of all segments are coded, and the average mesh before them.

    Args:
        operator: whose deltas are coded.
        delta_prediction: how they are predicted.
        anchors: points per anchor.
        anchor_choice: which points are anchors.
        edge_power: steps of deltas go with this power of the edge lengths around a point.
        average_step: quantisation step of the average mesh, mean edge lengths.
        anchor_ratio, basis_ratio: steps of anchors and of the basis, in steps of deltas.
    """

    operator: str
    delta_prediction: str
    anchors: int
    anchor_choice: str
    edge_power: float
    average_step: float
    anchor_ratio: float
    basis_ratio: float

    @property
    def needs_average(self) -> bool:
        """Whether there is an average mesh: the combinatorial operator needs none but for section 7's prediction."""
        return self.operator != "tutte" or self.delta_prediction == "rigid"

    def without_average(self) -> CoefficientCoding:
        """The same by connectivity alone."""
        return replace(self, operator="tutte", delta_prediction="kalman")

    def without_deltas(self) -> CoefficientCoding:
        """The same with all points as anchors: nothing is left to be solved for."""
        return replace(self.without_average(), anchors=1)

    @classmethod
    def of(cls, bitstream: Bitstream) -> CoefficientCoding:
        """From the header of a bitstream; raises `CorruptFile` for values out of range."""
        fields = bitstream.fields
        return cls(
            fields.choice("operator", OPERATORS),
            fields.choice("delta_prediction", DELTA_PREDICTIONS),
            fields.integer("anchors", 1, MAX_SPACING),
            fields.choice("anchor_choice", ANCHOR_CHOICES),
            fields.number("edge_power", 0, MOST_POWER),
            fields.number("average_step", FINEST, COARSEST),
            fields.number("anchor_ratio", LEAST_RATIO, MOST_RATIO),
            fields.number("basis_ratio", LEAST_RATIO, MOST_RATIO),
        )


@dataclass(frozen=True)
class Header:
    """What a reader must have beside the sections.

    Args:
        coding: of coefficients.
        segments: how many; segment s starts at frame ``s * F // segments``.
        steps: quantisation step of each segment's deltas, model units.
    """

    coding: CoefficientCoding
    segments: int
    steps: tuple[float, ...]

    def to_json(self) -> dict[str, Any]:
        """Return the header as JSON values."""
        return {**asdict(self.coding), "segments": self.segments, "steps": list(self.steps)}

    @classmethod
    def of(cls, bitstream: Bitstream) -> Header:
        """Mirror of `to_json`; raises `CorruptFile` for values out of range."""
        segments = read_segments(bitstream, MAX_SEGMENTS)
        return cls(CoefficientCoding.of(bitstream), segments, read_steps(bitstream, segments))
