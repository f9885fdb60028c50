"""Skins: the joints that bend a mesh, and the matrices that take the mesh's rest pose to each joint's own space.

Source: Khronos, glTF 2.0 specification, section 3.7.3 (skins).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gvpipe.foundation.arrays import Float64, Int64
from gvpipe.io.gltf.accessors import Accessors
from gvpipe.io.gltf.json_fields import indices, integer


@dataclass(frozen=True, eq=False)
class Skin:
    """A skin of J joints.

    Args:
        joints: ``(J,)`` nodes.
        inverse_binds: ``(J, 4, 4)``.
    """

    joints: Int64
    inverse_binds: Float64


def read_skin(accessors: Accessors, number: int) -> Skin:
    """Read a skin; raises `ValueError`."""
    skin, where = accessors.document.item("skins", number)
    joints = np.array(indices(skin, "joints", where, len(accessors.document.items("nodes"))), np.int64)
    if not len(joints):
        raise ValueError(f"{where} has no joints")
    binds = np.tile(np.eye(4), (len(joints), 1, 1))
    if "inverseBindMatrices" in skin:
        given = accessors.read(integer(skin, "inverseBindMatrices", where), ("MAT4",), f"{where}, inverseBindMatrices")
        if len(given) < len(joints):
            raise ValueError(f"{where} has {len(joints)} joints, but {len(given)} inverse bind matrices")
        binds = given[: len(joints)].astype(np.float64).reshape(-1, 4, 4).transpose(0, 2, 1)  # stored by columns
        if not np.isfinite(binds).all():
            raise ValueError(f"{where} has an inverse bind matrix that is not finite")
    return Skin(joints, binds)
