"""Primvars of a USD mesh as layers: texture coordinates, normals, colours, and numbers of other names."""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterable
from typing import Any

import numpy as np

from gvpipe.asset.attribute import MAX_COMPONENTS
from gvpipe.foundation.arrays import Array, Float64
from gvpipe.io.scene.fields import Sampled
from gvpipe.io.scene.mesh import Layer, SceneMesh

DOMAINS = {"constant": "constant", "uniform": "polygon", "varying": "vertex", "vertex": "vertex", "faceVarying": "corner"}
UV_NAME = re.compile(r"^(st|uv|map|uvmap|uvset|texcoord)[_\d]*$", re.IGNORECASE)
FIRST_UV = ("st", "map1", "uv", "UVMap", "st0")  # the main set's usual names, the commonest first
OWN = ("displayColor", "displayOpacity", "normals")  # they have a meaning of their own


def layers_of(
    mesh: Any, polygons: SceneMesh, time: float, turn: Float64, last: float | None = None
) -> tuple[tuple[Layer, ...], dict[str, str], list[str]]:
    """Return a mesh's layers, the attribute of each uv primvar by its name, and what was left out.

    Args:
        mesh: the UsdGeom.Mesh.
        polygons: the same mesh, without layers.
        time: of the first frame; primvars that change have their values then.
        last: time of the last frame: primvars that are the same in all frames stand still; None: no sample is compared.
        turn: ``(3, 3)`` or ``(n, 3, 3)`` how its directions turn into world space.
    """
    from pxr import UsdGeom

    api = UsdGeom.PrimvarsAPI(mesh.GetPrim())
    primvars = {
        each.GetPrimvarName(): each
        for each in api.FindPrimvarsWithInheritance()
        if each.HasValue() and not _is_blocked(each, time)
    }
    layers: list[Layer] = []
    left: list[str] = []
    normals = _normals(mesh, primvars.get("normals"), polygons, time, turn)
    layers.extend([normals] if normals else [])
    uv_names = sorted((name for name, each in primvars.items() if _is_uv(name, each)), key=_uv_rank)
    named_uv = {name: "uv" if not number else f"uv{number}" for number, name in enumerate(uv_names)}
    sampled = sampled_of(mesh, polygons, time, last)
    n_colors = 0
    for name, primvar in sorted(primvars.items(), key=lambda item: item[0] != "displayColor"):
        kind = "uv" if name in named_uv else _kind(primvar)
        if name.startswith("skel:") or (name in OWN and name != "displayColor") or kind is None:
            continue
        if is_passed_over(primvar):
            continue
        if name in sampled or (name == "displayColor" and "color" in sampled):
            continue
        layer = _layer(named_uv.get(name, name), kind, primvar, polygons, time)
        if layer is None or layer.values.shape[1] > MAX_COMPONENTS:
            left.append(name)
            continue
        if kind == "color":
            layer = _with_opacity(layer, primvars.get("displayOpacity"), polygons, time) if name == "displayColor" else layer
            layer = Layer("color" if not n_colors else f"color{n_colors}", kind, layer.domain, layer.values, layer.indices)
            n_colors += 1
        layers.append(layer)
    return tuple(layers), named_uv, left


def is_passed_over(primvar: Any) -> bool:
    """Whether a primvar is no number of the surface: a setting of programs, one for the whole mesh, or a text."""
    name = primvar.GetPrimvarName()
    if name == "displayOpacity":
        return not _has_place(primvar)
    if name.startswith("skel:") or name in OWN:
        return False
    return primvar.GetInterpolation() == "constant" or _kind(primvar) is None


def _has_place(opacity: Any) -> bool:
    """Whether opacities become the fourth number of colours: of static ones with as many rows."""
    from pxr import UsdGeom

    color = UsdGeom.PrimvarsAPI(opacity.GetAttr().GetPrim()).FindPrimvarWithInheritance("displayColor")
    if not color or not color.HasValue():
        return _is_opaque(opacity)
    is_still = not color.ValueMightBeTimeVarying() or color.GetInterpolation() not in ("vertex", "varying", "uniform")
    fits = opacity.GetInterpolation() in (color.GetInterpolation(), "constant")
    return (is_still and fits) or _is_opaque(opacity)


