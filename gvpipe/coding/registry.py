"""The codecs that are installed: found by id, and opened by the id that a bitstream names.

Packages register a codec as an entry point in the group ``gvpipe.codecs``. Nothing is imported before it is asked for by id.
Around any codec lie repeated frames (`gvpipe.coding.repeated_frames`) and corrections (`gvpipe.coding.corrections.bound`).
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Iterable, Mapping, Sequence
from importlib.metadata import EntryPoint, entry_points
from typing import Any

import numpy as np

from gvpipe.coding.codec import Codec, Encoded, FrameReader, Memo, check_name
from gvpipe.coding.corrections.bound import correct
from gvpipe.coding.repeated_frames import RepeatedFramesReader, add_repeated_frames, find_repeated_frames, read_repeated_frames
from gvpipe.container.bitstream import Bitstream
from gvpipe.container.segments import SegmentParts
from gvpipe.foundation.arguments import did_you_mean
from gvpipe.foundation.errors import NewerVersion, SettingError, corrupt, quote
from gvpipe.foundation.progress import Progress
from gvpipe.model.sequence import MeshSequence
from gvpipe.model.skin import Skin

GROUP = "gvpipe.codecs"
FIELDS = "field."  # how names of their sections begin (`gvpipe.asset_coding`)


def codec_ids() -> list[str]:
    """Ids of the codecs that are installed, sorted."""
    return sorted(_entries())


@functools.cache
def codec_class(codec: str) -> type[Any]:
    """Return the class of the codec with that id; raises `SettingError` if there is none."""
    if codec not in _entries():
        raise SettingError(f"no codec {codec!r}; there are {', '.join(codec_ids())}{did_you_mean(codec, codec_ids())}")
    loaded: type[Any] = _entries()[codec].load()
    return loaded


def make_codec(codec: str, settings: Mapping[str, Any], also: Iterable[str] = ()) -> Codec:
    """Return a codec's settings object.

    Args:
        codec: its id.
        settings: values by name; others keep their defaults.
        also: names that are no settings of it, but may have been meant; messages suggest them too.

    Raises:
        SettingError: there is no such codec or setting, or a value is out of range.
    """
    chosen = codec_class(codec)
    names = [field.name for field in dataclasses.fields(chosen)]
    for key in settings:
        check_name(key, names, also)
    made: Codec = chosen(**settings)
    return made


def open_reader(bitstream: Bitstream) -> FrameReader:
    """Open a bitstream with the codec that wrote it.

    Corrections (`gvpipe.coding.corrections.bound`) come first, then repeated frames (`gvpipe.coding.repeated_frames`).

    Raises:
        NewerVersion: no installed codec has that id, or only an older version of it.
        CorruptFile: its sections are not what that codec writes.
    """
    if bitstream.codec not in _entries():
        raise NewerVersion(f"it was made by codec {quote(bitstream.codec)}, which this gvpipe does not have; upgrade gvpipe")
    codec = codec_class(bitstream.codec)
    if bitstream.version > codec.version:
        raise NewerVersion(
            f"it was made by version {bitstream.version} of codec {bitstream.codec!r}, this gvpipe has version "
            f"{codec.version}; upgrade gvpipe"
        )
    if bitstream.is_unfinished and not codec.codes_live:
        raise corrupt(f"it is not finished, and files of codec {bitstream.codec!r} do not grow")
    holds = read_repeated_frames(bitstream) if codec.holds else None
    distinct = bitstream if holds is None else dataclasses.replace(bitstream, n_frames=holds.n_distinct)
    reader = correct(distinct, codec.reader(distinct))
    return reader if holds is None else RepeatedFramesReader(reader, holds)


def browser_obstacle(bitstream: Bitstream) -> str:
    """Return what keeps browsers from playing a bitstream, in a few words; ``""`` if they play it.

    Raises:
        SettingError: no codec of that id is installed.
    """
    return str(codec_class(bitstream.codec).browser_obstacle(bitstream))


def read_skin(bitstream: Bitstream) -> Skin | None:
    """The skeleton that moves a file's vertices in all its frames, as far as it goes; None if it has none.

    Raises:
        CorruptFile: its sections are not what its codec writes.
    """
    codec = codec_class(bitstream.codec)
    holds = read_repeated_frames(bitstream) if codec.holds else None
    distinct = bitstream if holds is None else dataclasses.replace(bitstream, n_frames=holds.n_distinct)
    skin: Skin | None = codec.skin(distinct)
    if skin is None or holds is None:
        return skin
    return dataclasses.replace(skin, transforms=np.repeat(skin.transforms, holds.lengths, axis=0))


def segment_parts(bitstream: Bitstream) -> SegmentParts:
    """Return what each segment has of a bitstream; of fields, which positions do not need, that they may come late.

    Raises:
        SettingError: no codec of that id is installed.
        CorruptFile: the header is not what that codec writes.
    """
    codec = codec_class(bitstream.codec)
    holds = read_repeated_frames(bitstream) if codec.holds else None
    distinct = bitstream if holds is None else dataclasses.replace(bitstream, n_frames=holds.n_distinct)
    parts: SegmentParts = codec.segment_parts(distinct)
    return dataclasses.replace(parts, late=tuple(name for name in bitstream.sections if name.startswith(FIELDS)))


def encode_sequence(
    codec: Codec, sequence: MeshSequence, progress: Progress | None = None, memo: Memo | None = None
) -> Encoded:
    """Code a sequence; where the codec lets it (`gvpipe.coding.repeated_frames`), repeated frames are coded by a run length.

    Raises:
        InputError: what the codec raises.
    """
    memo = memo or Memo(is_shared=False)
    holds = memo("holds", lambda: find_repeated_frames(sequence)) if codec.holds else None
    if holds is None:
        return codec.encode(sequence, progress, memo)
    encoded = codec.encode(holds.distinct(sequence), progress, memo)
    return Encoded(add_repeated_frames(encoded.bitstream, holds), encoded.permutation)


def estimate_sequence(
    codec: Codec, sequence: MeshSequence, most: float, progress: Progress | None = None, memo: Memo | None = None
) -> float | None:
    """What `Codec.estimate_bytes` returns; repeated frames are left out, as by `encode_sequence`."""
    memo = memo or Memo()
    holds = memo("holds", lambda: find_repeated_frames(sequence)) if codec.holds else None
    return codec.estimate_bytes(sequence if holds is None else holds.distinct(sequence), most, progress, memo)


def check_mapped(codecs: Codec | Sequence[Codec]) -> None:
    """Raise `SettingError` unless the segments of all these codecs can be coded elsewhere (`gvpipe.runtime.segment_map`)."""
    for codec in [codecs] if isinstance(codecs, Codec) else codecs:
        if not codec.maps_segments:
            others = [name for name in codec_ids() if codec_class(name).maps_segments]
            raise SettingError(
                f"codec {codec.id} fits all frames together, so workers cannot share them; choose codec {' or '.join(others)}, "
                "or encode many sequences side by side (gvpipe encode-all)"
            )


@functools.cache
def _entries() -> dict[str, EntryPoint]:
    return {entry.name: entry for entry in entry_points(group=GROUP)}
