"""What a file format has no place for, said in one line."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from gvpipe.asset.metadata import NO_METADATA
from gvpipe.notes import not_held
from gvpipe.sequence import MeshSequence


def lost_notes(sequence: MeshSequence, format_name: str, held: Collection[str], more: Sequence[str] = ()) -> tuple[str, ...]:
    """A note of what a sequence has and a format does not hold.

    Args:
        sequence: which is written.
        format_name: such as ``"PLY"``.
        held: names of the attributes and fields that are written; ``"polygons"``, ``"parts"``, ``"materials"``, ``"metadata"``.
        more: what else is lost.
    """
    named = [name for name in (*sequence.attributes, *sequence.fields) if name not in held]
    others = {
        "polygons": sequence.polygons is not None,
        "parts": len(sequence.parts) > 1 or any(part.name for part in sequence.parts),
        "materials": bool(sequence.materials),
        "metadata": sequence.metadata != NO_METADATA,
        "units": any(each.unit for name, each in (*sequence.attributes.items(), *sequence.fields.items()) if name in held),
    }
    left_out = [name for name, is_there in others.items() if is_there and name not in held]
    return not_held(format_name, [*dict.fromkeys(named), *left_out, *more])
