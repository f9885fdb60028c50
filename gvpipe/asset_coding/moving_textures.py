"""Moving images as video tracks beside the geometry's, and back.

The directory lists a moving image as any other; its pictures lie in the companion track (`gvpipe.container.companion`) that
names its number. How a row of pictures becomes a track is `gvpipe.media.picture_video`'s alone.
"""

from __future__ import annotations

import io
import itertools
import warnings
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from gvpipe.asset.material import MOVING, Image
from gvpipe.asset.moving import Pictures, png_of
from gvpipe.asset_coding.used_texels import used_texels
from gvpipe.container.companion import MOST, Companion
from gvpipe.container.json_object import JsonObject
from gvpipe.foundation.arrays import Bool, UInt8
from gvpipe.foundation.budget import Budget
from gvpipe.foundation.errors import InputError, SettingError
from gvpipe.media.picture_reader import CodedPictures as CodedTrack
from gvpipe.media.picture_reader import PictureReader, take_apart, take_apart_remote
from gvpipe.media.picture_video import COPY, DEFAULT_QUALITY, READ, check_choice, codec_of, copy_pictures, encode_pictures
from gvpipe.media.texel_fill import TexelFill
from gvpipe.model.sequence import MeshSequence

KIND = "texture"  # of companions
MOST_MOVING = MOST - 1  # images: one companion may be a sound
DEFAULT_CODEC = "h264"
MAX_SIDE, MAX_FRAMES, MAX_IMAGES = 16384, 1 << 24, 1 << 16


@runtime_checkable
class CodedPictures(Protocol):
    """Pictures that are coded already."""

    @property
    def codec(self) -> str:
        """The track's codec: ``"h264"``, ``"hevc"``, ``"av1"`` or ``"vp9"``."""
        ...

    def track(self, fps: float) -> bytes:
        """Return the coded pictures as an MP4 file of one track; raises `InputError` or `FormatError`."""
        ...


@dataclass(frozen=True)
class MovingCoding:
    """How moving images are coded.

    Args:
        codec: ``"h264"``, ``"hevc"``, ``"av1"`` or ``"copy"``; None: pictures of an H.264 video as they are, others as h264.
        quality: 0..100, higher is better; None: 75.

    Raises:
        SettingError: another codec, or one that this FFmpeg does not write; a quality out of range, or one beside ``"copy"``.
    """

    codec: str | None = None
    quality: float | None = None

    def __post_init__(self) -> None:
        check_choice(self.codec or COPY, DEFAULT_QUALITY if self.quality is None else self.quality)
        if self.codec == COPY and self.quality is not None:
            raise SettingError("moving textures that are copied stay as they are; leave out their quality, or the codec copy")

    def copies(self, pictures: Pictures) -> bool:
        """Whether a row of pictures is taken as it is coded; raises `SettingError` if it is to be, and is not coded."""
        is_coded = isinstance(pictures, CodedPictures)
        if self.codec == COPY and not is_coded:
            raise SettingError("the pictures of a moving texture are no video; leave out the codec copy")
        is_free = self.codec is None and self.quality is None
        return self.codec == COPY or (is_free and isinstance(pictures, CodedPictures) and pictures.codec == DEFAULT_CODEC)


def code_pictures(pictures: Pictures, fps: float, coding: MovingCoding, used: Bool | None = None) -> bytes:
    """Return a row of pictures as an MP4 file of one track.

    Args:
        pictures: one for each frame.
        fps: frames per second.
        coding: how.
        used: ``(height, width)`` texels that are seen: others are filled smoothly; None: all.
    """
    if coding.copies(pictures):
        assert isinstance(pictures, CodedPictures)
        return pictures.track(fps)
    fill = TexelFill(used) if used is not None else None
    quality = DEFAULT_QUALITY if coding.quality is None else coding.quality
    row = (each if fill is None else fill(each) for each in _pixels(pictures))
    return encode_pictures(row, pictures.size, fps, coding.codec or DEFAULT_CODEC, quality)


def code_moving(images: Sequence[Image], sequence: MeshSequence, coding: MovingCoding) -> tuple[Companion, ...]:
    """Return a companion for each moving image of a sequence; raises `InputError` if there are too many."""
    n_moving = sum(image.is_moving for image in images)
    if n_moving > MOST_MOVING:
        raise InputError(f"{sequence.name} has {n_moving} moving textures; a file holds {MOST_MOVING}, so leave some out")
    companions = []
    for number, image in enumerate(images):
        if image.pictures is None:
            continue
        width, height = image.pictures.size
        used = None if coding.copies(image.pictures) else used_texels(sequence, number, (width, height))
        used = used if used is not None and used.any() else None  # no triangle shows it
        track = code_pictures(image.pictures, sequence.fps, coding, used)
        coded = take_apart(track)
        about = {"image": number, "codec": codec_of(track), "width": width, "height": height, "groups": group_checksums(coded)}
        companions.append(Companion.of(KIND, about, track))
    return tuple(companions)


