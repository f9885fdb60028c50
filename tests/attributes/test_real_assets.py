"""Attributes of real meshes, where their folder stands beside the project: within bounds, and no larger than Draco's."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from folders import DATA, ROOT

from gvpipe.attributes.attribute_coding import decode_attribute, encode_attribute
from gvpipe.attributes.surface import Surface
from gvpipe.attributes.surface_normals import largest_error

sys.path.append(str(ROOT / "tools"))
from measure_attributes import draco_bytes, own_bytes, read_gltf

ASSETS = DATA / "assets" / "gltf"
FILES = ["CesiumMan_Binary/CesiumMan.glb", "Fox/Fox.glb", "gdx_pbrTest_8influences/pbrTest.gltf"]


@pytest.mark.slow
@pytest.mark.parametrize("name", FILES)
def test_attributes_come_back_within_bounds_and_take_fewer_bytes_than_draco(name: str) -> None:
    if not (ASSETS / name).exists():
        pytest.skip("no ../shared/data/assets")
    for mesh in read_gltf(ASSETS / name):
        surface = Surface(mesh.faces.astype(np.int32), len(mesh.positions), mesh.positions.astype(np.float32))
        for kind, values in mesh.attributes.items():
            bound = {"uv": 1 / 8192, "normal": 1.0, "tangent": 2.0, "color": 0.01}[kind]
            data = encode_attribute(values, None, surface, domain="vertex", kind=kind, bound=bound)
            decoded, _ = decode_attribute(data, surface, "x", domain="vertex")
            if kind in ("normal", "tangent"):
                assert largest_error(values[:, :3].astype(np.float64), decoded[:, :3]) <= bound
                assert np.array_equal(values[:, 3:], decoded[:, 3:])
            else:
                assert np.abs(values.astype(np.float64) - decoded).max() <= bound
            if kind == "tangent":
                continue  # Draco has none
            sharing, own, _ = own_bytes(mesh, kind)
            assert sharing + own <= draco_bytes(mesh, kind)
