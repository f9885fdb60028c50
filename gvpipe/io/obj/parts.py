"""Parts of an OBJ file: its objects (``o``), groups (``g``) and materials (``usemtl``).

One part is made for each combination of these that has faces, in the order in which they first appear, and faces are sorted by
part; faces of one part keep their order. A part of an object without groups has the object's name. A group's part has the
group's name, and the object's as its parent. A new object ends the group before it.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from gvpipe.asset.material import Image, Material
from gvpipe.asset.part import Part
from gvpipe.foundation.arrays import Int32, Int64
from gvpipe.foundation.errors import InputError
from gvpipe.io.obj.lines import decode_name
from gvpipe.io.obj.mtl import read_mtl
from gvpipe.io.pictures import Pictures, find_beside

Named = list[tuple[int, str, str]]  # lines, keywords and names, as of `Lines.named`


class Key(NamedTuple):
    """What the faces of a part have in common."""

    object: str = ""
    group: str = ""
    material: str = ""


def label_faces(named: Named, face_lines: Int64) -> tuple[list[Key], Int64]:
    """The keys that have faces, in order of appearance, and the key's number of each face ``(P,)``.

    Args:
        named: the lines with names.
        face_lines: ``(P,)`` line number of each face.
    """
    key, keys, labels = Key(), dict[Key, int](), np.zeros(len(face_lines), np.int64)
    at = np.searchsorted(face_lines, [line for line, _, _ in named]).tolist()
    start = 0
    for (_, keyword, name), stop in zip([*named, (0, "end", "")], [*at, len(face_lines)], strict=True):
        if stop > start:
            labels[start:stop] = keys.setdefault(key, len(keys))
            start = stop
        if keyword == "o":
            key = Key(name, "", key.material)
        elif keyword == "g":
            key = key._replace(group=name)
        elif keyword == "usemtl":
            key = key._replace(material=name)
    return list(keys), labels


def sort_faces(labels: Int64) -> Int64 | None:
    """The order of faces by part, or None if they lie so."""
    return np.argsort(labels, kind="stable") if (np.diff(labels) < 0).any() else None


def make_parts(keys: list[Key], labels: Int64, faces: Int32, materials: tuple[Material, ...]) -> tuple[Part, ...]:
    """The parts; none if there is but one, without a name or a material.

    Args:
        keys, labels: as of `label_faces`, the label ``(T,)`` of each triangle instead, ascending.
        faces: ``(T, 3)``.
        materials: which keys name.
    """
    if keys in ([], [Key()]):
        return ()
    numbers: dict[str, int] = {}
    for number, material in enumerate(materials):
        numbers.setdefault(material.name, number)
    stops = np.searchsorted(labels, np.arange(len(keys)), side="right")
    starts = np.concatenate([[0], stops[:-1]])
    lows, highs = np.minimum.reduceat(faces.min(axis=1), starts), np.maximum.reduceat(faces.max(axis=1), starts)
    vertices = _vertex_ranges(keys, [(low, high + 1) for low, high in zip(lows.tolist(), highs.tolist(), strict=True)])
    triangles = zip(starts.tolist(), stops.tolist(), strict=True)
    return tuple(
        Part(key.group or key.object, used, held, numbers.get(key.material), key.object if key.group else "")
        for key, used, held in zip(keys, vertices, triangles, strict=True)
    )


def _vertex_ranges(keys: list[Key], used: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Ranges of vertices, given those that the parts' triangles use: parts of one mesh that share vertices have one range."""
    meshes: dict[tuple[str, str], list[int]] = {}
    for number, key in enumerate(keys):
        meshes.setdefault(key[:2], []).append(number)
    ranges = list(used)
    for numbers in meshes.values():
        spans: list[tuple[int, int, list[int]]] = []  # first vertex, the one after the last, parts
        for number in sorted(numbers, key=lambda one: used[one]):
            start, stop = used[number]
            if spans and start < spans[-1][1]:
                low, high, before = spans.pop()
                before.append(number)
                spans.append((low, max(high, stop), before))
            else:
                spans.append((start, stop, [number]))
        for low, high, members in spans:
            for number in members:
                ranges[number] = (low, high)
    return ranges


def load_materials(
    named: Named, keys: list[Key], path: Path
) -> tuple[tuple[Material, ...], tuple[Image, ...], tuple[str, ...], tuple[str, ...]]:
    """The materials that faces use, in the order of their files, their images, notes, and what is not carried.

    A material that no file describes has a plain look, and a note says so.
    """
    used = {key.material for key in keys} - {""}
    if not used:
        return (), (), (), ()
    pictures = Pictures(path.parent)
    described: dict[str, Material] = {}
    for library in dict.fromkeys(name for _, keyword, name in named if keyword == "mtllib"):
        for material in _read_library(library, path, used - set(described), pictures):
            described.setdefault(material.name, material)
    absent = [name for name in dict.fromkeys(key.material for key in keys) if name and name not in described]
    if absent:
        more = f" and {len(absent) - 1} more" if len(absent) > 1 else ""
        pictures.notes.append(
            f"{path.name} uses material {absent[0]!r}{more}, which no .mtl file beside it describes; it looks plain"
        )
    return (
        (*described.values(), *(Material(name) for name in absent)),
        tuple(pictures.images),
        tuple(pictures.notes),
        pictures.left.names,
    )


def _read_library(library: str, path: Path, used: set[str], pictures: Pictures) -> list[Material]:
    """The materials of one ``mtllib`` line, which names a file with blanks or several files without."""
    reason = ""
    for names in ([library], library.split()):
        try:
            texts = [decode_name(find_beside(path.parent, name).read_bytes()) for name in names]
        except (InputError, OSError) as exc:
            reason = reason or (exc.strerror if isinstance(exc, OSError) else None) or str(exc)
            continue
        return [material for text in texts for material in read_mtl(text, pictures, used)]
    pictures.notes.append(f"{path.name} goes without its materials: {reason}")
    return []
