"""The times of a simulation's steps: the rate that they are played at, and what of them is kept."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gvpipe.foundation.arrays import Float64
from gvpipe.foundation.notes import ASSUMED_FPS, DEFAULT_FPS

EVEN = 1e-3  # part of the mean step: steps that differ by less are even, as rounded decimals are
SLOWEST, FASTEST = 1e-6, 100_000.0  # frames per second that a sequence can have
SLOWEST_SHOWN, FASTEST_SHOWN = 0.5, 240.0  # that a person can watch
WATCHED = 25.0  # frames per second, where steps are slower or faster than that
ROUNDING = 1e-12  # of a time: what follows from the rate to this is not kept beside it


@dataclass(frozen=True)
class Timing:
    """When the frames are.

    Args:
        fps: frames per second.
        start: time of the first frame, seconds.
        times: of each frame, where they do not follow from the rate, for `gvpipe.Metadata.times`.
        notes: a line each.
    """

    fps: float
    start: float
    times: tuple[float, ...]
    notes: tuple[str, ...]


def time_steps(times: Float64 | None, n_frames: int, fps: float | None, real_time: bool = False) -> Timing:
    """Return when the frames are, one per step; the rate follows from the mean step, where a person can watch that.

    Args:
        times: ``(F,)`` of the steps, seconds; None: the file has none.
        n_frames: F.
        fps: frames per second instead of the file's.
        real_time: whether the rate is that of the steps, however fast or slow.
    """
    if times is None:
        return Timing(fps or DEFAULT_FPS, 0.0, (), () if fps or n_frames < 2 else (ASSUMED_FPS,))
    if not np.isfinite(times).all():
        bad = int(np.flatnonzero(~np.isfinite(times))[0])
        rate = fps or DEFAULT_FPS
        return Timing(
            rate, 0.0, (), (f"the time of frame {bad} is {times[bad]}; all are left out, {rate:g} a second are shown",)
        )
    start = float(times[0])
    if n_frames < 2:
        return Timing(fps or DEFAULT_FPS, start, (), ())
    steps = np.diff(times)
    mean = float(times[-1] - start) / (n_frames - 1)
    exact = tuple(times.tolist())
    if not (steps > 0).all() or not SLOWEST <= 1 / mean <= FASTEST:
        rising = bool((steps > 0).all())
        why = f"the steps' times are {mean:.3g} s apart" if rising else f"the steps' times do not rise ({_where(times, steps)})"
        rate = fps or (WATCHED if rising and not real_time else DEFAULT_FPS)
        return Timing(rate, start, exact, (f"{why}; frames are {rate:g} a second, the times are kept",))
    is_shown = real_time or SLOWEST_SHOWN <= 1 / mean <= FASTEST_SHOWN
    rate = fps or (_whole(1 / mean) if is_shown else WATCHED)
    follow = np.allclose(start + np.arange(n_frames) / rate, times, rtol=ROUNDING, atol=ROUNDING * mean)
    kept = () if follow else exact
    if fps is None and not is_shown:
        watched = (
            f"steps are {mean:.3g} s apart, so that {n_frames} frames are shown at {rate:g} a second; the times are kept "
            "(--real-time shows them as they passed)",
        )
        return Timing(rate, start, kept, watched)
    is_even = bool((np.abs(steps - mean) <= EVEN * mean).all())
    said = () if is_even else (
        f"time steps are uneven, {steps.min():.3g} to {steps.max():.3g} s; frames are {rate:.6g} a second, "
        "the times are kept",
    )  # fmt: skip
    return Timing(rate, start, kept, said)


def _where(times: Float64, steps: Float64) -> str:
    """The first frame that is not behind the one before."""
    at = int(np.flatnonzero(~(steps > 0))[0]) + 1
    return f"frame {at - 1} is at {times[at - 1]:.9g} s, frame {at} at {times[at]:.9g} s"


def _whole(rate: float) -> float:
    """A rate without the rounding of the times that it was computed from."""
    return float(round(rate)) if round(rate) > 0 and abs(rate - round(rate)) < EVEN * rate else float(f"{rate:.9g}")


def empty_note(n_steps: int) -> tuple[str, ...]:
    """The note for steps without cells before the first that has some."""
    first = "the first step has" if n_steps == 1 else f"the first {n_steps} steps have"
    return (f"{first} no cells; the sequence begins behind",) if n_steps else ()
