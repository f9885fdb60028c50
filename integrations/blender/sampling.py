"""What selected objects are at a frame of the scene: one mesh of all, evaluated with modifiers, in world space."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np

from .meshes import TAKEN

KINDS = ("MESH", "CURVE", "SURFACE", "FONT", "META")  # objects that have polygons
NUMBERS = {"FLOAT": ("value", 1), "INT": ("value", 1), "FLOAT2": ("vector", 2), "FLOAT_VECTOR": ("vector", 3)}
COLORS = ("FLOAT_COLOR", "BYTE_COLOR")


@dataclass(frozen=True)
class Numbers:
    """Numbers on a mesh: ``rows (n, C)`` of ``domain`` ``"vertex"``, ``"triangle"`` or ``"corner"``, of a kind."""

    domain: str
    kind: str
    rows: Any


@dataclass(frozen=True)
class Piece:
    """A mesh of one object or instance; polygons in the order of their materials.

    Args:
        name: of the object.
        points: ``(V, 3) float32``.
        sizes: ``(P,)`` corners of each polygon, ``corners`` ``(L,)`` their vertices.
        slots: ``(P,)`` rising numbers of materials; -1: none.
        numbers: by name.
    """

    name: str
    points: Any
    sizes: Any
    corners: Any
    slots: Any
    numbers: dict[str, Numbers]


@dataclass
class Sample:
    """All pieces as one mesh.

    Args:
        points: ``(V, 3) float32``, world space.
        faces: ``(T, 3)`` fans of the polygons, whose corners ``sizes`` count.
        parts: name, range of vertices, range of triangles, material or None.
        numbers: by name.
    """

    points: Any
    faces: Any
    sizes: Any
    parts: list[tuple[str, tuple[int, int], tuple[int, int], int | None]]
    numbers: dict[str, Numbers] = field(default_factory=dict)

    def has_same_surface(self, other: Sample) -> bool:
        """Whether polygons, parts and the form of all numbers are those of another sample."""
        forms = [{name: (each.domain, each.rows.shape) for name, each in side.numbers.items()} for side in (self, other)]
        if len(self.points) != len(other.points) or self.parts != other.parts or forms[0] != forms[1]:
            return False
        return np.array_equal(self.sizes, other.sizes) and np.array_equal(self.faces, other.faces)


def sample(graph: Any, chosen: set[str], materials: dict[str, int]) -> Sample | None:
    """The objects of names ``chosen`` as one mesh; None where they have no polygons.

    Args:
        graph: evaluated at the frame.
        chosen: objects, whose instances belong to them.
        materials: numbers of materials by name; new ones are added.
    """
    pieces = []
    for instance in graph.object_instances:
        owner = instance.parent if instance.is_instance else instance.object
        if owner is None or owner.original.name not in chosen or not instance.show_self or instance.object.type not in KINDS:
            continue
        mesh = instance.object.to_mesh()
        if mesh is not None and len(mesh.polygons):
            pieces.append(_piece(instance.object.original.name, mesh, np.array(instance.matrix_world), materials))
        instance.object.to_mesh_clear()
    return _joined(pieces) if pieces else None


def uv_names(meshes: list[Any]) -> dict[str, str]:
    """The attribute of each uv layer, by its name: ``uv`` the first of a mesh, then ``uv1``, ``uv2``."""
    return {layer.name: _uv_name(rank) for mesh in meshes for rank, layer in enumerate(mesh.uv_layers)}


def _uv_name(rank: int) -> str:
    return f"uv{rank or ''}"


def _piece(name: str, mesh: Any, matrix: Any, materials: dict[str, int]) -> Piece:
    points = _read(mesh.vertices, "co", 3)
    starts = _read(mesh.polygons, "loop_start", 0, np.int32).astype(np.int64)
    sizes = _read(mesh.polygons, "loop_total", 0, np.int32).astype(np.int64)
    vertices = _read(mesh.loops, "vertex_index", 0, np.int32)
    slots = np.full(len(sizes), -1)
    if len(mesh.materials):
        known = [materials.setdefault(each.name, len(materials)) if each else -1 for each in mesh.materials]
        indices = _read(mesh.polygons, "material_index", 0, np.int32)
        slots = np.array(known)[np.clip(indices, 0, len(known) - 1)]
    order = np.argsort(slots, kind="stable")
    sizes, starts = sizes[order], starts[order]
    owner = np.repeat(np.arange(len(sizes)), sizes)
    rank = np.arange(len(owner)) - np.repeat(np.cumsum(sizes) - sizes, sizes)
    if np.linalg.det(matrix[:3, :3]) < 0:  # mirrored: the other winding
        rank = np.where(rank == 0, 0, sizes[owner] - rank)
    loops = starts[owner] + rank
    moved = points.astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
    numbers = _numbers(mesh, loops, order)
    return Piece(name, moved.astype(np.float32), sizes, vertices[loops], slots[order], numbers)


def _numbers(mesh: Any, loops: Any, order: Any) -> dict[str, Numbers]:
    """Uv layers, colours, and whatever else stands on points and faces; rows of corners by polygon."""
    found = {}
    for rank, layer in enumerate(mesh.uv_layers):
        found[_uv_name(rank)] = Numbers("corner", "uv", _read(layer.uv, "vector", 2)[loops])
    layers = {layer.name for layer in mesh.uv_layers}
    active = mesh.color_attributes.active_color
    for attribute in mesh.attributes:
        name, domain = attribute.name, attribute.domain
        if name.startswith(".") or name in TAKEN or name in layers or attribute.is_internal:
            continue
        if attribute.data_type in COLORS and domain in ("POINT", "CORNER"):
            rows = _read(attribute.data, "color", 4)
            label = "color" if active is not None and name == active.name else name
            is_point = domain == "POINT"
            found[label] = Numbers("vertex" if is_point else "corner", "color", rows if is_point else rows[loops])
        elif attribute.data_type in NUMBERS and domain in ("POINT", "FACE"):
            member, width = NUMBERS[attribute.data_type]
            kind = np.int32 if attribute.data_type == "INT" else np.float32
            rows = _read(attribute.data, member, width, kind)
            found[name] = Numbers("vertex" if domain == "POINT" else "triangle", "", rows if domain == "POINT" else rows[order])
    return found


def _read(rows: Any, member: str, width: int, kind: Any = np.float32) -> Any:
    """A member of all rows: ``(n, width)``, or ``(n,)`` for a width of 0."""
    values = np.empty(len(rows) * max(width, 1), kind)
    rows.foreach_get(member, values)
    return values.reshape(len(rows), width) if width else values


def _joined(pieces: list[Piece]) -> Sample:
    parts, faces, by_piece = [], [], []
    n_points = n_triangles = 0
    for piece in pieces:
        counts = piece.sizes - 2
        owner = np.repeat(np.arange(len(counts)), counts)
        rank = np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)
        first = (np.cumsum(piece.sizes) - piece.sizes)[owner]
        rows = np.stack([first, first + rank + 1, first + rank + 2], axis=1)
        faces.append(piece.corners[rows] + n_points)
        by_piece.append((owner, rows.reshape(-1)))
        ends = np.cumsum(counts)
        bounds = [0, *(np.flatnonzero(np.diff(piece.slots)) + 1), len(counts)]
        for low, high in pairwise(bounds):
            start = n_triangles + int(ends[low - 1] if low else 0)
            slot = int(piece.slots[low])
            vertices = (n_points, n_points + len(piece.points))
            parts.append((piece.name, vertices, (start, n_triangles + int(ends[high - 1])), None if slot < 0 else slot))
        n_points, n_triangles = n_points + len(piece.points), n_triangles + len(owner)
    joined = Sample(
        np.concatenate([piece.points for piece in pieces]),
        np.concatenate(faces).astype(np.int32),
        np.concatenate([piece.sizes for piece in pieces]),
        parts,
    )
    for name in dict.fromkeys(name for piece in pieces for name in piece.numbers):
        if (numbers := _of_all(name, pieces, by_piece)) is not None:
            joined.numbers[name] = numbers
    return joined


def _of_all(name: str, pieces: list[Piece], by_piece: list[tuple[Any, Any]]) -> Numbers | None:
    """Numbers of all pieces under one name; 0 where a piece has none, None where two pieces disagree in type or domain."""
    found = [piece.numbers[name] for piece in pieces if name in piece.numbers]
    forms = {(each.kind, each.rows.shape[1], each.rows.dtype) for each in found}
    domains = {each.domain for each in found}
    if len(forms) > 1 or (len(domains) > 1 and domains != {"vertex", "corner"}):
        return None
    domain = "corner" if "corner" in domains else found[0].domain
    rows = []
    for piece, (owner, corners) in zip(pieces, by_piece, strict=True):
        length = {"vertex": len(piece.points), "triangle": len(owner), "corner": len(corners)}[domain]
        own = piece.numbers.get(name)
        if own is None:
            rows.append(np.zeros((length, found[0].rows.shape[1]), found[0].rows.dtype))
        elif own.domain == "vertex":
            rows.append(own.rows if domain == "vertex" else own.rows[piece.corners[corners]])
        else:
            rows.append(own.rows[owner if domain == "triangle" else corners])
    return Numbers(domain, found[0].kind, np.concatenate(rows))
