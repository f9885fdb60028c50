from __future__ import annotations

from typing import Any

import pytest

from gvpipe.asset.material import Material, Texture
from gvpipe.asset.metadata import Metadata
from gvpipe.asset.part import Part
from gvpipe.asset_coding.directory import Directory, Listed, ListedImage, pack_directory, unpack_directory
from gvpipe.container.json_object import pack_json
from gvpipe.foundation.errors import CorruptFile, InputError

WHOLE = Directory(
    parts=(Part("a", (0, 4), (0, 0), 1), Part("ü", (4, 9), (0, 0), None, "a")),
    geometry=True,
    attributes=(Listed("uv", "uv", "corner", 2, "float32", "", 0.001, 1, "attribute.0"),),
    fields=(Listed("stress", "scalar", "vertex", 0, "float32", "MPa", 0.1, 1, "field.0", (-1.5, 2.0)),),
    materials=(
        Material("plain"),
        Material(
            "all",
            (0.1, 0.2, 0.3, 0.4),
            Texture(0, "uv1", 0.5, ("mirror", "clamp"), "nearest", (0.1, 0.2), 0.3, (2.0, 3.0)),
            normal_texture=Texture(0),
            metallic=0.5,
            roughness=0.25,
            emissive=(1.0, 0.0, 2.5),
            alpha_mode="mask",
            alpha_cutoff=0.3,
            double_sided=True,
            unlit=True,
        ),
    ),
    images=(ListedImage("skin", "image/png", "image.0"),),
    metadata=Metadata("z", 0.01, -1.5, "somewhere", {"author": "me"}),
)


@pytest.mark.parametrize("directory", [WHOLE, Directory()])
def test_what_is_packed_is_unpacked(directory: Directory) -> None:
    assert unpack_directory(pack_directory(directory, 9), 9) == directory


def test_a_newer_version_is_told_apart() -> None:
    assert unpack_directory(pack_json({"version": 2, "parts": "?"}), 9) == Directory(version=2)
    assert unpack_directory(pack_json({"version": 2}), 9).version == 2


@pytest.mark.parametrize(
    "values",
    [
        {},
        {"version": 0},
        {"version": 1, "parts": [{"name": "a", "vertices": [0, 10], "material": None}]},
        {"version": 1, "parts": [{"name": "a", "vertices": [5, 4], "material": None}]},
        {"version": 1, "parts": [{"name": "a", "vertices": [0, 4], "material": 0}]},
        {"version": 1, "parts": [{"name": 5, "vertices": [0, 4], "material": None}]},
        {"version": 1, "attributes": [{"name": "uv", "kind": "uvw"}]},
        {"version": 1, "materials": [{"base_color": [1, 1, 1]}]},
        {"version": 1, "materials": [{"base_color_texture": {"image": 0}}]},
        {"version": 1, "materials": [{"roughness": 1e300}]},
        {"version": 1, "materials": [{"double_sided": 1}]},
        {"version": 1, "metadata": {"up_axis": "w"}},
        {"version": 1, "metadata": {"metres_per_unit": 0}},
        {"version": 1, "metadata": {"texts": {"a": 1}}},
    ],
)
def test_what_cannot_be_is_corrupt(values: dict[str, Any]) -> None:
    plain = {"parts": [], "geometry": False, "attributes": [], "fields": [], "materials": [], "images": [], "metadata": {}}
    with pytest.raises(CorruptFile, match="section 'asset'"):
        unpack_directory(pack_json({**plain, **values}), 9)


def test_two_of_one_name_are_corrupt() -> None:
    twice = Directory(attributes=(WHOLE.attributes[0], WHOLE.attributes[0]))
    with pytest.raises(InputError, match="one name"):
        pack_directory(twice, 9)
