"""How costs grow with vertices and frames, as one JSON object; plots and tables need nothing else::

    {"gvpipe": version, "machine": {...}, "command": [...], "scale": [{"codec", "vertices", "frames", "bytes",
     "segment_frames", "encode_s", "encode_cpu_s", "encode_peak_mb", "decode_s", "decode_cpu_s", "decode_peak_mb"}]}

A number that is not known is null: what took longer than the limit, or what the system does not tell.
"""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from gvpipe.benchmark.json_results import NUMBER, WrongValue, checked, read_results, write_results

REPORT_TYPES = {"gvpipe": str, "machine": dict, "command": list, "scale": list}
BYTES_PER_POSITION = 12  # three float32


@dataclass(frozen=True)
class ScalePoint:
    """One codec on one size.

    Args:
        codec: its id, or ``id:key=value`` where settings tell it apart.
        bytes: of the file.
        segment_frames: of its longest segment.
        encode_s, decode_s: seconds of the whole command, from one .npz and to another.
        encode_cpu_s, decode_cpu_s: processor time.
        encode_peak_mb, decode_peak_mb: largest resident memory, 2**20 bytes.
    """

    codec: str
    vertices: int
    frames: int
    bytes: int | None = None
    segment_frames: int | None = None
    encode_s: float | None = None
    encode_cpu_s: float | None = None
    encode_peak_mb: float | None = None
    decode_s: float | None = None
    decode_cpu_s: float | None = None
    decode_peak_mb: float | None = None

    @property
    def segment_mb(self) -> float:
        """The longest segment's positions as float32, 2**20 bytes."""
        return BYTES_PER_POSITION * self.vertices * (self.segment_frames or self.frames) / (1 << 20)


POINT_TYPES = {field.name: NUMBER for field in dataclasses.fields(ScalePoint)} | {
    "codec": str,
    "vertices": int,
    "frames": int,
}


@dataclass(frozen=True)
class ScaleReport:
    """All points, and what they were made with: version, machine, command line."""

    gvpipe: str
    machine: dict[str, Any]
    command: list[str]
    scale: list[ScalePoint]

    def to_json(self) -> dict[str, Any]:
        """The report as JSON values."""
        return dataclasses.asdict(self)

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write the JSON file; raises `OutputError` if that fails."""
        write_results(path, self.to_json())

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> ScaleReport:
        """Mirror of `write`; raises `InputError` for anything that it does not write."""
        return read_results(path, cls.parse)

    @classmethod
    def parse(cls, given: Any) -> ScaleReport:
        """Mirror of `to_json`; raises `WrongValue`."""
        values = checked(given, REPORT_TYPES, "the file")
        points = [checked(point, POINT_TYPES, f"point {i}") for i, point in enumerate(values["scale"])]
        if any(min(point["vertices"], point["frames"]) < 1 for point in points):
            raise WrongValue("a point has no vertex or no frame")
        scale = [ScalePoint(**{key: point[key] for key in POINT_TYPES}) for point in points]
        return cls(values["gvpipe"], values["machine"], values["command"], scale)


def table(points: Sequence[ScalePoint]) -> str:
    """A table in Markdown: a row for each point."""
    names = ("codec", "vertices", "frames", "file, kB", "encode, s", "CPU, s", "peak, MB", "decode, s", "CPU, s", "peak, MB")
    lines = [f"| {' | '.join(names)} |", "|---" * len(names) + "|"]
    for p in points:
        size = None if p.bytes is None else p.bytes / 1000
        numbers = (size, p.encode_s, p.encode_cpu_s, p.encode_peak_mb, p.decode_s, p.decode_cpu_s, p.decode_peak_mb)
        cells = ("-" if n is None else f"{n:,.0f}" if n >= 100 else f"{n:.1f}" for n in numbers)
        lines.append(f"| {' | '.join((p.codec, f'{p.vertices:,}', f'{p.frames:,}', *cells))} |")
    return "\n".join(lines)
