"""Files whose frames are their prediction alone: whether they are smaller, and which base frame suits them.

They take little time, so that more encodes than elsewhere are made.
"""

from __future__ import annotations

from gvcodecs.mcgv.base.base_lattice import base_step
from gvcodecs.mcgv.encoding.bitstream_sizes import cost, count_bytes, count_picture_bytes
from gvcodecs.mcgv.encoding.candidate import Anchor, rebase
from gvcodecs.mcgv.encoding.step_trials import StepTrials
from gvpipe.container.bitstream import Bitstream
from gvpipe.rate_control.step_search import SLOPE, StepTrial, find_step

MAX_ROUNDS = 5  # encodes in one search
BAND = 0.9, 0.99  # of the target error, as `target_search.BAND`
NARROW = 0.935, 0.955  # of the target error, where a quality is sought
SPARED = 0.02  # part of the bytes that pictures must take for an encode without them to be tried
FINER_THAN = 0.95  # part of the target error that a blend alone is to leave at the second attempt
COARSEST = 1.0, 1.3  # times the target error, lattice steps of base frames
LARGE_BASE = 0.25  # part of the bytes that a base frame must take for the second of them to be tried
REBASED = 1.2  # times the lattice step of a base frame, another one is tried
FINE_PART, FINE_COST = 1 / 4, 1.1  # of the target error, and times the bytes: files that get there take it
MAX_TRANSFORMS = 0.2  # part of the bytes that transforms may take for that to be tried: they grow by half and more
FINE_BAND = 0.8, 1.0  # part of that error which is close enough


def approach(trials: StepTrials, anchor: Anchor, step: float, wanted: float) -> StepTrial:
    """Come close to a target error from an anchor; it follows the step less: base frame and blend have errors of their own."""
    return find_step(trials, step, wanted, NARROW, anchor.slope, MAX_ROUNDS)


def omit_pictures(
    trials: StepTrials, step: float, wanted: float, band: tuple[float, float]
) -> tuple[StepTrials, StepTrial] | None:
    """Meet a target error, model units, without pictures; None where pictures pay, or the blend cannot reach it.

    Args:
        trials: of a blend with pictures.
        step: that leaves about this error, model units.
        wanted: the target error.
        band: least and most part of it that is close enough.
    """
    alone = trials.alone
    idle = trials.are_pictures_idle(step) and alone(step).error <= wanted
    if not idle and not _are_pictures_dear(trials, step, wanted):
        return None
    aimed = find_step(alone, step, wanted, band, SLOPE, MAX_ROUNDS)
    if aimed.error > wanted or (not idle and cost(aimed) >= cost(trials(step))):
        return None
    return _choose_base(alone, aimed, wanted, band)


def refine(trials: StepTrials, aimed: StepTrial, wanted: float) -> StepTrial:
    """A file without pictures, or the same blend with `FINE_PART` of the target error where that costs next to nothing.

    Parts that move rigidly are exact but for the rounding of base and transforms.
    """
    n_bytes = count_bytes(aimed.bitstream)
    if _count_transform_bytes(aimed.bitstream) > MAX_TRANSFORMS * n_bytes:
        return aimed
    wanted, most = FINE_PART * wanted, FINE_COST * n_bytes
    step = aimed.step * FINE_PART ** (1 / SLOPE)
    finer = StepTrials(trials.job, rebase(trials.job, trials.candidate, step, wanted))
    if count_bytes(finer(step).bitstream) > most:
        return aimed
    fine = find_step(finer, step, wanted, FINE_BAND, SLOPE, MAX_ROUNDS)
    return fine if fine.error <= wanted and count_bytes(fine.bitstream) <= most else aimed


def _are_pictures_dear(trials: StepTrials, step: float, wanted: float) -> bool:
    """Whether a blend alone costs less than with pictures, and leaves no error that a finer step cannot take away."""
    whole = trials(step)
    if count_picture_bytes(whole.bitstream) < SPARED * count_bytes(whole.bitstream):
        return False
    aimed = trials.alone(step)
    if cost(aimed) > cost(whole):
        return False
    if aimed.error > wanted:
        aimed = trials.alone(step * (FINER_THAN * wanted / aimed.error) ** (1 / SLOPE))
    return aimed.error <= wanted


def _choose_base(
    trials: StepTrials, aimed: StepTrial, wanted: float, band: tuple[float, float]
) -> tuple[StepTrials, StepTrial]:
    """The same blend and error on the base frame that makes the file smallest: coarser ones are tried."""
    job, n_bytes = trials.job, count_bytes(aimed.bitstream)
    for coarsest in COARSEST if len(aimed.bitstream.sections["mesh"]) > LARGE_BASE * n_bytes else COARSEST[:1]:
        lattice_step = min(base_step(aimed.step, job.sequence.n_frames), coarsest * wanted)
        if lattice_step < REBASED * trials.candidate.start.lattice.step:
            continue
        others = StepTrials(job, rebase(job, trials.candidate, aimed.step, coarsest * wanted))
        other = find_step(others, aimed.step, wanted, band, SLOPE, MAX_ROUNDS)
        if other.error <= wanted and count_bytes(other.bitstream) < count_bytes(aimed.bitstream):
            trials, aimed = others, other
    return trials, aimed


def _count_transform_bytes(bitstream: Bitstream) -> int:
    return sum(len(data) for name, data in bitstream.sections.items() if name.startswith("transforms"))
