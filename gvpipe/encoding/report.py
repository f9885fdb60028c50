"""What an encode did, and how long each of its stages took."""

from __future__ import annotations

import dataclasses
import time
from dataclasses import dataclass, field
from typing import Any

from gvpipe.foundation.progress import Progress


@dataclass(frozen=True)
class Report:
    """What an encode did.

    Args:
        bpvf: bits per vertex and frame of the whole file.
        seconds: the whole as ``encode``, then each stage.
        not_carried: names of attributes and fields of the sequence that the file does not hold, and what the source has beside.
        sections: as in `Info`.
        tried: where a target was given, or codec ``auto``: every encode that was measured (`gvpipe.rate_control.trials.Trial`).
        reason: why the encode in the file was chosen among those.
        notes: what a user should know, a line each.
        errors: ``rmse``, ``rmse_diag``, ``max``, ``max_diag`` and ``kg`` of the file, as in `Comparison`, where a target was
            given or codecs competed; else empty.
        shots: of a capture: ``start``, ``frames``, ``vertices``, ``triangles``, ``codec`` and ``bytes`` of each. Then
            ``vertices`` and ``triangles`` are those of the largest, ``codec`` and ``settings`` those of the first.
        audio: as in `Info`.
    """

    codec: str
    settings: dict[str, Any]
    vertices: int
    triangles: int
    frames: int
    fps: float
    bytes: int
    bpvf: float
    seconds: dict[str, float]
    not_carried: list[str]
    sections: dict[str, int]
    tried: list[dict[str, Any]]
    reason: str
    notes: list[str]
    errors: dict[str, float | None] = field(default_factory=dict)
    shots: list[dict[str, Any]] = field(default_factory=list)
    audio: dict[str, Any] | None = None

    def to_json(self) -> dict[str, Any]:
        """The report as JSON values."""
        return dataclasses.asdict(self)


@dataclass
class StageClock:
    """Passes progress on and adds up the seconds of each stage, from ``started`` on."""

    progress: Progress | None
    started: float = field(default_factory=time.perf_counter)
    seconds: dict[str, float] = field(default_factory=dict)
    _stage: str = ""
    _since: float = 0.0

    def __call__(self, stage: str, done: float) -> None:
        now = time.perf_counter()
        if self._stage:
            self.seconds[self._stage] = self.seconds.get(self._stage, 0.0) + now - self._since
        self._stage, self._since = stage, now
        if self.progress and stage:
            self.progress(stage, done)
