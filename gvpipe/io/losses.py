"""What a file format has no place for, said in one line."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence

from gvpipe.asset.metadata import NO_METADATA
from gvpipe.foundation.notes import not_held
from gvpipe.model.sequence import MeshSequence

LISTED = 5  # names in a note

NO_PARENTS = "skinned meshes have no nodes above them; names of the parts' parents are left out"
TURNED_NORMALS = "normals of the first frame turn with the skeleton; those of later frames are left out"


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
        "parts": has_parts(sequence),
        "materials": bool(sequence.materials),
        "metadata": sequence.metadata != NO_METADATA,
        "units": any(each.unit for name, each in (*sequence.attributes.items(), *sequence.fields.items()) if name in held),
    }
    left_out = [name for name, is_there in others.items() if is_there and name not in held]
    return not_held(format_name, [*dict.fromkeys(named), *left_out, *more])


def has_parts(sequence: MeshSequence) -> bool:
    """Whether a sequence has several parts, or one with a name."""
    return len(sequence.parts) > 1 or any(part.name for part in sequence.parts)


def shadowed(sequence: MeshSequence) -> list[str]:
    """Names that an attribute and a field have both; normals are written by rules of their own."""
    return [name for name in sequence.attributes if name in sequence.fields and name != "normal"]


def shadow_note(names: Sequence[str], format_name: str) -> tuple[str, ...]:
    """The note for attributes that have the name of a field."""
    return (f"{format_name} has one value of a name; the fields {', '.join(names)} stand for the attributes",) if names else ()


def renamed_note(names: Iterable[tuple[str, str]], format_name: str) -> tuple[str, ...]:
    """The note for names that a format does not allow, has already, or gives a meaning: pairs of the old and the new one."""
    changed = [f"{old!r} is {new!r}" for old, new in dict.fromkeys(names) if old != new]
    more = f" and {len(changed) - LISTED} more" if len(changed) > LISTED else ""
    return (f"names were changed for {format_name}: {', '.join(changed[:LISTED])}{more}",) if changed else ()


def unit_note(sequence: MeshSequence, format_name: str) -> tuple[str, ...]:
    """The note for attributes and fields whose units have no place."""
    every = (*sequence.attributes.items(), *sequence.fields.items())
    units = list(dict.fromkeys(f"{name} ({one.unit})" for name, one in every if one.unit))
    listed = ", ".join(units[:LISTED]) + (f" and {len(units) - LISTED} more" if len(units) > LISTED else "")
    return (f"{format_name} has no units of numbers; those of {listed} were left out",) if units else ()


def wide_note(sequence: MeshSequence, format_name: str) -> tuple[str, ...]:
    """The note for float64 fields that a format holds as float32."""
    wide = [name for name, one in sequence.fields.items() if one.dtype.name == "float64"]
    return (f"{format_name} holds float32; digits of {', '.join(wide[:LISTED])} are lost",) if wide else ()
