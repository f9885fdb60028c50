"""Primitives in Draco's compression (KHR_draco_mesh_compression), decoded by DracoPy.

Source: Khronos, KHR_draco_mesh_compression; the bytes are those of Google's Draco library.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from gvpipe.foundation.arrays import Array, Int64
from gvpipe.io.gltf.accessors import WIDTHS, Accessors, as_fractions
from gvpipe.io.gltf.attribute_names import FLOATS, STORED, Read
from gvpipe.io.gltf.json_fields import Json, child, integer

BYTES_VERTEX = 64  # about what a decoded vertex or triangle takes


def decode_primitive(accessors: Accessors, draco: Json, names: Json, plain: Read, where: str) -> tuple[Read, Int64]:
    """How the attributes of a primitive are read, and the corners of its triangles ``(3 T,)``.

    Args:
        accessors: of the file.
        draco: the primitive's extension.
        names: the primitive's attributes, with their accessors.
        plain: how attributes that Draco does not hold are read.
        where: for messages.

    Raises:
        ValueError: Draco cannot decode it, or an attribute is missing.
    """
    import DracoPy

    counts = [accessors.count(integer(names, name, where)) for name in names]
    accessors.document.budget.spend(BYTES_VERTEX * max(counts, default=0), where)
    data = bytes(accessors.document.view(integer(draco, "bufferView", where)))
    try:
        decoded: Any = DracoPy.decode(data)
        corners = np.asarray(decoded.faces, np.int64).reshape(-1)
        arrays = {int(one["unique_id"]): np.asarray(one["data"]) for one in decoded.attributes}
    except Exception as exc:  # DracoPy's own, TypeError, bare ones; each means: damaged
        raise ValueError(f"{where} cannot be decoded by Draco: {' '.join(str(exc).split())[:100]}") from exc
    ids = child(draco, "attributes", where)

    def read(name: str, kinds: tuple[str, ...], form: str) -> Array:
        if name not in ids:
            return plain(name, kinds, form)
        number = integer(names, name, where)
        values = arrays.get(integer(ids, name, where))
        if values is None:
            raise ValueError(f"{where} has no {name} in its Draco data")
        values = values.reshape(len(values), -1)
        if values.shape[1] not in [WIDTHS[kind] for kind in kinds]:
            raise ValueError(f"{where} has {name} of {values.shape[1]} components; {' or '.join(kinds)} is needed")
        if values.dtype.kind == "u":  # some integers come back wider than they are
            values = values.astype(accessors.stored_type(number))
        if form != STORED and accessors.is_normalized(number):
            return as_fractions(values)
        return values.astype(np.float32) if form == FLOATS or values.dtype.kind == "f" else values

    return read, corners
