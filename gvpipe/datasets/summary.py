"""What a data set holds, in sums; every sample's checksums are checked on the way."""

from __future__ import annotations

import math
import os
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from gvpipe.datasets.dataset import Dataset
from gvpipe.datasets.opening import find_shards
from gvpipe.foundation.arguments import StrPath
from gvpipe.foundation.progress import Progress

FLOAT32_POSITION = 12  # bytes
ERRORS = ("max_diag", "kg", "rmse_diag")  # keys of `gvpipe compare --json`


@dataclass(frozen=True)
class Summary:
    """Sums over the sequences of shards.

    Args:
        shards, sequences: how many.
        vertices, frames: least and most of a sequence, and all.
        triangles: of all sequences.
        bytes: of the shards; ``video_bytes`` of the geometry videos in them and of what these share.
        ratio: bytes of all positions as float32, by ``video_bytes``.
        codecs: how many sequences each has.
        worst: the largest of ``max_diag``, ``kg`` and ``rmse_diag`` that the samples' descriptions have, with its sample.
    """

    shards: int
    sequences: int
    vertices: dict[str, int]
    frames: dict[str, int]
    triangles: int
    bytes: int
    video_bytes: int
    ratio: float
    codecs: dict[str, int]
    worst: dict[str, dict[str, Any]]

    def to_json(self) -> dict[str, Any]:
        """The same as JSON values."""
        return asdict(self)


def summarise(shards: StrPath | Sequence[StrPath], progress: Progress | None = None, *, unlimited: bool = False) -> Summary:
    """Read every sample of shards, check its checksums, and sum up.

    The arguments are those of `gvpipe.datasets.open`.

    Raises:
        InputError: there is no such shard.
        FormatError: a shard or a sample is cut or damaged; the message names shard, sample and byte.
    """
    dataset = Dataset(find_shards(shards), unlimited=unlimited)
    vertices, frames, codecs = [], [], Counter[str]()
    triangles = positions = 0
    worst: dict[str, dict[str, Any]] = {}
    for number, key in enumerate(dataset.keys):
        if progress:
            progress("check", number / len(dataset))
        bitstream = dataset.bitstream(number)
        vertices.append(bitstream.n_vertices)
        frames.append(bitstream.n_frames)
        codecs[bitstream.codec] += 1
        triangles += bitstream.n_triangles
        positions += bitstream.n_vertices * bitstream.n_frames
        _keep_worst(worst, key, dataset.description(number))
    return Summary(
        shards=len(dataset.shards),
        sequences=len(dataset),
        vertices=_range(vertices),
        frames=_range(frames),
        triangles=triangles,
        bytes=sum(map(os.path.getsize, dataset.shards)),
        video_bytes=dataset.n_bytes,
        ratio=FLOAT32_POSITION * positions / max(dataset.n_bytes, 1),
        codecs=dict(sorted(codecs.items())),
        worst=worst,
    )


def _keep_worst(worst: dict[str, dict[str, Any]], key: str, description: dict[str, Any]) -> None:
    """Take over the errors of a sample that are larger than those so far."""
    for name in ERRORS:
        value = description.get(name)
        is_number = isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
        if is_number and (name not in worst or value > worst[name]["value"]):
            worst[name] = {"value": value, "sample": key}


def _range(counts: list[int]) -> dict[str, int]:
    return {"least": min(counts, default=0), "most": max(counts, default=0), "all": sum(counts)}
