"""Names of members: a sample's key, then what it is of the sample. As in WebDataset, the key ends at the name's first dot.

A shared section is ``__shared-HASH__``. WebDataset passes over names that begin and end so, and over names without a dot.
"""

from __future__ import annotations

import re
from pathlib import PurePosixPath

VIDEO, DESCRIPTION = "mp4", "json"
SHARED = re.compile(r"__shared-([0-9a-f]{32})__")


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


def shared_name(digest: str) -> str:
    """The member that holds the shared section of a hash."""
    return f"__shared-{digest}__"


def shared_hash(name: str) -> str | None:
    """Mirror of `shared_name`; None for other members.

    Examples:
        >>> shared_hash("__shared-e3b0c44298fc1c149afbf4c8996fb924__"), shared_hash("a.mp4")
        ('e3b0c44298fc1c149afbf4c8996fb924', None)
    """
    found = SHARED.fullmatch(name)
    return found[1] if found else None
