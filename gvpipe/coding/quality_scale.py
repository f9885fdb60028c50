"""What quality means, for every codec: its target error, by Karni and Gotsman's measure.

=======  ====  ====  ====  =====  ====
quality  25    50    75    90     100
error    3.5   0.7   0.14  0.044  0.02
=======  ====  ====  ====  =====  ====

Errors in percent (`gvpipe.metrics.vertex_errors`). The logarithm falls evenly, by a factor of 5 in 25 up to quality 75, and of
7 above.
"""

from __future__ import annotations

from gvpipe.foundation.elementary import exp, log

MIDDLE, ERROR = 75.0, 0.14  # a quality and its error, percent
BELOW, ABOVE = log(5) / 25, log(7) / 25  # fall of the logarithm per unit of quality


def error_of(quality: float) -> float:
    """Return the target error, percent (`gvpipe.metrics.vertex_errors`), of a quality, 0..100.

    Examples:
        >>> error_of(75), round(error_of(50), 6)
        (0.14, 0.7)
    """
    return ERROR * exp((MIDDLE - quality) * fall_at(quality))


def quality_of(error: float) -> float:
    """Mirror of `error_of`: the quality, 0..100, whose target error comes closest to ``error``, percent, above 0.

    Examples:
        >>> quality_of(0.14), quality_of(100)
        (75.0, 0.0)
    """
    fall = log(ERROR / error)
    return on_scale(MIDDLE + fall / (BELOW if fall < 0 else ABOVE))


def fall_at(quality: float) -> float:
    """Return by how much the logarithm of the target error falls there, per unit of quality."""
    return BELOW if quality < MIDDLE else ABOVE


def on_scale(quality: float) -> float:
    """Return the nearest quality in 0..100."""
    return min(max(quality, 0.0), 100.0)
