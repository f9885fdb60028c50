"""Meshes that a node shows several times, each with a transform of its own.

Source: Khronos, EXT_mesh_gpu_instancing.
"""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Float64
from gvpipe.io.gltf.accessors import Accessors
from gvpipe.io.gltf.json_fields import Json, child, extension, index
from gvpipe.io.gltf.nodes import compose, normalized

EXTENSION = "EXT_mesh_gpu_instancing"
DEFAULTS = {"TRANSLATION": [0.0, 0.0, 0.0], "ROTATION": [0.0, 0.0, 0.0, 1.0], "SCALE": [1.0, 1.0, 1.0]}


def read_instances(accessors: Accessors, node: Json, where: str) -> list[Float64 | None]:
    """What is done before the node's own transform, ``(4, 4)`` for each instance; ``[None]`` for a node without.

    Raises:
        ValueError: the instances' numbers cannot be.
    """
    given = child(extension(node, EXTENSION, where), "attributes", where)
    arrays: dict[str, Float64] = {}
    for name, default in DEFAULTS.items():
        number = index(given, name, f"{where}, instances", len(accessors.document.items("accessors")))
        if number is not None:
            kind = "VEC4" if len(default) == 4 else "VEC3"
            arrays[name] = accessors.read_floats(number, (kind,), f"{where}, instances, {name}").astype(np.float64)
    counts = {len(values) for values in arrays.values()}
    if not counts:
        return [None]
    if len(counts) > 1:
        raise ValueError(f"{where} has {sorted(counts)} translations, rotations and scales of instances; they must be as many")
    n = counts.pop()
    accessors.document.budget.spend(128 * n, f"{where}, instances")
    every = {name: arrays.get(name, np.tile(default, (n, 1))) for name, default in DEFAULTS.items()}
    matrices = compose(every["TRANSLATION"], normalized(every["ROTATION"]), every["SCALE"])
    if not np.isfinite(matrices).all():
        raise ValueError(f"{where} has instances that are not finite")
    return list(matrices)
