"""What of an archive means nothing here: misspelt members, indices without an attribute, images without a name.

It is left out, and a note says so, because a misspelt name is lost otherwise.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from pathlib import Path

from gvpipe.foundation.arguments import did_you_mean
from gvpipe.foundation.arrays import Array
from gvpipe.io.npz.asset import USUAL, read_description

MEMBERS = ("vertices", "faces", "fps", "polygons", "asset", "meta", *USUAL)
PREFIXES = ("attribute_", "indices_", "image_")  # of members that are loaded
FIELD = "field_"
DESCRIBED = ("version", "attributes", "fields", "parts", "materials", "images", "metadata")  # keys of ``asset``
LISTED = 8  # names in a note


def is_known(name: str) -> bool:
    """Whether a member is loaded with the archive."""
    return name in MEMBERS or (name.startswith(PREFIXES) and name not in PREFIXES)


def odd_notes(names: Collection[str], members: Mapping[str, Array], path: Path) -> tuple[str, ...]:
    """Notes on what means nothing, a line each; raises `InputError` for a description that is none.

    Args:
        names: of all members.
        members: those that `is_known` says are loaded.
        path: of the archive, for messages.
    """
    described = read_description(members, path)
    attributes = [name.removeprefix("attribute_") for name in names if name in USUAL or name.startswith("attribute_")]
    fields = [name.removeprefix(FIELD) for name in names if name.startswith(FIELD)]
    numbers = range(len(described.get("images", [])))
    meant = {*MEMBERS, *(f"image_{number}" for number in numbers), *(f"indices_{name}" for name in attributes)}
    free = ("attribute_", FIELD)  # prefixes of any name
    odd = [name for name in names if name not in meant and (not name.startswith(free) or name in free)]
    return (
        *_note("members of the archive mean nothing and were left out", odd, MEMBERS),
        *_note("'asset' has keys that mean nothing", [key for key in described if key not in DESCRIBED], DESCRIBED),
        *_note("'asset' describes attributes that are not there", _strangers(described, "attributes", attributes), attributes),
        *_note("'asset' describes fields that are not there", _strangers(described, "fields", fields), fields),
    )


def _strangers(described: Mapping[str, Mapping[str, object]], key: str, names: Collection[str]) -> list[str]:
    return [name for name in described.get(key, {}) if name not in names]


def _note(what: str, names: list[str], known: Collection[str]) -> Iterator[str]:
    if names:
        more = f" and {len(names) - LISTED} more" if len(names) > LISTED else ""
        yield f"{what}: {', '.join(map(repr, names[:LISTED]))}{more}{did_you_mean(names[0], known)}"
