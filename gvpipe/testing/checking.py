"""All promises of one codec, at once."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from gvpipe.coding.codec import Codec
from gvpipe.coding.registry import codec_class, codec_ids
from gvpipe.foundation.arguments import did_you_mean
from gvpipe.foundation.atomic import temporary_folder
from gvpipe.foundation.errors import SettingError
from gvpipe.testing.promises import PROMISES, BrokenPromise, Promise, Subject


def check_codec(codec: str | Codec, bound: float = 2e-3, promises: Sequence[str] | None = None) -> list[str]:
    """Try a codec on all that gvpipe asks of every codec, and return the names of the promises that it keeps.

    Args:
        codec: its id, or its settings. The package must be installed, since files name their codec by its id.
        bound: the largest root mean square error, as a part of frame 0's diagonal, that its default quality may make.
        promises: names of those to try, as `PROMISES` lists them; None: all.

    Raises:
        BrokenPromise: with a line for each promise that it breaks.
        SettingError: no codec of that id is installed, or there is no such promise.

    Examples:
        >>> from gvpipe.testing import check_codec
        >>> check_codec("pca", promises=["settings"])
        ['settings']
    """
    made: Codec = codec_class(codec)() if isinstance(codec, str) else codec
    if made.id not in codec_ids():
        raise SettingError(
            f"no codec {made.id!r} is installed; install its package (pip install -e .), whose entry point in the group "
            "gvpipe.codecs names it"
        )
    kept, broken = [], []
    with temporary_folder() as folder:
        subject = Subject(made, Path(folder), bound)
        for promise in _chosen(promises):
            try:
                promise(subject)
            except BrokenPromise as exc:
                broken.append(f"{promise.name} ({promise.text}): {exc}")
            except Exception as exc:
                broken.append(f"{promise.name} ({promise.text}): it raised {exc!r}")
            else:
                kept.append(promise.name)
    if broken:
        raise BrokenPromise(
            "\n".join([f"codec {made.id!r} breaks {len(broken)} of {len(kept) + len(broken)} promises:", *broken])
        )
    return kept


def _chosen(names: Sequence[str] | None) -> list[Promise]:
    if names is None:
        return PROMISES
    by_name = {promise.name: promise for promise in PROMISES}
    for name in names:
        if name not in by_name:
            raise SettingError(f"no promise {name!r}; there are {', '.join(by_name)}{did_you_mean(name, list(by_name))}")
    return [by_name[name] for name in names]
