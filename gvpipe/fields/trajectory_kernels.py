"""Kernel of `gvpipe.fields.trajectories`: trajectories from their coefficients, alike on every machine."""

from __future__ import annotations

from gvpipe.arrays import Float64
from gvpipe.compiled import compiled


@compiled
def add_components(coefficients: Float64, components: Float64, rows: Float64) -> None:
    """Add ``coefficients (R, K)`` times ``components (K, N)`` to ``rows (R, N)``, one component after the other."""
    for i in range(len(rows)):
        row = rows[i]
        for k in range(len(components)):
            own, component = coefficients[i, k], components[k]
            for n in range(len(row)):
                row[n] += own * component[n]
