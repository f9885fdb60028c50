"""Names of members: a sample's key, then what it is of the sample. As in WebDataset, the key ends at the name's first dot."""

from __future__ import annotations

from pathlib import PurePosixPath

VIDEO, DESCRIPTION = "mp4", "json"


def key_of(path: PurePosixPath) -> str:
    """The key of a file's sample, by its path below the folder that is packed; dots are no part of keys.

    Examples:
        >>> key_of(PurePosixPath("cats/walk.v2.mp4"))
        'cats/walk_v2'
    """
    return str(path.with_suffix("")).replace(".", "_")


def split_name(name: str) -> tuple[str, str]:
    """The key of a member and what it is of its sample, both "" for a member that belongs to none.

    Examples:
        >>> split_name("cats/walk_v2.seg.png"), split_name("README"), split_name("cats/.hidden")
        (('cats/walk_v2', 'seg.png'), ('', ''), ('', ''))
    """
    folder, slash, last = name.rpartition("/")
    stem, dot, kind = last.partition(".")
    return (folder + slash + stem, kind.lower()) if stem and dot and kind else ("", "")


def is_plain(name: str) -> bool:
    """Whether a member's name leads nowhere but below the folder that an archive is unpacked to."""
    return bool(name) and not name.startswith("/") and "\\" not in name and ".." not in name.split("/") and name.isprintable()
