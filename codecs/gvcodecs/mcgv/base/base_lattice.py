"""The lattice of the base frame: its errors stay for all frames, so that it is finer than the step of residuals."""

from __future__ import annotations

import math

import numpy as np

from gvcodecs.mcgv.base.distinct_positions import keep_apart
from gvcodecs.mcgv.base.regular_spacing import align_step
from gvcodecs.mcgv.settings import Settings
from gvpipe.foundation.arrays import Float32, Int32
from gvpipe.mesh.lattice import Lattice

AFFINE_BITS = 12  # along the longest side, the paper's
BITS = 8, 16  # along the longest side, that are chosen unasked, about
WELD_BITS = 7  # along the longest side, of the lattice whose step limits that of welding
BASE_STEP = 1.3  # times step / sqrt(frames): measured, docs/decisions/0068-base-lattice-follows-the-target-error.md
FINER = 2**0.25  # times, a lattice that does not keep enough points distinct
DISTINCT = 0.85  # part of the positions in a base frame that its lattice must keep distinct; the others give way


def base_step(step: float, n_frames: int) -> float:
    """The lattice step that suits a quantisation step, both in model units."""
    return BASE_STEP * step / math.sqrt(n_frames)


def weld_step(settings: Settings, first: Float32, step: float) -> float:
    """The step by which vertices are one point, model units: a quantisation step, but no more than a coarse lattice.

    A mesh whose neighbours merge costs more, not less. As published, the target error touches no point.
    """
    if not settings.is_blended:
        return Lattice.over(first, AFFINE_BITS).step
    return min(step, Lattice.over(first, WELD_BITS).step)


def choose_lattice(settings: Settings, first: Float32, step: float) -> Lattice:
    """Return a lattice of about ``step``, model units, that keeps most points ``first (P, 3)`` of the first frame distinct."""
    if settings.base_bits or not settings.is_blended:
        return Lattice.over(first, settings.base_bits or AFFINE_BITS)
    extent = float(np.ptp(first.astype(np.float64), axis=0).max())
    finest, coarsest = (extent / 2**bits for bits in reversed(BITS))
    step = min(max(step, finest), coarsest)
    n_positions = len(np.unique(first, axis=0))
    while step > finest:
        lattice = Lattice.spaced(first, step)
        if len(np.unique(lattice.quantise(first), axis=0)) >= DISTINCT * n_positions:
            break
        step = max(step / FINER, finest)
    return Lattice.spaced(first, align_step(first, step))


def quantise_base(settings: Settings, lattice: Lattice, first: Float32) -> Int32:
    """Return the lattice points ``(P, 3)`` of points ``first (P, 3)``; blended prediction keeps them distinct."""
    return keep_apart(lattice, first) if settings.is_blended else lattice.quantise(first)
