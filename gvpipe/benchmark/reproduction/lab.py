"""Where claims are measured: a folder of sequences, and the curves that were measured so far, each point once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from gvpipe.benchmark import sweep
from gvpipe.benchmark.report import BenchReport, Curve
from gvpipe.coding.codec import Memo
from gvpipe.coding.registry import codec_ids
from gvpipe.foundation.errors import GvpipeError
from gvpipe.foundation.progress import Progress, silent
from gvpipe.model.sequence import MeshSequence
from gvpipe.playback import files

QUALITIES = (0.0, 20.0, 40.0, 60.0, 75.0, 90.0)
QUICK_QUALITIES = (20.0, 50.0, 75.0)


class Missing(GvpipeError):
    """What a claim needs and is not there: a sequence, or a codec."""


class Lab:
    """Measures curves when claims ask for them, and keeps them.

    Args:
        data: folder of sequences, ``NAME.npz``.
        qualities: of every curve.
        known: curves that were measured before.
        skipped: names of sequences that are left out, as large ones in a quick run.
        progress: called before each curve with its name.
        keep: called with all curves after each one that was measured.
    """

    def __init__(
        self,
        data: Path,
        qualities: Sequence[float] = QUALITIES,
        known: Sequence[Curve] = (),
        skipped: Sequence[str] = (),
        progress: Progress | None = None,
        keep: Callable[[BenchReport], None] | None = None,
    ) -> None:
        self.data, self.qualities, self.skipped = data, tuple(qualities), tuple(skipped)
        self._curves = {(curve.sequence, curve.codec): curve for curve in known}
        self._sequences: dict[str, MeshSequence] = {}
        self._progress, self._keep = progress or silent, keep
        self.memo = Memo()  # of what claims compute of sequences, beside curves

    @property
    def curves(self) -> list[Curve]:
        """All curves so far."""
        return list(self._curves.values())

    def sequence(self, name: str) -> MeshSequence:
        """Return a sequence of the folder; raises `Missing`."""
        if name not in self._sequences:
            self._sequences[name] = files.read(str(self._path(name)))
        return self._sequences[name]

    def points(self, name: str, codec: str) -> list[dict[str, Any]]:
        """Return the points of a codec (``ID:KEY=VALUE``) on a sequence; raises `Missing`."""
        return self._curve(name, codec, self.qualities).points

    def point(self, name: str, codec: str, quality: float) -> dict[str, Any]:
        """Return the point of one quality; raises `Missing`."""
        points = self._curve(name, codec, (quality,)).points
        return min(points, key=lambda point: abs(float(point["quality"]) - quality))

    def report(self) -> BenchReport:
        """What was measured, as `gvpipe bench` reports it."""
        return sweep.report_of(self.curves)

    def _curve(self, name: str, codec: str, qualities: Sequence[float]) -> Curve:
        path = self._path(name)
        if codec.split(":")[0] not in codec_ids():
            raise Missing(f"codec {codec.split(':')[0]} is not installed: pip install ./baselines")
        known = self._curves.get((name, codec))
        done = [] if known is None else known.points
        left = [quality for quality in qualities if not any(point["quality"] == quality for point in done)]
        if left:
            self._progress(f"{name} {codec}", 0)
            made = sweep.measure_curve(str(path), codec, left, {})
            points = sorted([*done, *made.points], key=lambda point: float(point["quality"]))
            self._curves[name, codec] = Curve(**{**vars(made), "points": points})
            if self._keep is not None:
                self._keep(self.report())
        return self._curves[name, codec]

    def _path(self, name: str) -> Path:
        path = self.data / f"{name}.npz"
        if name in self.skipped:
            raise Missing(f"{name} is left out of a quick run")
        if not path.is_file():
            raise Missing(f"sequence {name} is not at hand: there is no {name}.npz in the folder of sequences")
        return path
