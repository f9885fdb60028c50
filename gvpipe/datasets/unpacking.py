"""Samples of shards back into files, each whole again: the geometry video as it was packed, and its description beside it."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from gvpipe.container.sources import check_target
from gvpipe.datasets.dataset import Dataset
from gvpipe.datasets.opening import find_shards
from gvpipe.datasets.sample_names import DESCRIPTION, VIDEO
from gvpipe.foundation.arguments import StrPath, check_path
from gvpipe.foundation.atomic import output_error, unnamed_path
from gvpipe.foundation.errors import OutputError
from gvpipe.foundation.progress import Progress


@dataclass(frozen=True)
class Unpacked:
    """What `unpack` did.

    Args:
        sequences: how many geometry videos it wrote.
        bytes: of all of these.
    """

    sequences: int
    bytes: int

    def to_json(self) -> dict[str, Any]:
        """The same as JSON values."""
        return asdict(self)


def unpack(
    shards: StrPath | Sequence[StrPath],
    folder: StrPath,
    keys: Sequence[str] = (),
    *,
    progress: Progress | None = None,
    unlimited: bool = False,
) -> Unpacked:
    """Write samples of shards as files, ``KEY.mp4`` and ``KEY.json``, with the sections that they share.

    A file has the bytes that were packed. Keys have no dots: ``walk.v2.mp4`` comes back as ``walk_v2.mp4``.

    Args:
        shards: as for `gvpipe.datasets.open`.
        folder: of the files; it is made if it is missing.
        keys: of the samples; none: all.
        progress: called with ``"unpack"`` and the part that is done.
        unlimited: as for `gvpipe.open`.

    Raises:
        InputError: there is no such shard.
        KeyError: there is no such sample.
        FormatError: a shard or a sample is cut or damaged; the message names shard, sample and byte.
        OutputError: a file is there already, or cannot be written.
    """
    place = Path(check_path(folder, "the folder of the files"))
    check_target(folder)
    dataset = Dataset(find_shards(shards), unlimited=unlimited)
    numbers = [dataset.number(key) for key in keys] if keys else range(len(dataset))
    n_bytes = 0
    for done, number in enumerate(numbers):
        if progress:
            progress("unpack", done / len(numbers))
        n_bytes += _write_sample(dataset, number, place / f"{dataset.keys[number]}.{VIDEO}")
    return Unpacked(len(numbers), n_bytes)


def _write_sample(dataset: Dataset, number: int, path: Path) -> int:
    """Write a sample's files; return the bytes of its video."""
    video, text = dataset.whole_file(number), dataset.description_text(number)
    beside = path.with_suffix(f".{DESCRIPTION}")
    for taken in (path, beside):
        if os.path.lexists(taken):
            raise OutputError(f"cannot write {taken}: it is there already; remove it or choose another folder")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as exc:
        raise output_error(path.parent, exc) from exc
    for target, data in ((path, video), (beside, text)):
        if data:
            with unnamed_path(target) as temporary:
                Path(temporary).write_bytes(data)
    return len(video)
