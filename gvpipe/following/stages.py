"""The stages of a fit: from stiff and far-reaching to soft and exact."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Stage:
    """Some rounds of the same kind. Lengths are parts of the diagonal.

    Args:
        rounds: at most; a stage ends where a round hardly moves anything.
        stiffness: weight of an edge.
        scale: distance from which a pair counts less (Geman and McClure).
        agreement: least cosine between the normals of a pair.
        reach: greatest distance of a pair.
        hold: weight of a pair's distance in all directions, beside 1 along the normal; the rest lets it slide.
        follows_borders: whether pairs may end at a border. If not, a hole of one surface does not pull the other's.
        flows: whether each round starts from the shape of the one before, as a viscous sheet does. If not, edges go back to
            their lengths at rest.
        emphasis: distance from which a pair counts more, so that the largest errors shrink.
    """

    rounds: int
    stiffness: float
    scale: float
    agreement: float
    reach: float
    hold: float = 0.1
    follows_borders: bool = False
    flows: bool = False
    emphasis: float = np.inf


MOTION = (
    Stage(5, 30.0, 0.05, 0.3, 0.2),
    Stage(5, 10.0, 0.03, 0.3, 0.1),
    Stage(5, 3.0, 0.015, 0.3, 0.05),
    Stage(5, 1.0, 0.006, 0.4, 0.03),
)
"""The coarse mesh, from where a frame is expected to the surface."""

SURFACE = (
    Stage(2, 1.0, 0.01, 0.3, 0.04),
    Stage(3, 0.3, 0.02, 0.0, 0.04, hold=0.5, follows_borders=True),
    Stage(3, 0.1, 0.02, 0.0, 0.04, hold=0.5, follows_borders=True),
    Stage(3, 0.03, 0.02, 0.0, 0.04, hold=0.3, follows_borders=True),
)
"""The whole mesh, onto the surface: in the end all that is left of the distance counts, whatever the normals."""

REPAIR = (
    Stage(3, 0.05, 0.02, 0.0, 0.04, hold=0.3, follows_borders=True, flows=True),
    Stage(3, 0.01, 0.02, 0.0, 0.04, hold=0.3, follows_borders=True, flows=True),
)
"""Where that is not near enough: softer, and each round starts from the shape of the one before."""