def alpha_notes(images: Sequence[Image]) -> tuple[str, ...]:
    """A note for each moving image whose first picture is see-through somewhere: video has no alpha."""
    notes = []
    for image in images:
        if image.pictures is None or isinstance(image.pictures, CodedPictures) or not _has_alpha(image.pictures.file(0)[1]):
            continue
        notes.append(f"texture {image.name!r} moves, and loses its alpha: its pictures become a video, which has none")
    return tuple(notes)


def _has_alpha(data: bytes) -> bool:
    """Whether a picture is see-through somewhere; False for one that Pillow cannot open."""
    from PIL import Image as Pillow

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of large pictures, whose side is checked elsewhere
            with Pillow.open(io.BytesIO(data)) as opened:
                return opened.has_transparency_data and bool(np.asarray(opened.convert("RGBA"))[:, :, 3].min() < 255)
    except Exception:  # damaged files raise nearly anything inside Pillow
        return False


def _pixels(pictures: Pictures) -> Iterator[UInt8]:
    return (pictures.pixels(frame) for frame in range(len(pictures)))


class TrackPictures(PictureReader):
    """The pictures of a companion track (`CodedPictures`)."""

    def __init__(self, companion: Companion, name: str, size: tuple[int, int], n_frames: int, budget: Budget) -> None:
        super().__init__(lambda: _taken_apart(companion, budget), size, n_frames, budget, name)
        self._companion = companion

    @property
    def codec(self) -> str:
        """The track's codec: ``"h264"``, ``"hevc"``, ``"av1"`` or ``"vp9"``."""
        return str(self._companion.about.get("codec", ""))

    @property
    def n_bytes(self) -> int:
        """Bytes of its coded pictures."""
        return self._companion.n_bytes

    def track(self, fps: float) -> bytes:
        """As of `CodedPictures`."""
        return copy_pictures(self._companion.file(), self._name, fps, len(self))


def _check_groups(given: object, about: JsonObject) -> None:
    """Raise `CorruptFile` unless the groups are pairs of a number of pictures and a checksum."""
    if not isinstance(given, list) or not all(isinstance(each, list) and len(each) == 2 for each in given):
        raise about.wrong("groups", "a list of pairs")
    numbers = [number for pair in given for number in pair]
    if not all(type(number) is int and 0 <= number < 1 << 32 for number in numbers) or 0 in numbers[::2]:
        raise about.wrong("groups", "a list of numbers of pictures and checksums")


def group_checksums(coded: CodedTrack) -> list[list[int]]:
    """Return, for each group, how many pictures it has and the CRC-32 of their bytes, for readers that fetch some alone."""
    spans = itertools.pairwise(coded.starts)
    return [[stop - start, zlib.crc32(b"".join(coded.packets[start:stop]))] for start, stop in spans]


def _taken_apart(companion: Companion, budget: Budget) -> CodedTrack:
    """A track, of which groups are fetched when they are needed where that is possible; raises `CorruptFile`."""
    if companion.part is None or "groups" not in companion.about:
        return take_apart(companion.file(), budget)
    groups = [(int(count), int(checksum)) for count, checksum in companion.about["groups"]]
    return take_apart_remote(companion.head(), groups, companion.part)


def read_moving(companions: Sequence[Companion], names: Mapping[int, str], n_frames: int, budget: Budget) -> dict[int, Image]:
    """Return moving images by their number; raises `CorruptFile` where a companion does not say which it is.

    Args:
        companions: of a file.
        names: of the moving images that its directory lists, by number.
        n_frames: of the file.
        budget: of the file.
    """
    images = {}
    for companion in companions:
        if companion.kind != KIND:
            continue
        about = JsonObject(dict(companion.about), "header")
        number = about.integer("image", 0, MAX_IMAGES)
        size = about.integer("width", 1, MAX_SIDE), about.integer("height", 1, MAX_SIDE)
        about.choice("codec", READ)
        if "groups" in companion.about:
            _check_groups(companion.about["groups"], about)
        if number in names and number not in images:
            pictures = TrackPictures(companion, names[number], size, n_frames, budget)
            images[number] = Image(names[number], MOVING, b"", pictures)
    return images


class SmallerPictures:
    """Pictures with a longest side (`Pictures`)."""

    def __init__(self, pictures: Pictures, side: int) -> None:
        width, height = pictures.size
        scale = side / max(width, height)
        self._pictures, self._size = pictures, (max(1, round(width * scale)), max(1, round(height * scale)))

    @property
    def size(self) -> tuple[int, int]:
        """Width and height, pixels."""
        return self._size

    def __len__(self) -> int:
        return len(self._pictures)

    def file(self, frame: int) -> tuple[str, bytes]:
        """As of `Pictures`: a PNG."""
        return "image/png", png_of(self.pixels(frame))

    def pixels(self, frame: int) -> UInt8:
        """As of `Pictures`."""
        from PIL import Image as Pillow

        whole = Pillow.fromarray(self._pictures.pixels(frame))
        return np.asarray(whole.resize(self._size, Pillow.Resampling.LANCZOS))
