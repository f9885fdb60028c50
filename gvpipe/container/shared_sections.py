"""Sections that several files of a shard have in common: stored there once, and named in each file by their hash.

A file of the bare layout may refer to them in place of holding them (`gvpipe.container.bare`). A shared section is the bytes
of a section and nothing else, so that it cannot refer to another one. Its hash is checked whenever it is read.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable, Mapping

from gvpipe.foundation.errors import MissingSection, corrupt, corrupt_section

HASH = re.compile(r"[0-9a-f]{32}")
MAX_SHARED = 1 << 28  # bytes of all shared sections of a file
REMEDY = "read it in its shard by gvpipe.datasets.open, or make whole files of the shard: gvpipe unpack SHARD.tar FOLDER"

FindSection = Callable[[str], bytes]
"""Returns the shared section of a hash; raises `KeyError` if there is none."""


def section_hash(data: bytes) -> str:
    """The first 16 bytes of a section's SHA-256, as hexadecimal digits.

    Examples:
        >>> section_hash(b"")
        'e3b0c44298fc1c149afbf4c8996fb924'
    """
    return hashlib.sha256(data).hexdigest()[:32]


def find_shared(hashes: Mapping[str, str], lengths: Mapping[str, int], find: FindSection | None) -> dict[str, bytes]:
    """Return the shared sections of a file by name, each checked.

    Args:
        hashes: by name of the section.
        lengths: of all sections of the file, bytes.
        find: returns them; None: the file lies outside of its shard.

    Raises:
        MissingSection: there is no such shared section.
        CorruptFile: a hash is none, they are too long, or one is not what its hash says.
    """
    found: dict[str, bytes] = {}  # by hash: a second reference takes no more memory
    for name, digest in hashes.items():
        if name not in lengths or not HASH.fullmatch(digest):
            raise corrupt_section(name, "the hash of its shared section is of no section, or no hash")
    needed = {digest: lengths[name] for name, digest in hashes.items()}
    if sum(needed.values()) > MAX_SHARED:
        raise corrupt(f"its shared sections have {sum(needed.values())} bytes, above {MAX_SHARED}")
    for name, digest in hashes.items():
        data = found[digest] if digest in found else _find(name, digest, find)
        if len(data) != lengths[name] or (digest not in found and section_hash(data) != digest):
            raise corrupt_section(name, f"the shared section {digest} is not the one that the file was packed with")
        found[digest] = data
    return {name: found[digest] for name, digest in hashes.items()}


def _find(name: str, digest: str, find: FindSection | None) -> bytes:
    if find is None:
        raise MissingSection(f"section {name!r} is shared section {digest} of the shard that the file was taken from", REMEDY)
    try:
        return find(digest)
    except KeyError as exc:
        message = f"section {name!r} is shared section {digest}, which its shard does not have"
        raise MissingSection(message, "get the shard again from its source") from exc
