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
from gvpipe.rate_control.quality_search import TOLERANCE, find_quality
from gvpipe.rate_control.smallest_search import LEAST_GAIN, find_smallest
from gvpipe.rate_control.targets import NAMES, Target
from gvpipe.rate_control.trials import Trial, Trials

if TYPE_CHECKING:
    from gvpipe.asset_coding.encoder import AssetCoder

ROUGH_TOLERANCE, ROUGH_GAIN = 0.3, 0.03


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
    is_rough: bool = False,
    asset: AssetCoder | None = None,
    is_bare: bool = False,
) -> Choice:
    """Encode at the quality that meets a target, within 3 % or, for estimates, roughly.

    The search starts at the quality of that rmse or KG error, for other targets at the codec's own. What ``asset`` codes beside
    the positions counts as bytes of the file, and ``is_bare`` says whether that is of the bare layout.

    Raises:
        InputError: no quality meets it.
    """
    if target.measure == "max":
        trials = Trials(codec, sequence, target.value, progress, asset, is_bare)
        trial, tried = find_smallest(trials, target.value, codec.quality, ROUGH_GAIN if is_rough else LEAST_GAIN)
        reason = (
            f"quality {trial.codec.quality:.4g} is the smallest of {len(tried)}, {trial.corrections} bytes of it corrections"
        )
        return Choice(trial, trials, tried, reason)
    trials = Trials(codec, sequence, target.largest, progress, asset, is_bare)
    tolerance = ROUGH_TOLERANCE if is_rough else TOLERANCE
    trial, tried = find_quality(trials, target, _start(target, codec, sequence, tolerance), tolerance)
    found = target.of(trial)
    reason = f"quality {trial.codec.quality:.4g} gives {NAMES[target.measure]} {found:.4g} where {target.value:g} is allowed"
    if found < (1 - TOLERANCE) * target.value:
        reason += "; no quality comes closer" if trial.codec.quality in (0, 100) else f"; the closest of {len(tried)}"
    return Choice(trial, trials, tried, reason)


def _start(target: Target, codec: Codec, sequence: MeshSequence, tolerance: float) -> float:
    """The first quality to try: of the KG error in the middle of what is close enough, or the codec's own."""
    if target.measure not in ("rmse", "kg"):
        return codec.quality
    error = target.value * math.sqrt(1 - tolerance)
    if target.measure == "rmse":
        error *= 100 * frame_diagonal(sequence) / measure_spread(sequence)
    return quality_of(error) if error > 0 else codec.quality
