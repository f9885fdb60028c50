"""Geometry parameters of an Alembic mesh as layers: texture coordinates, normals, colours, and numbers of other names."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np

from gvpipe.foundation.arrays import Array, Float64
from gvpipe.io.alembic.archive import Node
from gvpipe.io.alembic.numbers import as_integers, as_numbers
from gvpipe.io.scene.fields import Sampled
from gvpipe.io.scene.mesh import Layer, SceneMesh

SCOPES = {
    "kUniformScope": "polygon",
    "kVaryingScope": "vertex",
    "kVertexScope": "vertex",
    "kFacevaryingScope": "corner",
    "kConstantScope": "constant",
    "kUnknownScope": "constant",
}
READERS = {  # (type, components, interpretation): name of the library's class, kind
    ("float32_t", 2, ""): ("IV2fGeomParam", "vector"),
    ("float32_t", 2, "vector"): ("IV2fGeomParam", "uv"),
    ("float32_t", 3, "rgb"): ("IC3fGeomParam", "color"),
    ("float32_t", 4, "rgba"): ("IC4fGeomParam", "color"),
    ("float32_t", 3, "vector"): ("IV3fGeomParam", "vector"),
    ("float32_t", 3, "point"): ("IP3fGeomParam", "vector"),
    ("float32_t", 3, "normal"): ("IN3fGeomParam", "vector"),
    ("float32_t", 1, ""): ("IFloatGeomParam", "scalar"),
    ("float64_t", 1, ""): ("IDoubleGeomParam", "scalar"),
    ("int32_t", 1, ""): ("IInt32GeomParam", "label"),
}


def layers_of(
    schema: Any, polygons: SceneMesh, time: float, turn: Float64, last: float | None = None
) -> tuple[tuple[Layer, ...], list[str]]:
    """Return a mesh's layers at a time, and the names of what does not fit it.

    Args:
        schema: of a polygon mesh or a subdivision cage.
        polygons: the same mesh, without layers.
        time: of the first frame, seconds.
        last: time of the last frame: parameters that are the same in all frames stand still; None: no sample is compared.
        turn: ``(3, 3)`` how its directions turn into world space.
    """
    layers: list[Layer] = []
    left: list[str] = []
    if hasattr(schema, "getNormalsParam"):
        normals = _layer("normal", "normal", schema.getNormalsParam(), polygons, time)
        if normals is not None:
            layers.append(_turned(normals, turn))
    uv = _layer("uv", "uv", schema.getUVsParam(), polygons, time)
    layers.extend([uv] if uv is not None else [])
    changing = sampled_of(schema, polygons, time, last)
    for name, kind, param in _others(schema):
        if name in changing:
            continue
        if kind == "color":
            name = _numbered("color", layers)
        elif kind == "uv":
            name = _numbered("uv", layers)
        layer = _layer(name, kind, param, polygons, time)
        if layer is None:
            left.extend([name] if len(_values(param, time)) else [])  # nothing: a shot of a capture lacks it
        elif layer.domain != "constant" or kind == "color":
            layers.append(layer)
    return tuple(layers), left


def _labelled(schema: Any) -> list[tuple[str, str, str, Any]]:
    """What programs add, with the name of the field or attribute that it becomes."""
    colors = [name for name, kind, _ in _others(schema) if kind == "color"]
    labels = {name: f"color{number}" if number else "color" for number, name in enumerate(colors)}
    return [(labels.get(name, name), name, kind, param) for name, kind, param in _others(schema)]


def changing_normals(schema: Any) -> bool:
    """Whether a mesh has normals that change over time."""
    param = schema.getNormalsParam() if hasattr(schema, "getNormalsParam") else None
    return bool(param and param.valid() and param.getNumSamples() > 1 and not param.isConstant())


def sampled_of(schema: Any, polygons: SceneMesh, time: float, last: float | None = None) -> dict[str, Sampled]:
    """The parameters of a mesh that change over time and can be fields: per vertex or polygon, not indexed, no uv."""
    found: dict[str, Sampled] = {}
    for label, name, kind, param in _labelled(schema):
        if kind == "uv" or param.isIndexed() or not _varies(param, time, last):
            continue
        layer = _layer(name, kind, param, polygons, time)
        if layer is not None and layer.domain in ("vertex", "polygon"):
            found[label] = Sampled(Values(schema, param, layer.values.shape[1]), kind, layer.domain)
    return found


def _varies(param: Any, time: float, last: float | None) -> bool:
    """Whether a parameter changes; given a last time, whether it does until then."""
    count = param.getNumSamples()
    if count < 2 or param.isConstant():
        return False
    if last is None:
        return True
    sampling = param.getTimeSampling()
    first, stop = sampling.getNearIndex(time, count), sampling.getNearIndex(last, count)
    if first == stop:
        return False
    held = [_expanded(param, number) for number in range(first, stop + 1)]
    return any(not np.array_equal(held[0], each) for each in held[1:])


def _expanded(param: Any, number: int) -> Array:
    from alembic3d import Abc

    moment = float(param.getTimeSampling().getSampleTime(number))
    return as_numbers(param.getExpandedValue(Abc.ISampleSelector(moment)).getVals())


class Values:
    """The values of a parameter at the sample nearest to a time."""

    def __init__(self, schema: Any, param: Any, width: int) -> None:
        self._kept, self._param, self._width = schema, param, width

    def __call__(self, time: float) -> Array:
        from alembic3d import Abc

        values = as_numbers(self._param.getExpandedValue(Abc.ISampleSelector(float(time))).getVals())
        return values if self._width == 1 else values.reshape(len(values), -1)


def left_of(node: Node, fields: Collection[str], time: float, last: float | None) -> list[str]:
    """What a mesh has beside positions, polygons, layers and the fields of these names, by name."""
    schema, left = node.schema, []
    uv = schema.getUVsParam()
    moving = [("uv", uv)] if uv and uv.valid() else []
    moving += [(name, param) for label, name, _, param in _labelled(schema) if label not in fields]
    left += [f"animation of parameter {name}" for name, param in moving if _varies(param, time, last)]
    if schema.getVelocitiesProperty().valid():
        left.append("velocities")
    taken = {name for name, _, _ in _others(schema)}
    left += [f"parameter {name}" for name in _names(schema.getArbGeomParams()) if name not in taken]
    for each in (node, *node.parents):
        left += [f"user property {name}" for name in _names(each.schema.getUserProperties())]
    return left


def _names(held: Any) -> list[str]:
    """Names of the properties of a compound; none if it is not there."""
    if not (held and held.valid()):
        return []
    return [str(held.getPropertyHeader(number).getName()) for number in range(held.getNumProperties())]


def _others(schema: Any) -> list[tuple[str, str, Any]]:
    """Name, kind and parameter of what programs add to a mesh, as far as it is numbers."""
    from alembic3d import AbcGeom

    held = schema.getArbGeomParams()
    if not (held and held.valid()):
        return []
    found = []
    for number in range(held.getNumProperties()):
        header = held.getPropertyHeader(number)
        about = header.getMetaData()
        key = (about.get("podName"), int(about.get("podExtent") or 1), about.get("interpretation") or "")
        is_constant = (about.get("geoScope") or "con") == "con"
        if key not in READERS or (is_constant and key[2] not in ("rgb", "rgba")):
            continue  # constants are settings of programs, not numbers of the surface
        reader, kind = READERS[key]
        found.append((header.getName(), kind, getattr(AbcGeom, reader)(held, header.getName())))
    return found


def _layer(name: str, kind: str, param: Any, polygons: SceneMesh, time: float) -> Layer | None:
    """A parameter as a layer, or None if it is absent or has not the rows that its scope needs."""
    if not (param and param.valid() and param.getNumSamples()):
        return None
    from alembic3d import Abc

    value = param.getIndexedValue(Abc.ISampleSelector(time))
    values = as_numbers(value.getVals())
    values = values.reshape(len(values), -1) if values.size else values
    if not values.size or (values.dtype.kind == "f" and not np.isfinite(values).all()):
        return None
    if values.dtype.kind == "f":
        values = values.astype(np.float32)
    indices = as_integers(value.getIndices()) if param.isIndexed() else None
    if indices is not None and (not indices.size or indices.min() < 0 or indices.max() >= len(values)):
        return None
    domain = SCOPES[str(param.getScope()).rsplit(".", 1)[-1]]
    rows = len(values) if indices is None else len(indices)
    sizes = {"vertex": polygons.n_vertices, "corner": len(polygons.corners), "polygon": len(polygons.counts), "constant": rows}
    return Layer(name, kind, domain, values, indices) if rows == sizes[domain] else None


def _values(param: Any, time: float) -> Array:
    from alembic3d import Abc

    return as_numbers(param.getIndexedValue(Abc.ISampleSelector(time)).getVals())


def _turned(normals: Layer, turn: Float64) -> Layer:
    turned = normals.values @ np.linalg.pinv(turn).T
    length = np.linalg.norm(turned, axis=1, keepdims=True)
    unit: Array = np.asarray(turned / np.where(length > 0, length, 1), np.float32)
    return Layer(normals.name, normals.kind, normals.domain, unit, normals.indices)


def _numbered(stem: str, layers: list[Layer]) -> str:
    count = sum(layer.kind == stem for layer in layers)
    return f"{stem}{count}" if count else stem
