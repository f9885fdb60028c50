"""The codec, with its settings, that meets a target with the smallest file.

1. Every candidate meets the target roughly on the sequence's first frames. Of a short and small sequence these are all of it:
   then the encodes are gone on with.
2. Its size for all frames is estimated: shared + per_frame * (error / target)^ELASTICITY * F / SAMPLE. Sections named
   ``NAME.N`` and the video are per frame, the others shared. For a target in bits, its error at that size is estimated.
3. The candidates with the smallest estimates encode all frames.
4. The smallest file is kept; for a target in bits, the one with the smallest error.

Estimates of one codec with several settings err alike where the first frames differ from the others. So two codecs encode a
longer sequence.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple, cast

from gvpipe.codec import Codec, Progress
from gvpipe.errors import InputError
from gvpipe.quality_scale import error_of
from gvpipe.rate_control.purposes import describe
from gvpipe.rate_control.search import Choice, meet
from gvpipe.rate_control.targets import Target
from gvpipe.rate_control.trials import Trial
from gvpipe.sequence import MeshSequence

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

    from gvpipe.asset_coding.encoder import AssetCoder

SAMPLE = 100  # frames of an estimate
ELASTICITY = 0.45  # bytes per frame are about proportional to the error to minus this power
CLOSE = 1.08  # times the best estimate: another candidate that may be the smallest
KEPT = 1 << 20  # vertices times frames, up to which the encodes of all candidates are kept
FEW = 2  # candidates that need no estimate
MOST = 3  # candidates that encode all frames, where there are estimates


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
        The choice; its ``tried`` has the encodes of the whole sequence, of all finalists.

    Raises:
        InputError: no codec meets the target; the message says why.
    """
    ranking, estimates, n_finalists = [_Estimate(0.0, codec, None) for codec in codecs], "", len(codecs)
    if len(codecs) > FEW:
        is_whole = sequence.n_frames <= SAMPLE and sequence.n_frames * sequence.n_vertices <= KEPT
        keeps = is_whole and (asset is None or asset.is_empty)
        costs = [_estimate(codec, sequence, target, progress, is_bare, keeps) for codec in codecs]
        costs.sort(key=lambda estimate: estimate.cost)
        chosen = _finalists(costs, sequence.n_frames > SAMPLE)
        ranking = [*chosen, *(estimate for estimate in costs if estimate not in chosen)]
        n_finalists = len(chosen)
        unit = "KG" if target.measure == "bpvf" else "bytes"
        listed = ", ".join(f"{describe(estimate.codec)} {estimate.cost:.4g}" for estimate in costs)
        estimates = f"; estimates ({unit}): {listed}"
    finalists: list[Choice] = []
    failures = []
    for estimate in ranking:
        if len(finalists) < n_finalists:
            try:
                before = estimate.choice
                finalists.append(meet(target, estimate.codec, sequence, progress, False, asset, is_bare, before))
            except InputError as exc:
                failures.append(str(exc))
    if not finalists:
        raise InputError(f"no codec meets the target: {'; '.join(dict.fromkeys(failures))}")
    best = min(finalists, key=lambda choice: _cost(choice.trial, target))
    others = ", ".join(_describe(choice.trial) for choice in finalists if choice is not best)
    beside = f"; beside it: {others or 'no other codec meets the target'}" if others or failures else ""
    reason = f"{_describe(best.trial)}; {best.reason}{beside}{estimates}"
    return Choice(best.trial, best.trials, [trial for choice in finalists for trial in choice.tried], reason)


class _Estimate(NamedTuple):
    """What meeting the target will cost (infinity: it is not met), the settings at the quality that met it, and the encodes."""

    cost: float
    codec: Codec
    choice: Choice | None


def _finalists(costs: list[_Estimate], is_part: bool) -> list[_Estimate]:
    """The candidates that encode all frames; ``costs`` are sorted, and estimated from some frames if ``is_part``."""
    close = [estimate for estimate in costs if estimate.cost <= CLOSE * costs[0].cost][:MOST]
    rival = next((estimate for estimate in costs if estimate.codec.id != close[0].codec.id), None)
    if is_part and rival and rival not in close:
        close = [*close[: MOST - 1], rival]
    return close


def _estimate(
    codec: Codec, sequence: MeshSequence, target: Target, progress: Progress | None, is_bare: bool, keeps: bool
) -> _Estimate:
    """Estimate what a codec costs; ``keeps`` its encodes, which are of all frames."""
    n_sample = min(SAMPLE, sequence.n_frames)
    try:
        choice = meet(target, codec, sequence.part(0, n_sample).bare(), progress, True, is_bare=is_bare)
    except InputError:
        return _Estimate(float("inf"), codec, None)
    trial, kept = choice.trial, choice if keeps else None
    quality = trial.codec.quality
    better = cast("Codec", dataclasses.replace(cast("DataclassInstance", codec), quality=quality))
    if target.measure == "bpvf":
        return _Estimate(_cost(trial, target) * (trial.bpvf / target.value) ** (1 / ELASTICITY), better, kept)
    shared = sum(len(data) for name, data in trial.bitstream.sections.items() if not name[-1].isdigit())
    off = 1.0 if target.measure == "max" else target.of(trial) / target.value
    return _Estimate(shared + (trial.bytes - shared) * off**ELASTICITY * sequence.n_frames / n_sample, better, kept)


def _cost(trial: Trial, target: Target) -> float:
    """What to minimise: bytes; for a target in bits the KG error."""
    return (trial.errors.kg or 0.0) if target.measure == "bpvf" else float(trial.bytes)


def _describe(trial: Trial) -> str:
    return f"{describe(trial.codec)} {trial.bytes} bytes"
