"""What a benchmark measured, as one JSON object; plots and tables need nothing else::

    {"gvpipe": version, "machine": {...}, "command": [...], "curves": [{"sequence", "vertices", "triangles", "frames",
     "codec", "settings", "peak_mb", "points": [{"quality", "bytes", "bpvf", measures of `gvpipe.metrics.comparison`,
     "encode_s", "decode_s", "decode_fps", "frame_ms", "sections"}]}]}

Units: ``bpvf`` bits per vertex and frame of the whole file, ``_s`` seconds, ``frame_ms`` milliseconds of a frame at random.
"""

from __future__ import annotations

import dataclasses
import os
from dataclasses import dataclass
from typing import Any

from gvpipe.benchmark.json_results import NUMBER, checked, read_results, write_results

REPORT_TYPES = {"gvpipe": str, "machine": dict, "command": list, "curves": list}
CURVE_TYPES = {
    "sequence": str,
    "vertices": int,
    "triangles": NUMBER,
    "frames": int,
    "codec": str,
    "settings": dict,
    "peak_mb": NUMBER,
    "points": list,
}
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
        write_results(path, self.to_json())

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> BenchReport:
        """Mirror of `write`; raises `InputError` for anything that it does not write."""
        return read_results(path, cls.parse)

    @classmethod
    def parse(cls, given: Any) -> BenchReport:
        """Mirror of `to_json`; raises `WrongValue`."""
        values = checked(given, REPORT_TYPES, "the file")
        curves = []
        for i, one in enumerate(values["curves"]):
            curve = checked(one, CURVE_TYPES, f"curve {i}")
            for k, point in enumerate(curve["points"]):
                checked(point, dict.fromkeys(POINT_KEYS, NUMBER), f"point {k} of curve {i}")
            curves.append(Curve(**{key: curve[key] for key in CURVE_TYPES}))
        return cls(values["gvpipe"], values["machine"], values["command"], curves)
