"""The paths of shards, and a data set of them."""

from __future__ import annotations

import glob
import os
from collections.abc import Sequence

from gvpipe.container.sources import check_source
from gvpipe.datasets.dataset import Dataset
from gvpipe.datasets.shard_index import index_shard
from gvpipe.datasets.shared import SharedSections, open_source
from gvpipe.foundation.arguments import StrPath, check_path
from gvpipe.foundation.errors import InputError
from gvpipe.io.frames.numbering import natural_key


def open(shards: StrPath | Sequence[StrPath], *, unlimited: bool = False) -> Dataset:
    """Open a data set: ``"shard-*.tar"``, one shard, or a list of those.

    Args:
        shards: paths, or globs. Shards of a glob come in natural order.
        unlimited: as for `gvpipe.open`, of every file in it.

    Raises:
        InputError: there is no such shard, no sample, or two samples have one key.
        FormatError: a shard is cut or damaged; the message names shard, sample and byte.
        TypeError: it is no path.
    """
    return Dataset(find_shards(shards), unlimited=unlimited)


def shared_sections(shards: StrPath | Sequence[StrPath]) -> SharedSections:
    """Return what files of shards share, for samples that another program takes out of them.

    Examples:
        ``gvpipe.Player(key, data=sample["mp4"], shared=gvpipe.datasets.shared_sections("shard-*.tar"))``

    Args:
        shards: as for `open`.

    Raises:
        InputError: there is no such shard.
        FormatError: a shard is cut or damaged.
        TypeError: it is no path.
    """
    return SharedSections([(open_source(path), index_shard(path).shared) for path in find_shards(shards)])


def find_shards(shards: StrPath | Sequence[StrPath]) -> list[str]:
    """The paths that are meant, absolute, each once; raises `InputError` where there are none."""
    given = shards if isinstance(shards, list | tuple) else [shards]
    found: list[str] = []
    for one in given:
        path = os.fspath(check_path(one, "the shards", "a list of paths or "))
        check_source(path)
        if os.path.isdir(path):
            raise InputError(f"{path} is a folder; give its shards, such as {os.path.join(path, '*.tar')}")
        matches = [path] if os.path.exists(path) else sorted(glob.glob(path), key=natural_key)
        if not matches:
            raise InputError(f"{path}: no such shard; check the path")
        found += map(os.path.abspath, matches)
    if not found:
        raise InputError("the list of shards is empty; give at least one")
    return list(dict.fromkeys(found))
