"""Geometry videos of whole assets as browsers read them, and pictures for their textures."""

from __future__ import annotations

import dataclasses
import io
import json
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image as Pillow

import gvpipe
from gvpipe.container.mp4 import read_file, write_file
from gvpipe.model.sequence import MeshSequence
from gvpipe.playback.player import Player

FAST: dict[str, Any] = {"preset": "ultrafast", "clusters": 3, "gop": 4}


def write_asset(path: Path, sequence: MeshSequence, bounds: Mapping[str, float | str] | None = None, **settings: Any) -> Player:
    """Encode a sequence with all that it has, exactly but for the attributes of ``bounds``."""
    attributes = {**dict.fromkeys(sequence.attributes, "exact"), **(bounds or {})}
    fields = dict.fromkeys(sequence.fields, "exact,nan=keep")
    gvpipe.encode(sequence, path, attributes=attributes, fields=fields, **{**FAST, **settings})
    return Player(path)


def replace_asset(path: Path, listing: Any, sections: Mapping[str, bytes]) -> None:
    """Give a file a section `asset`, and others."""
    bitstream = read_file(path)
    text = zlib.compress(json.dumps(listing).encode())
    write_file(dataclasses.replace(bitstream, sections={**bitstream.sections, "asset": text, **sections}), path)


def read_listing(path: Path) -> Any:
    """Section `asset` of a file."""
    return json.loads(zlib.decompress(read_file(path).section("asset")))


def picture(colours: npt.ArrayLike, scale: int = 8, kind: str = "PNG") -> bytes:
    """An image file of ``colours (H, W, 3 or 4)`` bytes, each ``scale`` pixels wide."""
    pixels = np.kron(np.asarray(colours, np.uint8), np.ones((scale, scale, 1), np.uint8))
    file = io.BytesIO()
    Pillow.fromarray(pixels).save(file, kind)
    return file.getvalue()
