"""The encode that meets a target: by an error or a size (`quality_search`), or with the smallest file (`smallest_search`)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from gvpipe.coding.codec import Codec
from gvpipe.coding.quality_scale import quality_of
from gvpipe.foundation.progress import Progress
from gvpipe.metrics.vertex_errors import frame_diagonal, measure_spread
from gvpipe.model.sequence import MeshSequence
from gvpipe.rate_control.quality_search import CHEAP, DEAR, SMALL, TOLERANCE, find_quality
from gvpipe.rate_control.size_estimates import at_error
from gvpipe.rate_control.smallest_search import find_smallest
from gvpipe.rate_control.targets import NAMES, Target
from gvpipe.rate_control.trials import Trial, Trials

if TYPE_CHECKING:
    from gvpipe.asset_coding.encoder import AssetCoder

SMALL_SEQUENCE = 250_000  # positions, times the codec's effort: an encode takes little


class TooLarge(Exception):
    """An encode would take more bytes than are of use; for `gvpipe.rate_control.codec_choice` alone."""


@dataclass(frozen=True)
class Choice:
    """The encode that was chosen.

    Args:
        trial: that encode.
        trials: check its file (`Trials.check`).
        tried: all encodes, in order.
        reason: why this one, for people.
    """

    trial: Trial
    trials: Trials
    tried: list[Trial]
    reason: str


def meet(
    target: Target,
    codec: Codec,
    sequence: MeshSequence,
    progress: Progress | None = None,
    most: float = math.inf,
    asset: AssetCoder | None = None,
    is_bare: bool = False,
) -> Choice:
    """Encode at the quality that meets a target: within 1 % where further encodes are cheap, else within 3 %.

    The search starts at the quality of that rmse or KG error, for other targets at the codec's own. What ``asset`` codes beside
    the positions counts as bytes of the file, and ``is_bare`` says whether that is of the bare layout.

    Raises:
        InputError: no quality meets it.
        TooLarge: the first encode shows that positions take more than ``most`` bytes at a target error.
    """
    if target.measure == "max":
        trials = Trials(codec, sequence, target.value, progress, asset, is_bare)
        trial, tried = find_smallest(trials, target.value, codec.quality)
        reason = (
            f"quality {trial.codec.quality:.4g} is the smallest of {len(tried)}, {trial.corrections} bytes of it corrections"
        )
        return Choice(trial, trials, tried, reason)
    trials = Trials(codec, sequence, target.largest, progress, asset, is_bare)
    attempt = trials if target.measure == "bpvf" else _GivingUp(trials, target, most)
    is_small = codec.effort * sequence.n_frames * sequence.n_vertices <= SMALL_SEQUENCE
    closeness = CHEAP if codec.is_cheap_again else SMALL if is_small else DEAR
    trial, tried = find_quality(attempt, target, _start(target, codec, sequence), closeness)
    found = target.of(trial)
    reason = f"quality {trial.codec.quality:.4g} gives {NAMES[target.measure]} {found:.4g} where {target.value:g} is allowed"
    if found < (1 - TOLERANCE) * target.value:
        reason += "; no quality comes closer" if trial.codec.quality in (0, 100) else f"; the closest of {len(tried)}"
    return Choice(trial, trials, tried, reason)


class _GivingUp:
    """Trials that end by `TooLarge` where the first, as if it left the target error, takes more than ``most`` bytes."""

    def __init__(self, trials: Trials, target: Target, most: float) -> None:
        self._trials, self._target, self._most = trials, target, most

    def __call__(self, quality: float) -> Trial:
        trial = self._trials(quality)
        if at_error(trial.own_bytes, self._target.of(trial), self._target.value) > self._most:
            raise TooLarge
        self._most = math.inf
        return trial


def _start(target: Target, codec: Codec, sequence: MeshSequence) -> float:
    """The first quality to try: of the KG error in the middle of `TOLERANCE`, or the codec's own."""
    if target.measure not in ("rmse", "kg"):
        return codec.quality
    error = target.value * math.sqrt(1 - TOLERANCE)
    if target.measure == "rmse":
        error *= 100 * frame_diagonal(sequence) / measure_spread(sequence)
    return quality_of(error) if error > 0 else codec.quality
