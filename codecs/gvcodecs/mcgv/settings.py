"""The settings of the multi-chart geometry video codec, and what follows from them alone."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from gvcodecs.mcgv.header import MAX_CLUSTERS, PLACEMENTS, PREDICTIONS, TRANSFORMS, VERSION
from gvpipe.coding.codec import BaseCodec
from gvpipe.container.bitstream import Bitstream
from gvpipe.container.segments import MAX_SEGMENT
from gvpipe.foundation.errors import SettingError
from gvpipe.media.video import PROFILES, Profile
from gvpipe.model.sequence import MeshSequence

BLOCKS = {"h264": 16, "jpeg": 8}  # sides of the image coders' blocks, pixels
MAX_TILED = 1 << 15  # points: beyond, xatlas takes longer than all else, and chart labels are a tenth of a smooth mesh's file
MAX_PLANE = 4096  # pixels along a side
AUTO = "auto"
PRESETS = ("ultrafast", "superfast", "veryfast", "faster", "fast", "medium", "slow", "slower", "veryslow")


@dataclass(frozen=True)
class Settings(BaseCodec):
    """Settings of the multi-chart geometry video codec.

    Raises:
        SettingError: a value out of its range.
    """

    id: ClassVar[str] = "mcgv"
    version: ClassVar[int] = VERSION
    summary: ClassVar[str] = "multi-chart geometry video: residual images of a blended affine prediction, as H.264 or JPEG"
    holds: ClassVar[bool] = True  # repeated frames are coded around it (`gvpipe.coding.repeated_frames`)

    quality: float = 75.0  # 0..100, higher is better
    image: str = "h264"  # h264: predictive; jpeg: every frame decodes alone
    profile: str = "web"  # web: 8 bits, browsers read it; precise: 10 bits (h264 only)
    transform: str = "none"  # none: pictures are frames; klt: coefficients of trajectories (blended h264 only), smaller
    prediction: str = "blended"  # blended: vertices follow up to four clusters; affine: one, as published
    clusters: int = 0  # K, 1..1024; 0: as many as pay (blended), 20 (affine)
    transform_bits: int = 17  # bits over the sequence's extent, 8..24 (affine)
    base_bits: int = 0  # bits along the base frame's longest side, 4..20; 0: as many as pay (blended), 12 (affine)
    placement: str = AUTO  # charts: as published; halves: pixels follow from the base frame; tiles (blended): from charts;
    # auto: tiles if blended h264 (halves beyond 32768 points), else charts; blended, no pictures at all where that is smaller
    density: float = 1.0  # pixels per vertex inside charts, 1..16 (placement charts)
    size: str = AUTO  # of a plane, pixels: auto, or WIDTHxHEIGHT in whole blocks, such as 256x256
    gop: int = 32  # frames per group of pictures, 1..1000 (h264)
    preset: str = "slow"  # x264's: slower ones are smaller
    segment: int = 500  # most frames per segment, 1..100000
    reorder: bool = False  # true: the codec may choose the vertex order; smaller

    def __post_init__(self) -> None:
        self.check_range(0, 100, "quality")
        self.check_choice("image", ("h264", "jpeg"))
        self.check_choice("profile", ("web", "precise"))
        self.check_choice("preset", PRESETS)
        self.check_choice("prediction", PREDICTIONS)
        self.check_choice("transform", TRANSFORMS)
        self.check_choice("placement", (AUTO, *PLACEMENTS))
        self.check_range(0, MAX_CLUSTERS, "clusters")
        self.check_range(8, 24, "transform_bits")
        self.check_range(0, 20, "base_bits")
        self.check_range(1, 16, "density")
        self.check_range(1, 1000, "gop")
        self.check_range(1, MAX_SEGMENT, "segment")
        if self.image == "jpeg" and self.profile == "precise":
            raise SettingError("profile precise needs image h264: JPEG has 8 bits")
        if self.transform == "klt" and (self.image != "h264" or not self.is_blended):
            raise SettingError("transform klt needs image h264 and prediction blended")
        if self.placement == "tiles" and not self.is_blended:
            raise SettingError("placement tiles needs prediction blended")
        if 0 < self.base_bits < 4:
            raise SettingError(f"base_bits is {self.base_bits}; 0 or an integer in 4..20 is needed")
        self.plane_size  # noqa: B018  # raises SettingError

    @property
    def is_blended(self) -> bool:
        """Whether vertices follow several clusters."""
        return self.prediction == "blended"

    @property
    def is_cheap_again(self) -> bool:
        """Whether another encode takes little: without trajectory images, most of the first is the search for clusters."""
        return self.is_blended and self.transform == "none"

    @property
    def may_omit_pictures(self) -> bool:
        """Whether frames may be their prediction alone, where that is smaller."""
        return self.is_blended and self.transform == "none" and self.placement == AUTO

    @property
    def block(self) -> int:
        """Side of the image coder's blocks, pixels."""
        return BLOCKS[self.image]

    @property
    def video_profile(self) -> Profile:
        """The profile of the pictures' video."""
        return PROFILES["jpeg" if self.image == "jpeg" else "h264-10" if self.profile == "precise" else "h264-8"]

    @property
    def plane_size(self) -> tuple[int, int] | None:
        """Width and height of a plane, pixels; None: as the points need it. Raises `SettingError`."""
        if self.size == AUTO:
            return None
        parts, block = self.size.lower().split("x"), self.block
        if len(parts) == 2 and all(p.isdecimal() and int(p) % block == 0 and block <= int(p) <= MAX_PLANE for p in parts):
            return int(parts[0]), int(parts[1])
        raise SettingError(f"size is {self.size!r}; auto or WIDTHxHEIGHT, multiples of {block} up to {MAX_PLANE}, is needed")

    def choose_placement(self, n_points: int) -> str:
        """The placement of so many points.

        JPEG, which sees no other frame, codes the smoother images of charts for less
        (docs/decisions/0073-tiles-and-halves-place-blended-pixels.md).
        """
        if self.placement != AUTO:
            return self.placement
        if not self.is_blended or self.image != "h264":
            return "charts"
        return "tiles" if n_points <= MAX_TILED else "halves"

    def bitstream(
        self, sequence: MeshSequence, header: Mapping[str, Any], sections: Mapping[str, bytes], video: bytes
    ) -> Bitstream:
        """The bitstream of a sequence."""
        return self._bitstream(sequence, header, sections, video)
