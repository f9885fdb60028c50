"""Attributes and fields as geometry parameters of an Alembic mesh."""

from __future__ import annotations

from typing import Any

import numpy as np

from gvpipe.foundation.arrays import Array, Int64
from gvpipe.io.scene.export import as_unit_range
from gvpipe.io.scene.mesh import Layer

SCOPES = {
    "constant": "kConstantScope",
    "polygon": "kUniformScope",
    "vertex": "kVertexScope",
    "corner": "kFacevaryingScope",
}
ARRAYS = {
    **{name: f"{name}Array" for name in ("C3f", "C4f", "V2f", "V3f", "Float")},
    "Int32": "IntArray",
    "N3f": "V3fArray",
}


def filled(kind: Any, values: Array) -> Any:
    """An array of the library's type with the values ``(n,)`` or ``(n, C)``; numpy shares the memory of most of them."""
    import imath

    if kind is imath.UnsignedIntArray:
        return kind(filled(imath.DoubleArray, values))
    if kind is imath.C3fArray:
        return kind(filled(imath.V3fArray, values))
    made = kind(len(values))
    if kind is imath.C4fArray:
        for number, channel in enumerate("rgba"):
            getattr(made, channel)[:] = filled(imath.FloatArray, values[:, number])
    elif len(values):
        np.asarray(made)[...] = values
    return made


class ParamWriter:
    """Writes the parameters of one mesh.

    Args:
        schema: of the mesh.
        order: of polygon corners in the file.
        sampling: times of fields.
    """

    def __init__(self, schema: Any, order: Int64, sampling: Any) -> None:
        self._schema, self._order, self._sampling = schema, order, sampling
        self._params: dict[str, Any] = {}

    def write(self, layer: Layer) -> None:
        """Write an attribute."""
        self.make(layer).set(self.sample(layer))

    def write_samples(self, name: str, kind: str, domain: str, block: Array) -> None:
        """Write the next frames ``(n, rows, C)`` of a field."""
        for frame in block:
            layer = Layer(name, kind, domain, frame)
            param = self._params.get(name)
            if param is None:
                param = self.make(layer)
                param.setTimeSampling(self._sampling)
                self._params[name] = param
            param.set(self.sample(layer))

    def sample(self, layer: Layer) -> Any:
        """A layer as the library's sample, its corners in the file's order."""
        import imath
        from alembic3d import AbcGeom

        name, array, values = param_types(layer.kind, layer.values)
        scope = getattr(AbcGeom.GeometryScope, SCOPES[layer.domain])
        kind: Any = getattr(AbcGeom, f"O{name}GeomParamSample")
        indices = layer.indices
        if layer.domain == "corner":
            indices = (np.arange(len(values)) if indices is None else indices)[self._order]
        made = filled(getattr(imath, array), values)
        if indices is None:
            return kind(made, scope)
        return kind(made, filled(imath.UnsignedIntArray, indices), scope)

    def nothing(self, name: str, domain: str, is_indexed: bool) -> Any:
        """A sample without values of a parameter: the library's name of its type, its domain, and whether it has indices."""
        import imath
        from alembic3d import AbcGeom

        scope = getattr(AbcGeom.GeometryScope, SCOPES[domain])
        kind: Any = getattr(AbcGeom, f"O{name}GeomParamSample")
        made = getattr(imath, ARRAYS[name])(0)
        return kind(made, imath.UnsignedIntArray(0), scope) if is_indexed else kind(made, scope)

    def make(self, layer: Layer) -> Any:
        """A parameter for samples of a layer's kind."""
        from alembic3d import AbcGeom

        name = param_types(layer.kind, layer.values)[0]
        scope = getattr(AbcGeom.GeometryScope, SCOPES[layer.domain])
        indexed = layer.indices is not None or layer.domain == "corner"
        held = self._schema.getArbGeomParams()
        param: Any = getattr(AbcGeom, f"O{name}GeomParam")(held, layer.name.replace("/", "_"), indexed, scope, 1)
        return param


def is_held(kind: str, width: int) -> bool:
    """Whether Alembic has parameters of that many numbers."""
    return width <= 3 or (kind == "color" and width == 4)


def param_types(kind: str, values: Array) -> tuple[str, str, Array]:
    """The library's name of a parameter, of the array that it takes, and the values as that array needs them."""
    width = values.shape[1]
    if kind == "color":
        return f"C{width}f", f"C{width}fArray", as_unit_range(values)
    if width == 1:
        if values.dtype.kind in "iu":
            return "Int32", "IntArray", values[:, 0].astype(np.int32)
        return "Float", "FloatArray", values[:, 0].astype(np.float32)
    if width == 2:
        return "V2f", "V2fArray", values.astype(np.float32)
    if width == 3:
        return ("N3f" if kind == "normal" else "V3f"), "V3fArray", values.astype(np.float32)
    raise ValueError(f"Alembic has no parameter of {width} numbers")
