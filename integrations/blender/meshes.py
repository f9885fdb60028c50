"""From a shot to a mesh of Blender: polygons, static attributes, and the numbers of a frame."""

from __future__ import annotations

from math import radians
from typing import Any

import numpy as np

from .sources import Source, Surface

SHARP = radians(45)  # edges whose faces stand at more are drawn sharp
DOMAINS = {"vertex": "POINT", "corner": "CORNER", "triangle": "FACE", "part": "FACE"}
TAKEN = ("position", "material_index", "sharp_face", "sharp_edge", "custom_normal")  # names that mean something to Blender
TYPES = {1: ("FLOAT", "value"), 2: ("FLOAT2", "vector"), 3: ("FLOAT_VECTOR", "vector"), 4: ("FLOAT_COLOR", "color")}


def build(mesh: Any, source: Source, shot: int, parts: tuple[int, ...], frame: int, up: str, scale: float) -> Surface:
    """Replace what a mesh has by a shot's polygons, attributes, and its own frame ``frame``; slots of materials stay."""
    sequence, surface = source.shot(shot), source.surface(shot, parts)
    mesh.clear_geometry()
    mesh.vertices.add(surface.stop - surface.first)
    mesh.loops.add(len(surface.corners))
    mesh.polygons.add(len(surface.sizes))
    mesh.loops.foreach_set("vertex_index", surface.corners.astype(np.int32))
    mesh.polygons.foreach_set("loop_start", (np.cumsum(surface.sizes) - surface.sizes).astype(np.int32))
    mesh.polygons.foreach_set("use_smooth", np.ones(len(surface.sizes), bool))
    _set_materials(mesh, sequence, surface)
    for name, attribute in sequence.attributes.items():
        _add_attribute(mesh, attribute_name(name), attribute, surface, bool(sequence.materials))
    positions = source.positions(source.capture.starts[shot] + frame)[2]
    show(mesh, source, surface, shot, frame, source.turned(positions[surface.first : surface.stop], up, scale), True)
    mesh.update(calc_edges=True)
    mesh.set_sharp_from_angle(angle=SHARP)
    return surface


def show(mesh: Any, source: Source, surface: Surface, shot: int, own: int, points: Any, with_fields: bool) -> None:
    """Set the positions ``points`` ``(n, 3) float32`` of a mesh, and its fields, to those of the shot's frame ``own``."""
    mesh.attributes["position"].data.foreach_set("vector", points.reshape(-1))
    if with_fields:
        for name, field in source.shot(shot).fields.items():
            if field.kind not in ("normal", "tangent") and field.n_components in TYPES:
                values = field.read(own, own + 1)[0]
                is_point = field.domain == "vertex"
                rows = values[surface.first : surface.stop] if is_point else values[surface.triangles]
                _set(mesh, attribute_name(name), "POINT" if is_point else "FACE", rows, field.kind == "color")
    mesh.update()


def attribute_name(name: str) -> str:
    """A name that Blender does not use itself."""
    return f"{name[:48]}_" if name in TAKEN or name.startswith(".") else name[:48]


def skipped(sequence: Any) -> list[str]:
    """Names of attributes and fields that a mesh of Blender has no place for."""
    names = [name for name, each in sequence.attributes.items() if each.shape[1] not in TYPES]
    return names + [name for name, each in sequence.fields.items() if each.n_components not in TYPES]


def _set_materials(mesh: Any, sequence: Any, surface: Surface) -> None:
    """Give each polygon the slot of its part's material; slots are as `importing.add_slots` makes them."""
    if not sequence.parts:
        return
    slots = [-1 if part.material is None else part.material for part in sequence.parts]
    used = sorted({slots[number] for number in np.unique(surface.parts)})
    slot_of = np.array([used.index(each) if each in used else 0 for each in slots])
    mesh.polygons.foreach_set("material_index", slot_of[surface.parts].astype(np.int32))


def _add_attribute(mesh: Any, name: str, attribute: Any, surface: Surface, is_linear: bool) -> None:
    rows, width, kind = np.asarray(attribute), attribute.shape[1], attribute.kind
    if kind in ("normal", "tangent") or width not in TYPES:
        return  # Blender makes normals from the positions of every frame
    if attribute.domain == "vertex":
        rows = rows[surface.first : surface.stop]
        corner_values = rows[surface.corners] if kind == "uv" else None
    elif attribute.domain == "corner":
        corner_values = rows = rows[surface.corner_rows]
    else:
        rows = rows[surface.triangles if attribute.domain == "triangle" else surface.parts]
        corner_values = np.repeat(rows, surface.sizes, axis=0)
    if kind == "uv":
        layer = mesh.uv_layers.new(name=name, do_init=False)
        if layer is not None:  # 8 are the most
            layer.uv.foreach_set("vector", np.ascontiguousarray(corner_values, np.float32).reshape(-1))
        return
    if kind == "color":
        rows = _as_color(rows, is_linear)
        if attribute.domain in ("triangle", "part"):  # colours of faces are none of Blender's
            rows = np.repeat(rows, surface.sizes, axis=0)
        domain = "POINT" if attribute.domain == "vertex" else "CORNER"
        _set(mesh, name, domain, rows, True)
        if mesh.color_attributes.active_color is None and mesh.color_attributes.get(name):
            mesh.color_attributes.active_color = mesh.color_attributes[name]
        return
    _set(mesh, name, DOMAINS[attribute.domain], rows, False)


def _as_color(rows: Any, is_linear: bool) -> Any:
    """Colours 0..1 in linear light. Whole numbers are linear beside materials, else sRGB, as gvpipe's renderer has them."""
    if rows.dtype.kind == "f":
        return rows
    values = rows.astype(np.float32) / np.iinfo(rows.dtype).max
    if not is_linear:
        light = np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)
        values[:, :3] = light[:, :3]
    return values


def _set(mesh: Any, name: str, domain: str, rows: Any, is_color: bool) -> None:
    """Set an attribute, made if it is not there, to ``rows`` ``(n, C)``."""
    width = rows.shape[1]
    if is_color:
        rows = np.concatenate([rows[:, :3], rows[:, 3:] if width == 4 else np.ones((len(rows), 1), rows.dtype)], axis=1)
        width = 4
    kind, member = TYPES[width]
    if width == 1 and rows.dtype.kind in "iu" and rows.dtype.itemsize <= 4:
        kind = "INT"
    found = mesh.attributes.get(name)
    if found is not None and (found.data_type != kind or found.domain != domain):
        if getattr(found, "is_required", False) or name in mesh.uv_layers:
            return
        mesh.attributes.remove(found)
        found = None
    found = found or mesh.attributes.new(name, kind, domain)
    numbers = rows.astype(np.int32 if kind == "INT" else np.float32, copy=False)
    mesh.attributes[found.name].data.foreach_set(member, np.ascontiguousarray(numbers).reshape(-1))
