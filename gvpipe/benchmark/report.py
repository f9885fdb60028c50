"""What a benchmark measured, as one JSON object; plots and tables need nothing else::

    {"gvpipe": version, "machine": {...}, "command": [...], "curves": [{"sequence", "vertices", "triangles", "frames",
     "codec", "settings", "peak_mb", "points": [{"quality", "bytes", "bpvf", measures of `gvpipe.metrics.comparison`,
     "encode_s", "decode_s", "decode_fps", "frame_ms", "sections"}]}]}

Units: ``bpvf`` bits per vertex and frame of the whole file, ``_s`` seconds, ``frame_ms`` milliseconds of a frame at random.
"""

from __future__ import annotations

import dataclasses
import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gvpipe.atomic import atomic_path
from gvpipe.errors import InputError

POINT_KEYS = ("quality", "bytes", "bpvf", "rmse_diag", "max_diag", "kg", "sted", "encode_s", "decode_fps")  # that tables use


@dataclass(frozen=True)
class Curve:
    """One codec's points on one sequence, in order of quality.

    Args:
        codec: its id, or ``id:key=value`` where settings tell it apart.
        settings: all of the codec's, without the quality.
        peak_mb: largest resident memory of encoding and decoding, 2**20 bytes; None where the system does not report it.
        points: one per quality, as in this module's docstring.
    """

    sequence: str
    vertices: int
    triangles: int
    frames: int
    codec: str
    settings: dict[str, Any]
    peak_mb: float | None
    points: list[dict[str, Any]]


@dataclass(frozen=True)
class BenchReport:
    """All curves, and what they were made with: version, machine, command line."""

    gvpipe: str
    machine: dict[str, Any]
    command: list[str]
    curves: list[Curve]

    def to_json(self) -> dict[str, Any]:
        """The report as JSON values."""
        return dataclasses.asdict(self)

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write the JSON file; raises `OutputError` if that fails."""
        with atomic_path(path) as temporary:
            temporary.write_text(json.dumps(self.to_json(), indent=1, allow_nan=False) + "\n", "utf-8")

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> BenchReport:
        """Mirror of `write`; raises `InputError` for anything that it does not write."""
        try:
            values = json.loads(Path(path).read_text("utf-8"))
            curves = [Curve(**curve) for curve in values["curves"]]
            for curve in curves:
                for point in curve.points:
                    if any(not isinstance(point[key], int | float | None) for key in POINT_KEYS):
                        raise ValueError(f"a point of {curve.sequence} is not made of numbers")
            return cls(str(values["gvpipe"]), dict(values["machine"]), list(values["command"]), curves)
        except OSError as exc:
            raise InputError(f"{path} cannot be read: {exc.strerror or exc}; check the path") from exc
        except (ValueError, TypeError, KeyError) as exc:
            raise InputError(f"{path} is not what `gvpipe bench --json` writes ({exc}); make it anew") from exc
