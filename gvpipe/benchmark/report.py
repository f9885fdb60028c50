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

from gvpipe.atomic import unnamed_path
from gvpipe.errors import InputError

NUMBER = int | float | None
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
        with unnamed_path(path) as temporary:
            temporary.write_text(json.dumps(self.to_json(), indent=1, allow_nan=False) + "\n", "utf-8")

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> BenchReport:
        """Mirror of `write`; raises `InputError` for anything that it does not write."""
        try:
            return cls._parse(Path(path).read_text("utf-8"))
        except OSError as exc:
            raise InputError(f"{path} cannot be read: {exc.strerror or exc}; check the path") from exc
        except UnicodeDecodeError as exc:
            raise _no_report(path, "it is no text") from exc
        except json.JSONDecodeError as exc:
            raise _no_report(path, f"line {exc.lineno} is no JSON") from exc
        except _WrongValue as exc:
            raise _no_report(path, str(exc)) from exc

    @classmethod
    def _parse(cls, text: str) -> BenchReport:
        values = _checked(json.loads(text), REPORT_TYPES, "the file")
        curves = []
        for i, given in enumerate(values["curves"]):
            curve = _checked(given, CURVE_TYPES, f"curve {i}")
            for k, point in enumerate(curve["points"]):
                _checked(point, dict.fromkeys(POINT_KEYS, NUMBER), f"point {k} of curve {i}")
            curves.append(Curve(**{key: curve[key] for key in CURVE_TYPES}))
        return cls(values["gvpipe"], values["machine"], values["command"], curves)


class _WrongValue(ValueError):
    """What a file lacks or holds that a report does not."""


def _checked(values: Any, types: dict[str, Any], what: str) -> dict[str, Any]:
    """Return an object of the file, whose values under the keys of ``types`` have those types; raises `_WrongValue`."""
    if not isinstance(values, dict):
        raise _WrongValue(f"{what} is no object")
    for key, kind in types.items():
        if key not in values:
            raise _WrongValue(f"{what} has no {key}")
        if not isinstance(values[key], kind):
            raise _WrongValue(f"{what} has {key} of another type")
    return values


def _no_report(path: str | os.PathLike[str], why: str) -> InputError:
    return InputError(f"{path} is not what `gvpipe bench --json` writes: {why}; give that file, or measure again")
