"""Segments that are so short that encoding them fits a given memory.

What encoding takes at its peak, measured by ``gvpipe bench --scale`` and on segments of 16 to 500 frames (docs/scale.md)::

    300 MB + 800 bytes x V + factor x the segment's positions as float32

A codec that takes one segment at a time has the factor as a class attribute, ``memory_factor``.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

from gvpipe.coding.codec import Codec
from gvpipe.coding.registry import codec_class, codec_ids
from gvpipe.foundation.errors import SettingError

FIXED = 300e6  # bytes: Python, its libraries, machine code
PER_VERTEX = 800  # bytes: mesh, order, causal neighbours
PER_POSITION = 12  # bytes: three float32
MEGABYTE = 1e6


def fit_segments(codecs: Codec | Sequence[Codec], n_vertices: int, memory: int) -> Codec | list[Codec]:
    """Return settings with segments that are short enough for so many bytes of memory; of several, those that can be so.

    Raises:
        SettingError: a codec (of several, each) takes all frames at a time, or a segment of one frame takes more.
    """
    if isinstance(codecs, Codec):
        return _fit(codecs, n_vertices, memory)
    fitting: list[Codec] = []
    refused: list[SettingError] = []
    for codec in codecs:
        try:
            fitting.append(_fit(codec, n_vertices, memory))
        except SettingError as exc:
            refused.append(exc)
    if not fitting:
        raise refused[-1]
    return fitting


def _fit(codec: Codec, n_vertices: int, memory: int) -> Codec:
    factor = codec.memory_factor
    if factor is None:
        others = " or ".join(name for name in codec_ids() if codec_class(name).memory_factor is not None)
        raise SettingError(
            f"codec {codec.id} fits all frames together, so shorter segments save no memory; leave memory out, or choose "
            f"{others}"
        )
    per_frame = factor * PER_POSITION * n_vertices
    longest = int((memory - FIXED - PER_VERTEX * n_vertices) / per_frame)
    if longest < 1:
        least = (FIXED + PER_VERTEX * n_vertices + per_frame) / MEGABYTE
        raise SettingError(
            f"{memory / MEGABYTE:.4g} MB of memory are too little for {n_vertices} vertices: codec {codec.id} takes about "
            f"{least:.0f} MB for one frame; allow more, or encode parts of the mesh"
        )
    names = [name for name in ("segment", "clip") if getattr(codec, name, 0)]
    settings: Any = codec  # a dataclass
    shortened: Codec = dataclasses.replace(settings, **{name: min(getattr(codec, name), longest) for name in names})
    return shortened
