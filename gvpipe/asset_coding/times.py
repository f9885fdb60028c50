"""Section ``times``: when each frame is, for sequences whose times do not follow from the rate.

Times are seconds as float64, and come back bit for bit. Second differences of their bits, as integers, are small where steps
are even (docs/format.md, 11.3)::

    section = deflated (zlib) 8 planes of F bytes: plane k has byte k, counted from the lowest, of each frame's residual
    residual = d as unsigned, zigzag: 2 d for d >= 0, else -2 d - 1
    d        = b_f - 2 b_(f-1) + b_(f-2), modulo 2^64, as int64; b is 0 before frame 0
"""

from __future__ import annotations

import numpy as np

from gvpipe.container.deflated import deflated, inflated
from gvpipe.foundation.budget import UNLIMITED, Budget
from gvpipe.foundation.errors import corrupt_section

SECTION = "times"
BYTES_PER_FRAME, SECONDS_PER_FRAME = 100, 0.2e-6  # a tuple of floats, and what they are made of


def pack_times(times: tuple[float, ...]) -> bytes:
    """Return the section.

    Examples:
        >>> len(pack_times(tuple(1.25e-5 * k for k in range(1000)))) < 1000
        True
    """
    bits = np.array(times, "<f8").view(np.int64)
    padded = np.concatenate([np.zeros(2, np.int64), bits])
    differences = padded[2:] - 2 * padded[1:-1] + padded[:-2]  # wrap around
    zigzag = (differences << 1) ^ (differences >> 63)
    return deflated(np.ascontiguousarray(zigzag.astype("<i8").view(np.uint8).reshape(-1, 8).T).tobytes())


def unpack_times(data: bytes, n_frames: int, budget: Budget = UNLIMITED) -> tuple[float, ...]:
    """Mirror of `pack_times`.

    Raises:
        CorruptFile: it is not what `pack_times` writes for so many frames, or a time is not finite.
        OverBudget: it takes too much memory.
    """
    budget.ask(f"section {SECTION!r}", BYTES_PER_FRAME * n_frames, SECONDS_PER_FRAME * n_frames)
    given = inflated(data, 8 * n_frames, SECTION, f"a time for each of {n_frames} frames")
    planes = np.frombuffer(given, np.uint8)
    zigzag = np.ascontiguousarray(planes.reshape(8, -1).T).view("<u8")[:, 0]
    differences = (zigzag >> np.uint64(1)).astype(np.int64) ^ -(zigzag & np.uint64(1)).astype(np.int64)
    times = np.cumsum(np.cumsum(differences)).view(np.float64)
    if not np.isfinite(times).all():
        raise corrupt_section(SECTION, f"the time of frame {int(np.flatnonzero(~np.isfinite(times))[0])} is no number")
    return tuple(times.tolist())
