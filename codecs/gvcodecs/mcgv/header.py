"""The sections of an ``mcgv`` bitstream, and the header that tells how to read them.

=================  ==========================================================================================
``mesh``           points on the base frame's lattice, connectivity, seams (`gvpipe.connectivity.welded_mesh`)
``order``          vertex order, empty if the codec's own (`gvpipe.connectivity.seams`)
``still``          which points never move (`gvpipe.trajectory.still_vertices`); absent if all do
``pixels``         [integers] x, then [integers] y of each slot in the codec's order: the differences from the slot
                   before; y in the context of the magnitude of the difference in x (placement charts)
``charts``         which chart each point belongs to (`chart_coding`, placement tiles)
``clusters``       affine: [integers] placement charts: cluster of each block that holds a slot, in raster order,
                   difference from the block before; halves: of each slot in the codec's order, from the slot before
``weights``        blended: which clusters each point follows (`weight_coding`)
``transforms.N``   transforms of segment N (affine: `affine_coding`, blended: `skinning_coding`)
``outliers``       what residuals exceed the pictures' levels by (`outliers`); absent if nothing
``trajectories.N`` klt, in place of ``transforms.N``: principal trajectories of segment N (`pictures.trajectories`)
=================  ==========================================================================================

Files without pictures have ``mesh``, ``order``, ``still``, ``weights`` and ``transforms.N`` alone. Their header's key
``pictures`` is false, and nothing in it tells of pictures. Slots are the points that move (`surface`).

Source: Mamou, Zaharia and Preteux, "Multi-Chart Geometry Video", 2007, section 3.3: base frame, partition, parametric
coordinates, transforms, images. With charts the affine partition follows from the pixels, since no block holds two of them;
by halves the pixels follow from the base frame and the partition (`placement`).
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from gvpipe.connectivity.lattice_field import read_lattice
from gvpipe.container.bitstream import Bitstream
from gvpipe.container.segments import HUGE, TINY, count_longest, read_steps
from gvpipe.foundation.errors import CorruptFile
from gvpipe.media.video import MAX_SIDE, PROFILES, Profile
from gvpipe.mesh.lattice import Lattice
from gvpipe.trajectory.basis import MAX_COMPONENTS

VERSION = 1  # of this layout
PREDICTIONS = ("blended", "affine")
PLACEMENTS = ("halves", "charts", "tiles")
OF_PICTURES = ("placement", "profile", "block", "width", "height", "residual_step")  # keys of files that have some
MAX_CLUSTERS = 1024
MAX_SEGMENTS = 1 << 16
TRANSFORMS = ("none", "klt")
MAX_FINENESS = 256


@dataclass(frozen=True)
class TrajectoryHeader:
    """What a header says of trajectory images (`pictures.trajectories`) in place of a frame's steps; one entry per segment.

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
        fields.choice("transform", TRANSFORMS[1:])
        most = min(MAX_COMPONENTS, 3 * count_longest(bitstream.n_frames, segments))
        components = fields.integers("components", segments, 0, most)
        return cls(fields.integer("fineness", 1, MAX_FINENESS), components, read_steps(bitstream, segments))


@dataclass(frozen=True)
class Header:
    """What a reader must know beside the sections; lengths in model units, sides in pixels.

    Args:
        prediction: of `PREDICTIONS`: how vertices move.
        placement: of `PLACEMENTS`: how vertices get their pixels.
        profile: of the video; a picture holds the x, y and z planes, one below the other.
        block: side of the blocks that hold one chart each.
        width, height: of one plane.
        clusters: K.
        segments: how many; segment s starts at frame ``s * F // segments``.
        base: lattice of the base frame.
        transform_step, residual_step: quantisation steps where pictures are frames.
        outliers: whether residuals exceed the pictures' levels.
        images: where pictures are coefficients of trajectories.
        pictures: False where frames are their prediction; then nothing here that tells of pictures means anything.
    """

    prediction: str
    clusters: int
    segments: int
    base: Lattice
    placement: str = "halves"
    profile: Profile = PROFILES["h264-8"]
    block: int = 16
    width: int = 16
    height: int = 16
    transform_step: float = 1.0
    residual_step: float = 1.0
    outliers: bool = False
    images: TrajectoryHeader | None = None
    pictures: bool = True

    def to_json(self) -> dict[str, Any]:
        """Return the header as JSON values."""
        values = asdict(self)
        del values["images"]
        if not self.outliers:
            del values["outliers"]
        if self.images:
            del values["transform_step"], values["residual_step"]
            values |= self.images.to_json()
        values["profile"] = self.profile.name
        values["base"] = [*self.base.origin, self.base.step]
        if self.pictures:
            del values["pictures"]
        else:
            for key in OF_PICTURES:
                del values[key]
        return values

    @classmethod
    def of(cls, bitstream: Bitstream) -> Header:
        """Mirror of `to_json`; raises `CorruptFile` for values out of range."""
        if "pictures" in bitstream.header:
            return cls._without_pictures(bitstream)
        fields = bitstream.fields
        prediction, placement = fields.choice("prediction", PREDICTIONS), fields.choice("placement", PLACEMENTS)
        if placement == "tiles" and prediction != "blended":
            raise fields.wrong("placement", "another one with prediction affine")
        profile = PROFILES[fields.choice("profile", tuple(PROFILES))]
        segments = _read_segments(bitstream)
        images = TrajectoryHeader.of(bitstream, segments)
        header = cls(
            prediction=prediction,
            placement=placement,
            profile=profile,
            block=fields.integer("block", 2, 64),
            width=fields.integer("width", 2, MAX_SIDE),
            height=fields.integer("height", 2, MAX_SIDE // 3),
            clusters=fields.integer("clusters", 1, MAX_CLUSTERS),
            segments=segments,
            base=read_lattice(fields),
            transform_step=1.0 if images else fields.number("transform_step", TINY, HUGE),
            residual_step=1.0 if images else fields.number("residual_step", TINY, HUGE),
            outliers=fields.flag("outliers"),
            images=images,
        )
        if "outliers" in fields and (not header.outliers or images):
            raise fields.wrong("outliers", "none in such a file")
        if images and (prediction != "blended" or profile.codec != "h264"):
            raise fields.wrong("transform", f"none with prediction {prediction} and profile {profile.name}")
        if header.width % header.block or header.height % header.block:
            raise CorruptFile(f"header: planes of {header.width}x{header.height} are not whole blocks of {header.block}")
        if placement != "charts" and header.block not in (8, 16):
            raise CorruptFile(f"header: blocks of {header.block}; vertices are placed in blocks of 8 or 16")
        return header

    @classmethod
    def _without_pictures(cls, bitstream: Bitstream) -> Header:
        fields = bitstream.fields
        alien = [key for key in (*OF_PICTURES, "outliers", "transform") if key in bitstream.header]
        if fields.flag("pictures") or alien:
            raise fields.wrong("pictures", f"none of {', '.join(alien) or 'it in such a file'}")
        return cls(
            prediction=fields.choice("prediction", ("blended",)),
            clusters=fields.integer("clusters", 1, MAX_CLUSTERS),
            segments=_read_segments(bitstream),
            base=read_lattice(fields),
            transform_step=fields.number("transform_step", TINY, HUGE),
            pictures=False,
        )


def _read_segments(bitstream: Bitstream) -> int:
    return bitstream.fields.integer("segments", 1, min(MAX_SEGMENTS, bitstream.n_frames))
