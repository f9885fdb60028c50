"""Opening an Alembic archive and finding its meshes, with the transforms above them.

The library's schemas crash when their objects are gone before them. So a node keeps its object, its schema and its parent.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gvpipe.foundation.errors import InputError
from gvpipe.io.damage import WHOLE, reading

EXTRA = "Alembic files need the package alembic3d; install it by: pip install 'gvpipe[alembic]'"
OGAWA, HDF5 = b"Ogawa", b"\x89HDF"
CLOSED = 0xFF  # byte 5 of an archive that was written to its end
MESHES = {"AbcGeom_PolyMesh_v1": "IPolyMesh", "AbcGeom_SubD_v1": "ISubD"}
XFORM = "AbcGeom_Xform_v3"
MAX_DEPTH = 500  # of nested nodes


@dataclass(frozen=True)
class Node:
    """A transform or a mesh of an archive.

    Args:
        path: ``/parent/name``.
        kind: name of its schema.
        typed: the library's typed object; it must outlive ``schema``.
        schema: its schema.
        parents: the transforms above it, the nearest first.
        archive: what all of it is read from.
        is_hidden: whether it, or a node above it, is marked as hidden at first.
        hiding: the properties that say so, of it and of nodes above it, the nearest first.
    """

    path: str
    kind: str
    typed: Any
    schema: Any
    parents: tuple[Node, ...]
    archive: Any
    is_hidden: bool
    hiding: tuple[Any, ...]


def open_archive(path: Path) -> Any:
    """Open an archive.

    Raises:
        InputError: alembic3d is missing, the file is none of Alembic's, of its HDF5 kind, cut short or damaged.
    """
    try:
        from alembic3d import Abc
    except ImportError as exc:
        raise InputError(f"{path}: {EXTRA}") from exc
    try:
        with open(path, "rb") as file:
            head = file.read(8)
    except OSError as exc:
        raise InputError(f"{path} cannot be read: {exc.strerror}; check the path") from exc
    if head.startswith(HDF5):
        raise InputError(f"{path} is an Alembic file of the old HDF5 kind; export it again as Ogawa")
    if not head.startswith(OGAWA):
        begins = f"it begins with {head!r}" if head else "it is empty"
        raise InputError(f"{path} is not an Alembic file ({begins}); export it again")
    if len(head) < 8 or head[len(OGAWA)] != CLOSED:
        raise InputError(f"{path} was not written to its end; export it again")
    with reading(path, "Alembic", remedy=WHOLE):
        return Abc.IArchive(str(path))


def sample_of(held: Any, number: int) -> Any:
    """Sample ``number`` of a property or a schema.

    It is asked for by its time, since the library takes a selector's integer for a time, too.
    """
    from alembic3d import Abc

    return held.getValue(Abc.ISampleSelector(float(held.getTimeSampling().getSampleTime(number))))


def find_meshes(archive: Any) -> tuple[list[Node], list[str]]:
    """Return the polygon meshes and subdivision cages in the order of the archive, and names of schemas that were left out."""
    found: list[Node] = []
    others: list[str] = []
    _collect(archive, archive.getTop(), (), (False, ()), (found, others))
    return found, others


def _collect(
    archive: Any, item: Any, parents: tuple[Node, ...], hiding: tuple[bool, tuple[Any, ...]], into: tuple[list[Node], list[str]]
) -> None:
    from alembic3d import AbcGeom

    if len(parents) > MAX_DEPTH:
        raise InputError(f"{item.getFullName()} is nested more than {MAX_DEPTH} nodes deep")
    for number in range(item.getNumChildren()):
        child = item.getChild(number)
        kind = child.getMetaData().get("schema")
        held = AbcGeom.GetVisibilityProperty(child)
        hidden = _is_hidden(child, hiding[0]), (held, *hiding[1]) if held.valid() else hiding[1]
        above = parents
        if kind == XFORM or kind in MESHES:
            typed = getattr(AbcGeom, MESHES.get(kind, "IXform"))(item, child.getName())
            node = Node(child.getFullName(), kind, typed, typed.getSchema(), parents, archive, *hidden)
            if kind == XFORM:
                above = (node, *parents)
            else:
                into[0].append(node)
        elif kind and "FaceSet" not in kind:
            into[1].append(kind.removeprefix("AbcGeom_").split("_v")[0])
        _collect(archive, child, above, hidden, into)


def _is_hidden(child: Any, is_parent_hidden: bool) -> bool:
    from alembic3d import AbcGeom

    state = AbcGeom.GetVisibility(child)
    if state == AbcGeom.ObjectVisibility.kVisibilityHidden:
        return True
    return is_parent_hidden and state == AbcGeom.ObjectVisibility.kVisibilityDeferred
