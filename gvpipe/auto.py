"""The codec with the smallest file that meets a target.

Every codec first meets the target roughly on the sequence's first frames. The estimate for the whole: what all frames share
as it is, what belongs to frames (sections named ``NAME.N``, the video) times as many, and more or less as the error is off. The
best two by estimate then encode all frames, and the smaller file is kept; for a target in bits, the one with the smaller error.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import TYPE_CHECKING, cast

from gvpipe.codec import Codec, Progress
from gvpipe.errors import InputError
from gvpipe.rate import Choice, Target, meet
from gvpipe.sequence import MeshSequence
from gvpipe.trials import Trial

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

AUTO = "auto"
DEFAULT = Target("kg", 0.1)  # without another target: an error that is hard to see, at which codecs are usually compared
SAMPLE = 100  # frames of an estimate; a sequence of no more is encoded whole by every codec
ELASTICITY = 0.45  # bytes go with the error to about minus this power
FINALISTS = 2


def choose_codec(codecs: Sequence[Codec], sequence: MeshSequence, target: Target, progress: Progress | None = None) -> Choice:
    """Encode with the codecs that promise most, and choose; ``tried`` holds the encodes of the whole sequence.

    Raises:
        InputError: no codec meets the target; the message tells why.
    """
    ranking, estimates = codecs, ""
    if sequence.n_frames > SAMPLE and len(codecs) > FINALISTS:
        costs = sorted((_estimate(codec, sequence, target, progress) for codec in codecs), key=lambda item: item[0])
        ranking = [codec for _, codec in costs]
        unit = "KG" if target.measure == "bpvf" else "bytes"
        estimates = f"; estimates ({unit}): {', '.join(f'{codec.id} {cost:.4g}' for cost, codec in costs)}"
    n_finalists = FINALISTS if estimates else len(codecs)
    finalists: list[Choice] = []
    failures = []
    for codec in ranking:
        if len(finalists) < n_finalists:
            try:
                finalists.append(meet(target, codec, sequence, progress))
            except InputError as exc:
                failures.append(str(exc))
    if not finalists:
        raise InputError(f"no codec meets the target: {'; '.join(failures)}")
    best = min(finalists, key=lambda choice: _cost(choice.trial, target))
    others = ", ".join(_describe(choice.trial) for choice in finalists if choice is not best)
    reason = f"{_describe(best.trial)}; {best.reason}; beside it: {others or 'no other codec meets the target'}{estimates}"
    return Choice(best.trial, best.trials, [trial for choice in finalists for trial in choice.tried], reason)


def _estimate(codec: Codec, sequence: MeshSequence, target: Target, progress: Progress | None) -> tuple[float, Codec]:
    """What the codec would come to, infinity if it does not meet the target, and its settings with the quality that did."""
    try:
        trial = meet(target, codec, sequence.part(0, SAMPLE), progress, is_rough=True).trial
    except InputError:
        return float("inf"), codec
    quality = trial.codec.quality
    better = cast("Codec", dataclasses.replace(cast("DataclassInstance", codec), quality=quality))
    if target.measure == "bpvf":
        return _cost(trial, target) * (trial.bpvf / target.value) ** (1 / ELASTICITY), better
    shared = sum(len(data) for name, data in trial.bitstream.sections.items() if not name[-1].isdigit())
    whole = shared + (trial.bytes - shared) * sequence.n_frames / SAMPLE
    off = 1.0 if target.measure == "max" else target.of(trial) / target.value
    return whole * off**ELASTICITY, better


def _cost(trial: Trial, target: Target) -> float:
    """What is to be small: bytes, or the error that they buy."""
    return (trial.errors.kg or 0.0) if target.measure == "bpvf" else float(trial.bytes)


def _describe(trial: Trial) -> str:
    return f"{trial.codec.id} {trial.bytes} bytes"
