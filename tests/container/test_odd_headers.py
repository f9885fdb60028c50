"""Every value of every header, and of the list of an asset, replaced by odd ones: a clear error, or finite positions."""

from __future__ import annotations

import dataclasses
import json
import zlib

import numpy as np
import pytest
from folders import GOLDEN
from odd_headers import budget_of, header_of, odd_texts, payload_of, read_all

from gvpipe.container.bitstream import unpack_payload
from gvpipe.container.mp4 import read_file
from gvpipe.foundation.errors import FormatError

KINDS = ("mcgv-1-jpeg", "mcgv-1-klt", "pca-1-still")
OTHERS = sorted({path.stem for path in GOLDEN.glob("*.mp4")} - set(KINDS))


@pytest.mark.parametrize("name", [*KINDS, *(pytest.param(name, marks=pytest.mark.slow) for name in OTHERS)])
def test_a_header_with_an_odd_value_is_refused_or_works(name: str) -> None:
    whole = read_file(GOLDEN / f"{name}.mp4")
    sections = dict(whole.sections)
    for what, text in odd_texts(header_of(whole)):
        try:
            bitstream, _ = unpack_payload(payload_of(text, sections), budget_of(sections))
            frame = read_all(dataclasses.replace(bitstream, video=whole.video))
        except FormatError:
            continue
        except Exception as exc:
            raise AssertionError(f"{name}, {what}") from exc
        assert np.isfinite(frame).all(), what


@pytest.mark.slow
def test_an_asset_with_an_odd_value_is_refused_or_works() -> None:
    whole = read_file(GOLDEN / "pdct-1-asset.mp4")
    for what, text in odd_texts(json.loads(zlib.decompress(whole.section("asset")))):
        changed = {**whole.sections, "asset": zlib.compress(text.encode())}
        try:
            read_all(dataclasses.replace(whole, sections=changed))
        except FormatError:
            continue
        except Exception as exc:
            raise AssertionError(what) from exc


def test_numbers_of_the_container_are_numbers() -> None:
    whole = read_file(GOLDEN / "pca-1-still.mp4")
    for value in ('{"id": 3}', '{"video_crc32": 1}', "[]", "null"):
        header = json.dumps({**header_of(whole), "container": "here"}).replace('"here"', value)
        with pytest.raises(FormatError, match="header"):
            _, container = unpack_payload(payload_of(header, dict(whole.sections)))
            container.text("id")
