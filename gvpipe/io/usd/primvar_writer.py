"""Attributes and fields as primvars of a USD mesh."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from gvpipe.asset.attribute import Attribute
from gvpipe.asset.field import Field
from gvpipe.foundation.arrays import Array
from gvpipe.io.scene.export import ExportMesh, as_unit_range, export_layer
from gvpipe.io.scene.mesh import Layer
from gvpipe.io.usd.primvars import UV_NAME

INTERPOLATIONS = {"constant": "constant", "polygon": "uniform", "vertex": "vertex", "corner": "faceVarying"}
TAKEN = ("displayColor", "displayOpacity", "normals")  # names that have a meaning, for what does not have it
BYTES = 16 << 20  # of a field's frames at a time


def primvar_names(named: Mapping[str, Attribute | Field]) -> dict[str, str]:
    """Names of primvars: ``st`` and ``normals`` for what they mean; others keep theirs, but for what USD does not allow.

    A name that would mean something else in USD gets ``own_`` before it. No two are the same.

    Examples:
        >>> import numpy as np
        >>> heat = Field(np.zeros((1, 1)))
        >>> primvar_names({"uv": Attribute(np.zeros((1, 2)), "vertex", "uv"), "st": heat, "von mises": heat})
        {'uv': 'st', 'st': 'own_st', 'von mises': 'von_mises'}
    """
    from pxr import Tf

    result: dict[str, str] = {}
    for name, one in sorted(named.items(), key=lambda item: item[1].kind not in ("uv", "normal", "color")):
        if one.kind == "uv" and name.startswith("uv"):
            plain = f"st{name[2:]}"
        elif (name, one.kind) == ("normal", "normal"):
            plain = "normals"
        elif (name, one.kind) == ("color", "color"):
            plain = "displayColor"
        else:
            plain = str(Tf.MakeValidIdentifier(name))
            means_more = UV_NAME.fullmatch(plain) and one.kind != "uv"
            plain = f"own_{plain}" if means_more or plain in TAKEN or plain.startswith("skel") else plain
        free, number = plain, 1
        while free in result.values():
            free, number = f"{plain}_{number}", number + 1
        result[name] = free
    return {name: result[name] for name in named}


def write_primvars(drawn: Any, mesh: ExportMesh, attributes: Mapping[str, Attribute], names: Mapping[str, str]) -> list[str]:
    """Write a mesh's attributes under their names in USD; returns notes."""
    said: list[str] = []
    for name, attribute in attributes.items():
        layer = export_layer(name, attribute, mesh)
        if not len(layer.values):
            continue
        if names[name] == "displayColor":
            _write_color(drawn, layer)
        else:
            _write(drawn, names[name], layer, layer.values)
        if attribute.domain == "triangle" and mesh.counts.max(initial=3) > 3:
            said.append(f"{name} is per triangle; USD has it per polygon, so that of the first triangle was written")
    return said


def write_field(name: str, field: Field, meshes: list[tuple[Any, ExportMesh]], start: float) -> None:
    """Write a field as a primvar of a name, with a sample per frame, a bounded number of frames at a time."""
    domain = {"vertex": "vertex", "triangle": "polygon"}[field.domain]
    step = max(1, BYTES // (4 * field.shape[1] * field.n_components))
    for first in range(0, len(field), step):
        block = field.read(first, min(first + step, len(field)))
        for drawn, mesh in meshes:
            rows = slice(*mesh.vertices) if domain == "vertex" else mesh.triangles[0] + _first_triangles(mesh)
            for i, frame in enumerate(block):
                layer = Layer(name, field.kind, domain, frame[rows])
                _write(drawn, name, layer, layer.values, start + first + i)


def write_normals(drawn: Any, layer: Layer, time: float | None) -> None:
    """Write normals at a time code, None for all times; where they are indexed, the indices are those of every time."""
    _write(drawn, "normals", layer, layer.values, time)


def _write_color(drawn: Any, layer: Layer) -> None:
    colors = as_unit_range(layer.values)
    _write(drawn, "displayColor", layer, colors[:, :3])
    if colors.shape[1] == 4:
        _write(drawn, "displayOpacity", Layer("", "scalar", layer.domain, colors[:, 3:], layer.indices), colors[:, 3:])


def _write(drawn: Any, name: str, layer: Layer, values: Array, time: float | None = None) -> None:
    from pxr import Sdf, Usd, UsdGeom, Vt

    if layer.kind == "color":
        values = as_unit_range(values)
    type_name, made, size = _typed(layer.kind, values)
    if name == "displayOpacity":
        type_name = "float[]"
    api = UsdGeom.PrimvarsAPI(drawn.GetPrim())
    primvar = api.CreatePrimvar(name, getattr(Sdf.ValueTypeNames, _python_name(type_name)), INTERPOLATIONS[layer.domain], size)
    primvar.Set(made, Usd.TimeCode.Default() if time is None else Usd.TimeCode(time))
    if layer.indices is not None:
        primvar.SetIndices(Vt.IntArray.FromNumpy(layer.indices.astype(np.int32)))


def _typed(kind: str, values: Array) -> tuple[str, Any, int]:
    """USD's type of some values, the values as its array, and how many of them are an element."""
    from pxr import Vt

    width = values.shape[1]
    if values.dtype.kind in "iu" and width == 1 and kind != "color":
        return "int[]", Vt.IntArray.FromNumpy(np.ascontiguousarray(values[:, 0], np.int32)), 1
    floats = np.ascontiguousarray(values, np.float32)
    if width == 1 or width > 4:
        return "float[]", Vt.FloatArray.FromNumpy(floats.reshape(-1)), width
    array = {2: Vt.Vec2fArray, 3: Vt.Vec3fArray, 4: Vt.Vec4fArray}[width].FromNumpy(floats)
    named = {("uv", 2): "texCoord2f[]", ("normal", 3): "normal3f[]", ("color", 3): "color3f[]", ("color", 4): "color4f[]"}
    return named.get((kind, width), {2: "float2[]", 3: "float3[]", 4: "float4[]"}[width]), array, 1


def _python_name(type_name: str) -> str:
    """``texCoord2f[]`` as the library's Python names it: ``TexCoord2fArray``."""
    plain = type_name.removesuffix("[]")
    return f"{plain[0].upper()}{plain[1:]}Array"


def _first_triangles(mesh: ExportMesh) -> Array:
    counts = mesh.counts.astype(np.int64) - 2
    return np.asarray(np.cumsum(counts) - counts)
