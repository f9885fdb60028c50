"""Which quality meets a target: rate control by error or size, and the smallest file that keeps every vertex within a bound.

Bytes and the logarithm of the error follow quality monotonically and nearly in a straight line, so a target is a root of a
rising function of quality. `find_quality` takes steps of an assumed slope until the root lies between two qualities, then
regula falsi; where one end would stay for ever, its value is halved (the Illinois rule: M. Dowell and P. Jarratt, A modified
regula falsi method, 1971). A target error begins with the quality that aims at it (`gvpipe.quality_scale`).

An encoder that aims measures its first encode, and corrects those that follow by it. So a first trial that misses by little
is not on the curve of the others: half of its miss is corrected, and it bounds no root.

The errors of small meshes scatter by some percent about their trend, so that no method finds a root: then it tries qualities
next to where the root lies on the mean, one after the other, until one is met.

`find_smallest` fits parabolas to the logarithm of the size.

Encodes are what costs, so neither makes more than a few: 8, and 12 where errors scatter, since a trial of a small mesh costs
about half of the first encode.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from gvpipe.codec import Codec, Progress
from gvpipe.errors import InputError, SettingError
from gvpipe.metrics.vertex_errors import frame_diagonal, measure_spread
from gvpipe.quality_scale import ABOVE, BELOW, MIDDLE, quality_of
from gvpipe.rate_control.trials import Trial, Trials
from gvpipe.sequence import MeshSequence

TOLERANCE = 0.03  # how far on its allowed side of the target a result may lie
MOST_ENCODES = 8
RATE_SLOPE = 0.025  # assumed change of the logarithm of the size per unit of quality; that of the error: `gvpipe.quality_scale`
AIMED = 0.35  # logarithm: a first trial that misses the error by no more was aimed at it
BELIEVED = 0.7, 1.3  # times the assumed slope: between such a trial and the second
NAMES = {
    "rmse": "an rmse (of the diagonal) of",
    "kg": "a KG error (percent) of",
    "bpvf": "a rate (bits per vertex and frame) of",
    "max": "a largest error of",
}
NEAR = 4.0  # of quality: so near to the root, smooth errors are as predicted
MOST_NEAR = 2  # trials so near that miss; one more, and errors are taken to scatter
MOST_SCATTERED = 12  # encodes where they do
SPACING = 0.05  # of quality: between trials there, at least
BOUND_RATIO = 2.8  # bound by rmse where files are smallest, about
FIRST_STEP = 8.0  # of quality, when looking for the smallest
LEAST_STEP = 1.5
WORTH = 0.003  # part of the size that one more encode must promise to save
ROUGH_TOLERANCE, ROUGH_WORTH = 0.3, 0.03

Attempt = Callable[[float], Trial]


@dataclass(frozen=True)
class Target:
    """A number that the file must not exceed, and should come close to.

    Args:
        measure: ``rmse`` (parts of frame 0's diagonal) or ``kg`` (percent) of the decoded frames; ``bpvf`` of the file;
            ``max``, a bound that every vertex of every frame keeps, model units.
        value: above 0.

    Raises:
        SettingError: a value that is not a positive number.
    """

    measure: str
    value: float

    def __post_init__(self) -> None:
        if self.measure not in NAMES:
            raise SettingError(f"target {self.measure!r}; one of {', '.join(NAMES)} is needed")
        if isinstance(self.value, bool) or not isinstance(self.value, int | float) or not 0 < self.value < math.inf:
            raise SettingError(f"target {self.measure} is {self.value!r}; a number above 0 is needed")

    def of(self, trial: Trial) -> float:
        """What the trial came to; raises `InputError` if the sequence has no such measure."""
        errors = trial.errors
        found = {"rmse": errors.rmse_diag, "kg": errors.kg, "bpvf": trial.bpvf, "max": errors.max}[self.measure]
        if found is None:
            raise InputError(f"this sequence has no size to measure its {self.measure} by; give another target or a quality")
        return found

    def is_met(self, trial: Trial) -> bool:
        """Whether the trial is on the allowed side."""
        return self.of(trial) <= self.value


@dataclass(frozen=True)
class Choice:
    """The encode that was chosen, how to check its file (`Trials.check`), all that were tried, in order, and why this one."""

    trial: Trial
    trials: Trials
    tried: list[Trial]
    reason: str


def meet(
    target: Target, codec: Codec, sequence: MeshSequence, progress: Progress | None = None, is_rough: bool = False
) -> Choice:
    """Encode at the quality that meets a target, within 3 % or, for estimates, roughly.

    The search starts at the quality that aims at an rmse or KG error, for other targets at the codec's own.

    Raises:
        InputError: no quality meets it.
    """
    if target.measure == "max":
        trials = Trials(codec, sequence, target.value, progress)
        trial, tried = find_smallest(trials, target.value, codec.quality, ROUGH_WORTH if is_rough else WORTH)
        reason = (
            f"quality {trial.codec.quality:.4g} is the smallest of {len(tried)}, {trial.corrections} bytes of it corrections"
        )
        return Choice(trial, trials, tried, reason)
    trials = Trials(codec, sequence, None, progress)
    tolerance = ROUGH_TOLERANCE if is_rough else TOLERANCE
    trial, tried = find_quality(trials, target, _start(target, codec, sequence, tolerance), tolerance)
    found = target.of(trial)
    reason = f"quality {trial.codec.quality:.4g} gives {NAMES[target.measure]} {found:.4g} where {target.value:g} is allowed"
    if found < (1 - TOLERANCE) * target.value:
        reason += "; no quality comes closer" if trial.codec.quality in (0, 100) else f"; the closest of {len(tried)}"
    return Choice(trial, trials, tried, reason)


def parse_bound(bound: float | str, sequence: MeshSequence) -> float:
    """A largest error in model units, from such a number or from a text: ``"0.01"``, or ``"0.05%"`` of frame 0's diagonal.

    Raises:
        SettingError: no positive number, or a part of a diagonal that is 0.
    """
    text = str(bound).strip()
    try:
        value = float(text.removesuffix("%"))
    except ValueError as exc:
        raise SettingError(f"max error is {bound!r}; a length such as 0.01, or a part of the diagonal such as 0.05%") from exc
    if text.endswith("%"):
        value *= frame_diagonal(sequence) / 100
    if not 0 < value < math.inf:
        raise SettingError(f"max error is {bound!r}, which is no length above 0 here; give one in model units")
    return value


def find_quality(attempt: Attempt, target: Target, start: float, tolerance: float = TOLERANCE) -> tuple[Trial, list[Trial]]:
    """Search the quality that meets the target within the tolerance, from ``start`` on; return it and all trials, in order.

    If the target is met even by quality 0 (by quality 100, for sizes), that is the result. If no quality within the
    encodes allowed comes close enough, the closest on the allowed side is.

    Raises:
        InputError: no quality meets the target; the message tells the best.
    """
    goal = _Goal(target, tolerance)
    slope = goal.slope(start)
    tried: list[Trial] = []
    low: tuple[float, float] | None = None  # quality and value below the root
    high: tuple[float, float] | None = None
    aimed: tuple[float, float] | None = None  # the first trial, if it misses by little
    quality, was_low, n_near = start, False, 0
    for _ in range(MOST_ENCODES):
        trial = attempt(quality)
        tried.append(trial)
        value = goal.value(trial)
        if goal.is_close(value) or (value < 0 and quality >= 100) or (value > 0 and quality <= 0):
            break
        if len(tried) == 1 and target.measure != "bpvf" and abs(value) < AIMED:
            aimed = (quality, value)
            quality = _within(quality - value / 2 / slope)
            continue
        if value < 0:
            if low and high and was_low:
                high = (high[0], high[1] / 2)
            slope = _slope(low, (quality, value), slope)
            low = (quality, value)
        else:
            if low and high and not was_low:
                low = (low[0], low[1] / 2)
            slope = _slope((quality, value), high, slope)
            high = (quality, value)
        was_low = value < 0
        is_near = abs(value) < NEAR * max(slope, goal.slope(quality) / 4)  # scatter makes slopes flat
        n_near += is_near
        if n_near > MOST_NEAR:
            _look_around(attempt, goal, tried, 1 if aimed else 0)
            break
        if low and high:
            part = min(max(low[1] / (low[1] - high[1]), 0.02), 0.98)
            quality = low[0] + part * (high[0] - low[0])
        elif len(tried) > 2 and abs(value) > AIMED:
            quality = 100.0 if low else 0.0
        elif aimed and len(tried) == 2:
            quality = _within(quality - value / _slope(aimed, (quality, value), slope, BELIEVED))
        else:
            quality = _within(quality - value / slope)
    allowed = [trial for trial in tried if target.is_met(trial)]
    if not allowed:
        best = min(tried, key=target.of)
        raise InputError(
            f"no quality of codec {best.codec.id} gives {NAMES[target.measure]} {target.value:g}; the best is "
            f"{target.of(best):.4g} at quality {best.codec.quality:g}; allow more, or choose another codec or finer settings"
        )
    return max(allowed, key=target.of), tried


@dataclass(frozen=True)
class _Goal:
    """A target as the root of a rising function of quality."""

    target: Target
    tolerance: float

    def slope(self, quality: float) -> float:
        """Assumed, per unit of quality."""
        if self.target.measure == "bpvf":
            return RATE_SLOPE
        return BELOW if quality < MIDDLE else ABOVE

    def value(self, trial: Trial) -> float:
        """Logarithm of what the trial came to over the middle of what is close enough; below 0 where quality is too low."""
        aim = self.target.value * math.sqrt(1 - self.tolerance)
        value = math.log(max(self.target.of(trial), 1e-300) / aim)
        return value if self.target.measure == "bpvf" else -value

    def is_close(self, value: float) -> bool:
        """Whether the trial lies within the tolerance."""
        return abs(value) <= -math.log(1 - self.tolerance) / 2


def _look_around(attempt: Attempt, goal: _Goal, tried: list[Trial], first: int) -> None:
    """Go on, where the trials near the root, from ``first`` on, have it on the mean, until one is close enough.

    The trials go to ``tried``.

    Errors that scatter are as if drawn anew at every quality, so that the best guess is any untried one next to the root. Where
    a codec gives the same file as before, its qualities are coarser, and steps grow: bytes alone are often the same by chance.
    """
    known = [(trial.codec.quality, goal.value(trial)) for trial in tried[first:]]
    slope = _slope(min(known), max(known), goal.slope(known[-1][0]))
    spacing = SPACING
    while len(tried) < MOST_SCATTERED:
        reach = max(NEAR * slope, min(abs(value) for _, value in known))
        roots = [quality - value / slope for quality, value in known if abs(value) <= reach]
        root = sum(roots) / len(roots)
        around = (_within(root + side * i * spacing) for i in range(MOST_SCATTERED) for side in (1, -1))
        free = (quality for quality in around if min(abs(quality - other) for other, _ in known) >= spacing)
        quality = next(free, None)
        if quality is None:
            break
        trial = attempt(quality)
        if any((trial.bytes, trial.errors) == (other.bytes, other.errors) for other in tried):
            spacing *= 2
        tried.append(trial)
        known.append((quality, goal.value(trial)))
        if goal.is_close(known[-1][1]):
            break


def find_smallest(attempt: Attempt, bound: float, start: float, tolerance: float = WORTH) -> tuple[Trial, list[Trial]]:
    """Search the quality whose file, corrections to ``bound`` included, is smallest; return it and all trials, in order."""
    trials: dict[float, Trial] = {}

    def size(quality: float) -> float:
        if quality not in trials:
            trials[quality] = attempt(quality)
        return math.log(trials[quality].bytes)

    size(start)
    rmse = trials[start].errors.rmse
    if rmse > 0:  # towards where rmse is a usual part of the bound
        size(_within(start + _clip(math.log(BOUND_RATIO * rmse / bound) / BELOW, 30.0)))
    step = FIRST_STEP
    while len(trials) < MOST_ENCODES:
        known = sorted(trials)
        best = min(known, key=size)
        at = known.index(best)
        if 0 < at < len(known) - 1:
            wanted, gain = _vertex(*((q, size(q)) for q in known[at - 1 : at + 2]))
            if gain < tolerance:
                break
        else:
            outwards = -1.0 if at < len(known) - 1 else 1.0
            wanted = _within(best + outwards * step)
            if abs(wanted - best) < LEAST_STEP and len(known) > 1:  # at an end of the scale
                wanted = best - outwards * min(step, abs(known[1 if at == 0 else -2] - best) / 2)
        if min(abs(wanted - q) for q in known) < LEAST_STEP:
            break
        size(wanted)
        step *= 1.5
    tried = list(trials.values())
    return min(tried, key=lambda trial: trial.bytes), tried


def _start(target: Target, codec: Codec, sequence: MeshSequence, tolerance: float) -> float:
    """The first quality to try: of the KG error in the middle of what is close enough, or the codec's own."""
    if target.measure not in ("rmse", "kg"):
        return codec.quality
    error = target.value * math.sqrt(1 - tolerance)
    if target.measure == "rmse":
        error *= 100 * frame_diagonal(sequence) / measure_spread(sequence)
    return quality_of(error) if error > 0 else codec.quality


def _slope(
    low: tuple[float, float] | None,
    high: tuple[float, float] | None,
    assumed: float,
    believed: tuple[float, float] = (0.25, 4.0),
) -> float:
    """Slope through two points, if both are there, as near to the assumed one as is believed."""
    if low is None or high is None or low[0] == high[0]:
        return assumed
    return min(max((high[1] - low[1]) / (high[0] - low[0]), assumed * believed[0]), assumed * believed[1])


def _vertex(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> tuple[float, float]:
    """Where the parabola through three points is lowest, kept off the outer two, and how far below the middle one that is."""
    left, right = (b[1] - a[1]) / (b[0] - a[0]), (c[1] - b[1]) / (c[0] - b[0])
    curvature = (right - left) / (c[0] - a[0])
    if not curvature > 0:
        return b[0], 0.0
    x = (a[0] + b[0]) / 2 - left / (2 * curvature)
    x = min(max(x, (a[0] + b[0]) / 2), (b[0] + c[0]) / 2)
    y = b[1] + (left + curvature * (x - a[0])) * (x - b[0])
    return x, b[1] - y


def _within(quality: float) -> float:
    return min(max(quality, 0.0), 100.0)


def _clip(value: float, most: float) -> float:
    return min(max(value, -most), most)
