"""The multi-chart geometry video codec.

Mamou, Zaharia and Preteux, "Multi-Chart Geometry Video: A Compact Representation for 3D Animations", 2007. The steps:

1. `base`: weld vertices to points, code the base frame, and find the points that move (`base.base_frame`).
2. `motion`: predict frames by affine motions of clusters, blended or as published.
3. `layout`: give each point a pixel.
4. `pictures`: code residuals of frames, or coefficients of trajectories, as a video.

Four routes combine them (`encoding.routes`); a search finds the step that leaves the target error (`encoding.target_search`).

All steps work from what the decoder will have: the decoded base frame and the decoded transforms. Frames are read again by each
that looks at them (the extent, which affine transforms need, motion, transforms, residual range, images), never kept.
"""

from __future__ import annotations

from dataclasses import dataclass

from gvcodecs.mcgv.encode_job import Job
from gvcodecs.mcgv.reader import browser_obstacle, open_reader, segment_parts
from gvcodecs.mcgv.settings import Settings
from gvpipe.coding.codec import Encoded, FrameReader, Memo
from gvpipe.container.bitstream import Bitstream
from gvpipe.container.segments import SegmentParts
from gvpipe.foundation.progress import Progress, silent
from gvpipe.model.sequence import MeshSequence
from gvpipe.model.skin import Skin


@dataclass(frozen=True)
class Mcgv(Settings):
    """The multi-chart geometry video codec: its settings, and what it does with them.

    Raises:
        SettingError: a value out of its range.
    """

    def _encode(self, sequence: MeshSequence, report: Progress, memo: Memo) -> Encoded:
        from gvcodecs.mcgv.encoding.target_search import encode_to_target  # takes 0.2 s, for which no player should wait

        return encode_to_target(Job(self, sequence, memo, report))

    @classmethod
    def reader(cls, bitstream: Bitstream) -> FrameReader:
        """Open an ``mcgv`` bitstream; raises `CorruptFile` where a section does not hold what it must."""
        return open_reader(bitstream)

    @classmethod
    def browser_obstacle(cls, bitstream: Bitstream) -> str:
        """What keeps browsers from playing a bitstream of this codec; ``""`` if they play it."""
        return browser_obstacle(bitstream)

    @classmethod
    def skin(cls, bitstream: Bitstream) -> Skin | None:
        """The clusters of a blended bitstream as joints; None for others; raises `CorruptFile`."""
        from gvcodecs.mcgv.decoding.skin_reader import read_skin

        return read_skin(bitstream)

    def find_skin(self, sequence: MeshSequence, progress: Progress | None = None, memo: Memo | None = None) -> Skin | None:
        """The blend that an encode starts from, as joints and weights; None with affine prediction."""
        from gvcodecs.mcgv.encoding.skeleton import find_skeleton

        return find_skeleton(Job(self, sequence, memo or Memo(is_shared=False), progress or silent))

    def _estimate(self, sequence: MeshSequence, most: float, report: Progress, memo: Memo) -> float | None:
        from gvcodecs.mcgv.encoding.size_estimate import estimate

        return estimate(Job(self, sequence, memo, report), most)

    @classmethod
    def segment_parts(cls, bitstream: Bitstream) -> SegmentParts:
        """What each segment has of a bitstream; raises `CorruptFile` where the header does not hold what it must."""
        return segment_parts(bitstream)
