"""What a search is for: an error, a size or a bound that the file must keep."""

from __future__ import annotations

import math
from dataclasses import dataclass

from gvpipe.foundation.errors import InputError, SettingError
from gvpipe.metrics.vertex_errors import frame_diagonal
from gvpipe.model.sequence import MeshSequence
from gvpipe.rate_control.trials import Trial

NAMES = {
    "rmse": "an rmse (of the diagonal) of",
    "kg": "a KG error (percent) of",
    "bpvf": "a rate (bits per vertex and frame) of",
    "max": "a largest error of",
}


@dataclass(frozen=True)
class Target:
    """A number that the file must not exceed, and should come close to.

    Args:
        measure: ``rmse`` (parts of frame 0's diagonal) or ``kg`` (percent) of the decoded frames; ``bpvf`` of the file;
            ``max``, a bound that every vertex of every frame keeps, model units.
        value: above 0.
        largest: what every vertex of every frame keeps besides, model units; None: nothing.

    Raises:
        SettingError: a value that is not a positive number.
    """

    measure: str
    value: float
    largest: float | None = None

    def __post_init__(self) -> None:
        if self.measure not in NAMES:
            raise SettingError(f"target {self.measure!r}; one of {', '.join(NAMES)} is needed")
        if isinstance(self.value, bool) or not isinstance(self.value, int | float) or not 0 < self.value < math.inf:
            raise SettingError(f"target {self.measure} is {self.value!r}; a number above 0 is needed")

    def of(self, trial: Trial) -> float:
        """Return the trial's own value of the measure; raises `InputError` if the sequence has none."""
        errors = trial.errors
        found = {"rmse": errors.rmse_diag, "kg": errors.kg, "bpvf": trial.bpvf, "max": errors.max}[self.measure]
        if found is None:
            raise InputError(f"this sequence has no size to measure its {self.measure} by; give another target or a quality")
        return found

    def is_met(self, trial: Trial) -> bool:
        """Return whether the trial is on the allowed side."""
        return self.of(trial) <= self.value


def parse_bound(bound: float | str, sequence: MeshSequence) -> float:
    """Return a largest error in model units, from such a number or a text: ``"0.01"``, or ``"0.05%"`` of frame 0's diagonal.

    Raises:
        SettingError: no positive number, or a part of a diagonal that is 0.
    """
    value, is_part = read_bound(bound)
    if is_part:
        value *= frame_diagonal(sequence) / 100
    if not 0 < value < math.inf:
        raise SettingError(f"max error is {bound!r}, which is no length above 0 here; give one in model units")
    return value


def read_bound(bound: float | str) -> tuple[float, bool]:
    """The number of a largest error, and whether it is percents of a diagonal; raises `SettingError` for none above 0."""
    text = str(bound).strip()
    try:
        value = float(text.removesuffix("%"))
    except ValueError as exc:
        raise SettingError(f"max error is {bound!r}; a length such as 0.01, or a part of the diagonal such as 0.05%") from exc
    if not 0 < value < math.inf:
        raise SettingError(f"max error is {bound!r}; a number above 0 is needed")
    return value, text.endswith("%")
