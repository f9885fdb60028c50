"""The codec, with its settings, that meets a target with the smallest file.

1. The cheapest candidate (`Codec.effort`) meets the target. It is what the others are compared with.
2. The others are estimated at its quality, as if at its error (`size_estimates`).
3. They meet the target, the smallest estimate first, as long as one may be the smallest: its estimate is at most `CLOSE` times
   the smallest file so far, or `CLOSE_BOUND` times where corrections keep a bound. Estimates of one codec with several
   settings err alike. So where that codec has a file, they are mended by it, and `ALIKE` takes the place of `CLOSE`.
4. The smallest file is kept; for a target in bits, the one with the smallest error.

A candidate whose first encode is too large to become the smallest gives up.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from gvpipe.coding.codec import Codec
from gvpipe.coding.quality_scale import error_of
from gvpipe.foundation.errors import InputError
from gvpipe.foundation.progress import Progress
from gvpipe.model.sequence import MeshSequence
from gvpipe.rate_control.purposes import describe, own_settings
from gvpipe.rate_control.search import Choice, TooLarge, meet
from gvpipe.rate_control.size_estimates import SizeEstimates
from gvpipe.rate_control.targets import Target
from gvpipe.rate_control.trials import Trial

if TYPE_CHECKING:
    from gvpipe.asset_coding.encoder import AssetCoder

CLOSE = 1.1  # times the smallest file: larger estimates are not encoded. Estimates of mcgv were 0.85 to 1.06 times its files
CLOSE_BOUND = 1.2  # the same with a bound: errors of some codecs have longer tails, which take more corrections
ALIKE = 1.03  # the same of two settings of one codec
FEW = 2  # candidates that need no estimate


def default_target(codecs: Sequence[Codec]) -> Target:
    """Return the target where none is given: the KG error of the candidates' highest quality."""
    return Target("kg", error_of(max(codec.quality for codec in codecs)))


def choose_codec(
    codecs: Sequence[Codec],
    sequence: MeshSequence,
    target: Target,
    progress: Progress | None = None,
    asset: AssetCoder | None = None,
    is_bare: bool = False,
) -> Choice:
    """Encode with the most promising candidates, and choose one of the encodes.

    Args:
        codecs: the candidates.
        sequence: to encode.
        target: for each of them.
        progress: called with the stages of every encode.
        asset: what is coded beside the positions, the same for all candidates; estimates leave it out.
        is_bare: whether the file will be of the bare layout.

    Returns:
        The choice; its ``tried`` has the encodes of the whole sequence, of all that were not given up.

    Raises:
        InputError: no codec meets the target; the message says why.
    """
    task = _Task(sequence, target, progress, asset, is_bare)
    finalists: list[Choice] = []
    failures: list[str] = []
    left = sorted(codecs, key=lambda codec: codec.effort)
    while left and not finalists:
        _try(task, left.pop(0), math.inf, finalists, failures)
    if not finalists:
        raise InputError(f"no codec meets the target: {'; '.join(dict.fromkeys(failures))}")
    reference = finalists[0].trial
    estimates = [(0.0, codec) for codec in left]
    if len(codecs) > FEW:
        estimates = _estimate_all(task, left, reference)
    for estimate, codec in sorted(estimates, key=lambda item: item[0]):
        expected, close = _mended(estimate, codec, estimates, finalists[1:]) or (estimate, task.close)
        most = close * min(choice.trial.own_bytes for choice in finalists)
        if expected <= most:
            _try(task, codec, most if estimate else math.inf, finalists, failures)
    return _best(task, finalists, failures, [(float(reference.own_bytes), reference.codec), *estimates])


@dataclass(frozen=True)
class _Task:
    """What all candidates are given; see `choose_codec`."""

    sequence: MeshSequence
    target: Target
    progress: Progress | None
    asset: AssetCoder | None
    is_bare: bool

    @property
    def close(self) -> float:
        """How many times the smallest file an estimate may be."""
        return CLOSE_BOUND if self.target.measure == "max" else CLOSE

    def cost(self, choice: Choice) -> float:
        """What to minimise: bytes; for a target in bits the KG error."""
        trial = choice.trial
        return (trial.errors.kg or 0.0) if self.target.measure == "bpvf" else float(trial.bytes)


def _try(task: _Task, codec: Codec, most: float, finalists: list[Choice], failures: list[str]) -> None:
    """Meet the target with a codec, and note it, unless positions take more than ``most`` bytes."""
    try:
        finalists.append(meet(task.target, codec, task.sequence, task.progress, most, asset=task.asset, is_bare=task.is_bare))
    except InputError as exc:
        failures.append(str(exc))
    except TooLarge:
        pass


def _estimate_all(task: _Task, codecs: Sequence[Codec], reference: Trial) -> list[tuple[float, Codec]]:
    """Each codec's estimate; ends early where it is clear that another one is smaller."""
    sizes = SizeEstimates(task.sequence, reference, task.progress, task.is_bare)
    estimates: list[tuple[float, Codec]] = []
    smallest = float(reference.own_bytes)
    for codec in codecs:
        estimates.append((sizes.of(codec, task.close * smallest), codec))
        smallest = min(smallest, estimates[-1][0])
    return estimates


def _mended(
    estimate: float, codec: Codec, estimates: Sequence[tuple[float, Codec]], finalists: Sequence[Choice]
) -> tuple[float, float] | None:
    """An estimate by what the codec's last file took beside its own one, and `ALIKE`; None without file or estimate."""
    for choice in reversed(finalists):
        own = choice.trial.codec
        if own.id == codec.id:
            before = next(
                value for value, other in estimates if other.id == own.id and own_settings(other) == own_settings(own)
            )
            return (estimate * choice.trial.own_bytes / before, ALIKE) if before else None
    return None


def _best(
    task: _Task, finalists: Sequence[Choice], failures: Sequence[str], estimates: Sequence[tuple[float, Codec]]
) -> Choice:
    """The best of the finalists, and why it is."""
    best = min(finalists, key=task.cost)
    others = ", ".join(_describe(choice.trial) for choice in finalists if choice is not best)
    beside = f"; beside it: {others or 'no other codec meets the target'}" if others or failures else ""
    costs = ", ".join(f"{describe(codec)} {cost:.4g}" for cost, codec in sorted(estimates, key=lambda item: item[0]))
    listed = f"; estimates (bytes): {costs}" if len(estimates) > FEW else ""
    reason = f"{_describe(best.trial)}; {best.reason}{beside}{listed}"
    return Choice(best.trial, best.trials, [trial for choice in finalists for trial in choice.tried], reason)


def _describe(trial: Trial) -> str:
    return f"{describe(trial.codec)} {trial.bytes} bytes"
