"""What a header says of trajectory images (`trajectory_images`) in place of a frame's steps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from gvpipe.bitstream import Bitstream
from gvpipe.errors import CorruptFile
from gvpipe.row_coding import MAX_VALUES
from gvpipe.segments import count_longest
from gvpipe.trajectory_basis import MAX_COMPONENTS

TRANSFORMS = ("none", "klt")
SMALL, LARGE = 2.0**-140, 2.0**129  # no step of a float32 model lies beyond
MAX_FINENESS = 256


@dataclass(frozen=True)
class TrajectoryHeader:
    """One entry per segment.

    Args:
        fineness: levels per step.
        components: R, principal trajectories.
        steps: D, model units.
    """

    fineness: int
    components: tuple[int, ...]
    steps: tuple[float, ...]

    def to_json(self) -> dict[str, Any]:
        """Return the fields as JSON values."""
        return {"transform": "klt", "fineness": self.fineness, "components": list(self.components), "steps": list(self.steps)}

    @classmethod
    def of(cls, bitstream: Bitstream, segments: int) -> TrajectoryHeader | None:
        """Mirror of `to_json`, None where pictures are frames; raises `CorruptFile` for values out of range."""
        if "transform" not in bitstream.header:
            return None
        if bitstream.header["transform"] != "klt" or bitstream.version == 1:
            raise CorruptFile(f"header: version {bitstream.version} has no transform {bitstream.header['transform']!r}")
        components, steps = bitstream.header.get("components"), bitstream.header.get("steps")
        if not (isinstance(components, list) and isinstance(steps, list) and len(components) == len(steps) == segments):
            raise CorruptFile(f"header: components and steps are not those of {segments} segments; get the file again")
        most = min(MAX_COMPONENTS, 3 * count_longest(bitstream.n_frames, segments), MAX_VALUES // bitstream.n_vertices)
        if not all(type(n) is int and 0 <= n <= most for n in components):
            raise CorruptFile(f"header: a segment's components are not 0..{most}; get the file again from its source")
        if not all(type(step) in (int, float) and SMALL < step < LARGE for step in steps):
            raise CorruptFile("header: a step is not a positive number; get the file again from its source")
        return cls(bitstream.integer("fineness", 1, MAX_FINENESS), tuple(components), tuple(map(float, steps)))
