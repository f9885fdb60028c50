"""What a header says of trajectory images (`pictures.trajectories`) in place of a frame's steps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from gvpipe.container.bitstream import Bitstream
from gvpipe.container.segments import count_longest, read_steps
from gvpipe.trajectory.basis import MAX_COMPONENTS

TRANSFORMS = ("none", "klt")
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
        fields = bitstream.fields
        if bitstream.version == 1:
            raise fields.wrong("transform", "a later version")
        fields.choice("transform", TRANSFORMS[1:])
        most = min(MAX_COMPONENTS, 3 * count_longest(bitstream.n_frames, segments))
        components = fields.integers("components", segments, 0, most)
        return cls(fields.integer("fineness", 1, MAX_FINENESS), components, read_steps(bitstream, segments))
