"""What a route ends with, and the bitstream's header and sections from there."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from gvcodecs.mcgv.base.base_frame import Start
from gvcodecs.mcgv.base.surface import STILL
from gvcodecs.mcgv.header import Header
from gvcodecs.mcgv.layout.coding import encode_pixels
from gvcodecs.mcgv.layout.layout import Layout
from gvcodecs.mcgv.motion.contract import CodedMotion
from gvcodecs.mcgv.pictures.frames import CodedFrames
from gvcodecs.mcgv.pictures.outliers import SECTION
from gvcodecs.mcgv.settings import Settings
from gvpipe.foundation.arrays import Float64


@dataclass(frozen=True)
class Coded:
    """What a route ends with.

    Args:
        layout: the points' pixels; None without pictures.
        fields: the route's own, of the header.
        sections: the route's own.
        video: empty without pictures.
        predict: without pictures, the points' positions, as in `CodedMotion`.
    """

    layout: Layout | None
    fields: Mapping[str, Any]
    sections: Mapping[str, bytes]
    video: bytes
    predict: Callable[[int, int], Float64] | None = None

    @classmethod
    def of_frames(cls, layout: Layout, motion: CodedMotion, frames: CodedFrames, placed: Mapping[str, bytes]) -> Coded:
        """What routes with pictures of frames end with; ``placed`` are the sections that say where their points are."""
        fields = {"clusters": motion.n_clusters, "transform_step": motion.step, "residual_step": frames.step}
        sections = {**motion.sections, **placed}
        if frames.outliers:
            fields, sections = {**fields, "outliers": True}, {**sections, SECTION: frames.outliers}
        return cls(layout, fields, sections, frames.video)

    def header(self, settings: Settings, start: Start) -> Header:
        """The whole header."""
        fields = {"prediction": settings.prediction, "segments": len(start.bounds) - 1, "base": start.lattice, **self.fields}
        if not self.layout:
            return Header(pictures=False, **fields)
        return Header(
            placement=start.placement,
            profile=settings.video_profile,
            block=settings.block,
            width=self.layout.width,
            height=self.layout.height,
            **fields,
        )

    def all_sections(self, start: Start) -> dict[str, bytes]:
        """The bitstream's sections, in its order."""
        sections = {"mesh": start.coded.mesh, "order": start.coded.order}
        if start.still:
            sections[STILL] = start.still
        if self.layout and start.placement == "charts":
            sections["pixels"] = encode_pixels(self.layout)
        return {**sections, **self.sections}
