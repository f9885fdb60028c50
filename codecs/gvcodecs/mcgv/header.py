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

Files of version 5 may code ``mesh`` and ``order`` by adaptive contexts. Files without pictures (from version 4 on) have ``mesh``,
``order``, ``still``, ``weights`` and ``transforms.N`` alone; the header's key ``pictures`` is then false, and nothing in it tells of pictures.

Slots are the points that move (`surface`). In versions 1 and 2 every vertex is a slot, ``mesh`` and ``order`` are those of
`gvpipe.connectivity.base_mesh`, and there is no section ``still``. Version 1 knows affine prediction and charts alone.

Source: Mamou, Zaharia and Preteux, "Multi-Chart Geometry Video", 2007, section 3.3: base frame, partition, parametric
coordinates, transforms, images. With charts the affine partition follows from the pixels, since no block holds two of them;
by halves the pixels follow from the base frame and the partition (`placement`).
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from gvcodecs.mcgv.trajectory_header import TrajectoryHeader
from gvpipe.container.bitstream import Bitstream
from gvpipe.container.segments import HUGE, TINY
from gvpipe.errors import CorruptFile
from gvpipe.media.video import MAX_SIDE, PROFILES, Profile
from gvpipe.mesh.lattice import Lattice

PREDICTIONS = ("blended", "affine")
PLACEMENTS = ("halves", "charts", "tiles")
OF_PICTURES = ("placement", "profile", "block", "width", "height", "residual_step")  # keys of files that have some
MAX_CLUSTERS = 1024
MAX_SEGMENTS = 1 << 16


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
        words = {"prediction": "affine", "placement": "charts"} if bitstream.version == 1 else bitstream.header
        prediction, placement = str(words.get("prediction")), str(words.get("placement"))
        if prediction not in PREDICTIONS or placement not in PLACEMENTS:
            raise CorruptFile(f"header: no prediction {prediction!r} with placement {placement!r}; one of them is unknown")
        if placement == "tiles" and prediction != "blended":
            raise CorruptFile(f"header: no placement {placement!r} with prediction {prediction!r}; get the file again")
        profile = PROFILES.get(str(bitstream.header.get("profile")))
        if profile is None:
            raise CorruptFile(f"header: no profile {bitstream.header.get('profile')!r}; there are {', '.join(PROFILES)}")
        segments = _read_segments(bitstream)
        images = TrajectoryHeader.of(bitstream, segments)
        header = cls(
            prediction=prediction,
            placement=placement,
            profile=profile,
            block=bitstream.integer("block", 2, 64),
            width=bitstream.integer("width", 2, MAX_SIDE),
            height=bitstream.integer("height", 2, MAX_SIDE // 3),
            clusters=bitstream.integer("clusters", 1, MAX_CLUSTERS),
            segments=segments,
            base=_read_base(bitstream),
            transform_step=1.0 if images else bitstream.number("transform_step", TINY, HUGE),
            residual_step=1.0 if images else bitstream.number("residual_step", TINY, HUGE),
            outliers="outliers" in bitstream.header,
            images=images,
        )
        if header.outliers and (bitstream.header["outliers"] is not True or bitstream.version == 1 or images):
            raise CorruptFile(f"header: no outliers {bitstream.header['outliers']!r} in such a file; get the file again")
        if images and (prediction != "blended" or profile.codec != "h264"):
            raise CorruptFile(f"header: no trajectory images with prediction {prediction!r} and profile {profile.name!r}")
        if header.width % header.block or header.height % header.block:
            raise CorruptFile(f"header: planes of {header.width}x{header.height} are not whole blocks of {header.block}")
        if placement != "charts" and header.block not in (8, 16):
            raise CorruptFile(f"header: blocks of {header.block}; vertices are placed in blocks of 8 or 16")
        return header

    @classmethod
    def _without_pictures(cls, bitstream: Bitstream) -> Header:
        alien = [key for key in (*OF_PICTURES, "outliers", "transform") if key in bitstream.header]
        if bitstream.header["pictures"] is not False or bitstream.version < 4 or alien:
            raise CorruptFile(f"header: pictures {bitstream.header['pictures']!r} beside {alien}; get the file again")
        return cls(
            prediction=bitstream.choice("prediction", ("blended",)),
            clusters=bitstream.integer("clusters", 1, MAX_CLUSTERS),
            segments=_read_segments(bitstream),
            base=_read_base(bitstream),
            transform_step=bitstream.number("transform_step", TINY, HUGE),
            pictures=False,
        )


def _read_segments(bitstream: Bitstream) -> int:
    return bitstream.integer("segments", 1, min(MAX_SEGMENTS, bitstream.n_frames))


def _read_base(bitstream: Bitstream) -> Lattice:
    base = bitstream.header.get("base")
    if not (isinstance(base, list) and len(base) == 4 and all(isinstance(v, int | float) for v in base)):
        raise CorruptFile(f"header: base is {base!r}; an origin and a step are needed")
    if not (base[3] > 0 and all(abs(v) < HUGE for v in base)):  # NaN neither
        raise CorruptFile(f"header: base is {base!r}, out of range")
    return Lattice((base[0], base[1], base[2]), base[3])
