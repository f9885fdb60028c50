"""The codec, with its settings, that meets a target with the smallest file.

1. Every candidate meets the target roughly on the sequence's first frames.
2. Its size for all frames is estimated: shared + per_frame * (error / target)^ELASTICITY * F / SAMPLE. Sections named
   ``NAME.N`` and the video are per frame, the others shared. For a target in bits, its error at that size is estimated.
3. The candidates with the smallest estimates encode all frames.
4. The smallest file is kept; for a target in bits, the one with the smallest error. Estimates of short and small sequences are
   encodes of all frames, so the best of them counts, too.

Estimates of one codec with several settings err alike where the first frames differ from the others. So two codecs encode a
longer sequence.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, cast

from gvpipe.coding.codec import Codec
from gvpipe.coding.quality_scale import error_of
from gvpipe.foundation.elementary import power
from gvpipe.foundation.errors import InputError
from gvpipe.foundation.progress import Progress
from gvpipe.model.sequence import MeshSequence
from gvpipe.rate_control.purposes import describe
from gvpipe.rate_control.search import Choice, meet
from gvpipe.rate_control.targets import Target
from gvpipe.rate_control.trials import Trial

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

    from gvpipe.asset_coding.encoder import AssetCoder

SAMPLE = 100  # frames of an estimate
ELASTICITY = 0.45  # bytes per frame are about proportional to the error to minus this power
CLOSE = 1.08  # times the best estimate: another candidate that may be the smallest
KEPT = 1 << 20  # vertices times frames, up to which estimates are kept: what their searches know takes memory
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
    ranking, estimates, n_finalists = list(codecs), "", len(codecs)
    whole: list[Choice] = []  # estimates that are encodes of all there is
    if len(codecs) > FEW:
        is_small = sequence.n_frames <= SAMPLE and sequence.n_frames * sequence.n_vertices <= KEPT
        keep = whole.append if is_small and (asset is None or asset.is_empty) else None
        costs = [_estimate(codec, sequence, target, progress, is_bare, keep) for codec in codecs]
        costs.sort(key=lambda item: item[0])
        chosen = _finalists(costs, sequence.n_frames > SAMPLE)
        ranking = [*chosen, *(codec for _, codec in costs if codec not in chosen)]
        n_finalists = len(chosen)
        unit = "KG" if target.measure == "bpvf" else "bytes"
        estimates = f"; estimates ({unit}): {', '.join(f'{describe(codec)} {cost:.4g}' for cost, codec in costs)}"
    finalists: list[Choice] = []
    failures = []
    for codec in ranking:
        if len(finalists) < n_finalists:
            try:
                finalists.append(meet(target, codec, sequence, progress, asset=asset, is_bare=is_bare))
            except InputError as exc:
                failures.append(str(exc))
    finalists += sorted(whole, key=lambda choice: _cost(choice.trial, target))[:1]
    if not finalists:
        raise InputError(f"no codec meets the target: {'; '.join(dict.fromkeys(failures))}")
    best = min(finalists, key=lambda choice: _cost(choice.trial, target))
    others = ", ".join(_describe(choice.trial) for choice in finalists if choice is not best)
    beside = f"; beside it: {others or 'no other codec meets the target'}" if others or failures else ""
    reason = f"{_describe(best.trial)}; {best.reason}{beside}{estimates}"
    return Choice(best.trial, best.trials, [trial for choice in finalists for trial in choice.tried], reason)


def _finalists(costs: list[tuple[float, Codec]], is_part: bool) -> list[Codec]:
    """The candidates that encode all frames; ``costs`` are sorted, and estimated from some frames if ``is_part``."""
    close = [codec for cost, codec in costs if cost <= CLOSE * costs[0][0]][:MOST]
    rival = next((codec for _, codec in costs if codec.id != close[0].id), None)
    if is_part and rival and rival not in close:
        close = [*close[: MOST - 1], rival]
    return close


def _estimate(
    codec: Codec,
    sequence: MeshSequence,
    target: Target,
    progress: Progress | None,
    is_bare: bool,
    keep: Callable[[Choice], None] | None,
) -> tuple[float, Codec]:
    """The estimated cost (infinity: it does not meet the target), and the settings at the quality that met it.

    ``keep`` is called with an estimate that meets the target.
    """
    n_sample = min(SAMPLE, sequence.n_frames)
    try:
        choice = meet(target, codec, sequence.part(0, n_sample).bare(), progress, is_rough=True, is_bare=is_bare)
    except InputError:
        return float("inf"), codec
    if keep:
        keep(choice)
    trial, quality = choice.trial, choice.trial.codec.quality
    better = cast("Codec", dataclasses.replace(cast("DataclassInstance", codec), quality=quality))
    if target.measure == "bpvf":
        return _cost(trial, target) * power(trial.bpvf / target.value, 1 / ELASTICITY), better
    shared = sum(len(data) for name, data in trial.bitstream.sections.items() if not name[-1].isdigit())
    off = 1.0 if target.measure == "max" else target.of(trial) / target.value
    return shared + (trial.bytes - shared) * off**ELASTICITY * sequence.n_frames / n_sample, better


def _cost(trial: Trial, target: Target) -> float:
    """What to minimise: bytes; for a target in bits the KG error."""
    return (trial.errors.kg or 0.0) if target.measure == "bpvf" else float(trial.bytes)


def _describe(trial: Trial) -> str:
    return f"{describe(trial.codec)} {trial.bytes} bytes"