def _is_opaque(opacity: Any) -> bool:
    return bool((np.array(opacity.Get() or 1.0) == 1).all())


def sampled_of(mesh: Any, polygons: SceneMesh, time: float, last: float | None = None) -> dict[str, Sampled]:
    """The primvars of a mesh that change and can be fields: per vertex or polygon, neither uv nor normals, not indexed."""
    from pxr import UsdGeom

    found = {}
    for primvar in UsdGeom.PrimvarsAPI(mesh.GetPrim()).GetPrimvarsWithValues():
        name, kind, domain = primvar.GetPrimvarName(), _kind(primvar), DOMAINS[primvar.GetInterpolation()]
        if (
            kind is None
            or domain not in ("vertex", "polygon")
            or name in OWN[1:]
            or name.startswith("skel:")
            or _is_uv(name, primvar)
        ):
            continue
        if _varies(primvar, time, last) and not primvar.IsIndexed() and primvar.GetElementSize() == 1:
            layer = _layer(name, kind, primvar, polygons, time)
            if layer is not None:
                found["color" if name == "displayColor" else name] = Sampled(Values(primvar), kind, domain)
    return found


def animated_primvars(meshes: Iterable[Any], time: float, last: float | None = None) -> set[str]:
    """Names of primvars of some meshes that change over time, as fields would have them; normals follow their mesh."""
    from pxr import UsdGeom

    found = {
        str(primvar.GetPrimvarName())
        for mesh in meshes
        for primvar in UsdGeom.PrimvarsAPI(mesh.GetPrim()).GetPrimvarsWithValues()
        if _varies(primvar, time, last)
    }
    return {"color" if name == "displayColor" else name for name in found - {"normals"} if not name.startswith("skel:")}


def _varies(primvar: Any, time: float, last: float | None) -> bool:
    """Whether a primvar changes; given a last time, whether it does until then."""
    if not primvar.ValueMightBeTimeVarying() or last is None:
        return bool(primvar.ValueMightBeTimeVarying())
    parts = [primvar.GetAttr(), *([primvar.GetIndicesAttr()] if primvar.IsIndexed() else [])]
    return any(varies_in(part, (time, last)) for part in parts)


def varies_in(attribute: Any, span: tuple[float, float] | None) -> bool:
    """Whether an attribute may change over time; given a first and a last time, whether it does from the one to the other."""
    if not attribute.ValueMightBeTimeVarying() or span is None:
        return bool(attribute.ValueMightBeTimeVarying())
    samples = attribute.GetTimeSamples()
    moments = samples[bisect_right(samples, span[0]) : bisect_right(samples, span[1] + 1e-6)]
    first = attribute.Get(span[0]) if moments else None
    return any(attribute.Get(moment) != first for moment in moments)


def _is_blocked(primvar: Any, time: float) -> bool:
    """Whether a primvar that changes has no value at a time."""
    return bool(primvar.ValueMightBeTimeVarying() and primvar.Get(time) is None)


class Values:
    """The values of a primvar at a time code."""

    def __init__(self, primvar: Any) -> None:
        self._primvar = primvar
        self._stage = primvar.GetAttr().GetStage()  # primvars do not keep their stage alive

    def __call__(self, time: float) -> Array:
        return np.array(self._primvar.Get(time))


