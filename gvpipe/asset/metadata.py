"""What a scene says of itself: its up axis, its unit, its start, its source, and free texts."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from gvpipe.asset.attribute import check_word
from gvpipe.foundation.arrays import Float64
from gvpipe.foundation.errors import InputError

UP_AXES = ("", "x", "y", "z")
NOT_CARRIED = "not carried"  # name of a text: what the source had beside what its file carries
SEPARATOR = "; "


@dataclass(frozen=True)
class Metadata:
    """What a scene says of itself.

    Args:
        up_axis: ``"x"``, ``"y"`` or ``"z"``; ``""``: unknown.
        metres_per_unit: length of a model unit; None: unknown.
        start_time: of frame 0, seconds.
        source: name of the program or file that it came from.
        texts: anything else, by name.
        times: of each frame, seconds, where they do not follow from the start and the rate, as those of a simulation may not; a
            sequence with another number of frames has none.
    """

    up_axis: str = ""
    metres_per_unit: float | None = None
    start_time: float = 0.0
    source: str = ""
    texts: Mapping[str, str] = field(default_factory=dict)
    times: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        check_word("up axis", self.up_axis, UP_AXES, "metadata")
        unit = self.metres_per_unit
        if unit is not None and not (math.isfinite(unit) and unit > 0):
            raise InputError(f"metadata: a unit of {unit} metres; a length above 0 is needed")
        if not math.isfinite(self.start_time):
            raise InputError(f"metadata: the start time is {self.start_time}; seconds are needed")
        if not all(isinstance(key, str) and isinstance(text, str) for key, text in self.texts.items()):
            raise InputError("metadata: texts are not all texts by name; make texts of them")
        object.__setattr__(self, "times", tuple(float(time) for time in self.times))
        if not np.isfinite(self.times).all():
            frame = int(np.flatnonzero(~np.isfinite(self.times))[0])
            raise InputError(f"metadata: the time of frame {frame} is {self.times[frame]}; seconds are needed")

    def frame_times(self, n_frames: int, fps: float) -> Float64:
        """``(F,)`` seconds of the frames: the times where there are so many, else by start and rate."""
        if len(self.times) == n_frames:
            return np.array(self.times)
        return np.asarray(self.start_time + np.arange(n_frames) / fps)

    def of_frames(self, start: int, stop: int, n_frames: int, fps: float) -> Metadata:
        """The metadata of frames ``start`` to ``stop`` of ``n_frames``: with their times."""
        if (start, stop) == (0, n_frames) or not 0 <= start < stop <= n_frames or self == NO_METADATA:
            return self
        if len(self.times) != n_frames:
            return replace(self, start_time=self.start_time + start / fps)
        return replace(self, start_time=self.times[start], times=self.times[start:stop])


NO_METADATA = Metadata()


def with_losses(metadata: Metadata, names: Sequence[str]) -> Metadata:
    """The metadata with a text of what a file does not carry of its source."""
    if not names:
        return metadata
    return replace(metadata, texts={**metadata.texts, NOT_CARRIED: SEPARATOR.join(names)})


def losses_of(metadata: Metadata) -> list[str]:
    """Mirror of `with_losses`."""
    text = metadata.texts.get(NOT_CARRIED, "")
    return text.split(SEPARATOR) if text else []
