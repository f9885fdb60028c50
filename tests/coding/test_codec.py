"""The base of codecs: what a class does not say has a default, and what says nothing is refused."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import pytest

from gvpipe.codec import BaseCodec, Codec, Settings
from gvpipe.coding.registry import codec_class, codec_ids
from gvpipe.container.segments import SegmentParts
from gvpipe.foundation.errors import CorruptFile, FormatError, OverBudget


@dataclass(frozen=True)
class Least(BaseCodec):
    """No more than a codec must have."""

    id: ClassVar[str] = "least"
    version: ClassVar[int] = 1
    summary: ClassVar[str] = "nothing"
    quality: float = 75.0

    @classmethod
    def reader(cls, bitstream: Any) -> Any:
        """Of no file."""


def test_defaults() -> None:
    codec = Least()
    assert isinstance(codec, Codec)
    flags = codec.holds, codec.same_bits, codec.maps_segments, codec.has_levels, codec.codes_live, codec.memory_factor
    assert flags == (False, True, False, False, False, None)
    bitstream: Any = type("Bitstream", (), {"codec": "least"})
    assert codec.browser_obstacle(bitstream) == "least" and codec.segment_parts(bitstream) == SegmentParts()


@pytest.mark.parametrize("name", ["hold", "map_segments", "memory_factors", "same_bit", "code_live"])
def test_misspelt_features_are_refused(name: str) -> None:
    """They would turn a feature off in silence."""
    with pytest.raises(TypeError, match=f"{name} means nothing to gvpipe; did you mean "):
        type("Misspelt", (Least,), {name: True, "__annotations__": {name: "ClassVar[bool]"}})
    type("Own", (Least,), {"TABLE": (1, 2, 3)})
    with pytest.raises(TypeError, match="segment_part means nothing to gvpipe"):
        type("Misspelt", (Least,), {"segment_part": classmethod(lambda cls, bitstream: None)})


@pytest.mark.parametrize("name", codec_ids())
def test_what_codecs_say_of_themselves_is_so(name: str) -> None:
    codec = codec_class(name)
    assert issubclass(codec, BaseCodec) and issubclass(codec, Settings)
    assert codec.codes_live == (codec.start_live is not BaseCodec.start_live)


def test_errors_have_fields() -> None:
    """So that nobody parses a message, in which a path may hold anything."""
    error = CorruptFile("a part: is wrong", "get it again").within("a: b.mp4").within("shard.tar")
    assert (error.what, error.remedy, error.file) == ("a part: is wrong", "get it again", "shard.tar: a: b.mp4")
    assert str(error) == "shard.tar: a: b.mp4: a part: is wrong; get it again"
    refused = OverBudget("its mesh takes 1 GB; a file of 1 kB may take 64 MB")
    refused.asked = "its mesh takes 1 GB"
    named: FormatError = refused.within("x.mp4")
    assert isinstance(named, OverBudget) and named.asked == "its mesh takes 1 GB" and str(named).startswith("x.mp4: its mesh")