def _normals(mesh: Any, primvar: Any, polygons: SceneMesh, time: float, turn: Float64) -> Layer | None:
    """Normals in world space; a primvar of that name comes before the attribute."""
    if primvar is not None:
        layer = _layer("normal", "normal", primvar, polygons, time)
    else:
        values = mesh.GetNormalsAttr().Get(time)
        if not values:
            return None
        domain = DOMAINS[mesh.GetNormalsInterpolation()]
        layer = _fitting(Layer("normal", "normal", domain, np.array(values, np.float32)), polygons)
    if layer is None or layer.values.shape[1] != 3:
        return None
    if turn.ndim == 2:
        turned = layer.values @ np.linalg.pinv(turn).T
        return Layer("normal", "normal", layer.domain, _unit(turned), layer.indices)
    if layer.domain not in ("vertex", "corner"):
        return None
    rows = layer.values if layer.indices is None else layer.values[layer.indices]
    vertices = np.arange(len(rows)) if layer.domain == "vertex" else polygons.corners
    turned = np.einsum("rk,rjk->rj", rows.astype(np.float64), np.linalg.pinv(turn)[vertices])
    return Layer("normal", "normal", layer.domain, _unit(turned))


def _layer(name: str, kind: str, primvar: Any, polygons: SceneMesh, time: float) -> Layer | None:
    values = np.array(primvar.Get(time))
    if values.dtype.kind not in "fiub" or not values.size:
        return None
    if values.dtype.kind == "f":
        values = values.astype(np.float32)
        if not np.isfinite(values).all():
            return None
    if primvar.GetElementSize() > 1 and values.ndim == 1:
        values = values.reshape(-1, primvar.GetElementSize()) if len(values) % primvar.GetElementSize() == 0 else values
    values = values.reshape(1, -1) if not primvar.GetTypeName().isArray else values.reshape(len(values), -1)
    indices = primvar.GetIndicesAttr().Get(time) if primvar.IsIndexed() else None  # None where they are blocked
    own = None if indices is None else np.array(indices, np.int64)
    if own is not None and (own.min(initial=0) < 0 or own.max(initial=0) >= len(values)):
        return None
    return _fitting(Layer(name, kind, DOMAINS[primvar.GetInterpolation()], values, own), polygons)


def _fitting(layer: Layer, polygons: SceneMesh) -> Layer | None:
    """The layer, if it has the rows that its domain needs; constant values may have any number, and the first counts."""
    rows = len(layer.values) if layer.indices is None else len(layer.indices)
    sizes = {"vertex": polygons.n_vertices, "corner": len(polygons.corners), "polygon": len(polygons.counts), "constant": 1}
    if layer.domain == "constant" and rows:
        return layer
    return layer if rows == sizes[layer.domain] else None


def _with_opacity(color: Layer, primvar: Any, polygons: SceneMesh, time: float) -> Layer:
    """Colours with the opacities beside them as a fourth component, if those have rows of the same kind."""
    opacity = _layer("", "scalar", primvar, polygons, time) if primvar is not None else None
    if opacity is None or opacity.domain not in (color.domain, "constant"):
        return color
    rows = _expanded(color)
    alpha = np.broadcast_to(_expanded(opacity)[:1] if opacity.domain == "constant" else _expanded(opacity), (len(rows), 1))
    return Layer(color.name, color.kind, color.domain, np.concatenate([rows, alpha], axis=1).astype(np.float32))


def _expanded(layer: Layer) -> Array:
    return layer.values if layer.indices is None else layer.values[layer.indices]


def _kind(primvar: Any) -> str | None:
    """The kind of a primvar by its type and role, or None for what is no number of the surface."""
    kind = str(primvar.GetTypeName())
    plain = kind.removesuffix("[]")
    if plain.startswith(("color3", "color4")):
        return "color"
    if plain in ("int", "uint", "uchar", "bool"):
        return "label"
    if plain in ("float", "double", "half"):
        return "scalar"
    return "vector" if re.fullmatch(r"(float|double|half|int|vector|normal|point|texCoord)[234][fdhi]?", plain) else None


def _is_uv(name: str, primvar: Any) -> bool:
    plain = str(primvar.GetTypeName()).removesuffix("[]")
    return plain.startswith("texCoord2") or (plain in ("float2", "double2", "half2") and bool(UV_NAME.match(name)))


def _uv_rank(name: str) -> tuple[int, str]:
    return (FIRST_UV.index(name) if name in FIRST_UV else len(FIRST_UV), name)


def _unit(vectors: Float64) -> Array:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(vectors / np.where(length > 0, length, 1), np.float32)
