"""Materials, parts and metadata as JSON's objects, and objects that are none of these."""

from __future__ import annotations

import json
from typing import Any

import pytest
from assets import asset

from gvpipe.asset.material import Material, Texture
from gvpipe.asset.metadata import Metadata
from gvpipe.asset.part import Part
from gvpipe.asset.plain import from_plain, to_plain
from gvpipe.foundation.errors import InputError

TEXTURE = Texture(3, "uv1", 0.5, ("mirror", "clamp"), "nearest", (0.25, 1.0), 1.5, (2.0, 3.0))
ALL = (
    *asset().materials,
    *asset().parts,
    asset().metadata,
    Metadata(),
    Part("", (0, 1), (2, 3)),
    Material(occlusion_texture=TEXTURE, double_sided=True, unlit=True, alpha_mode="mask", alpha_cutoff=0.25),
)


@pytest.mark.parametrize("given", ALL, ids=lambda given: type(given).__name__)
def test_what_is_written_is_read(given: Any) -> None:
    assert from_plain(type(given), json.loads(json.dumps(to_plain(given))), "it") == given


WRONG = {
    "no object": (Material, [], "it is []; an object is needed"),
    "unknown": (Material, {"shine": 1}, "it has 'shine', which a Material has not"),
    "missing": (Part, {"name": "a", "vertices": [0, 1]}, "it lacks 'triangles'"),
    "text": (Material, {"name": 3}, "it: name is 3; a value of type str"),
    "truth": (Material, {"unlit": 1}, "it: unlit is 1; a value of type bool"),
    "number": (Material, {"metallic": True}, "it: metallic is True; a finite number is needed"),
    "infinite": (Material, {"metallic": float("inf")}, "it: metallic is inf; a finite number is needed"),
    "length": (Material, {"emissive": [1, 2]}, "it: emissive is [1, 2]; 3 values are needed"),
    "inside": (
        Material,
        {"normal_texture": {"image": 0, "wrap": ["repeat", 1]}},
        "it: normal_texture: wrap is 1; a value of type str",
    ),
    "large": (
        Part,
        {"name": "", "vertices": [0, 1 << 40]},
        "it: vertices is 1099511627776; a value of type int",
    ),
    "texts": (Metadata, {"texts": {"a": 1}}, "texts are not all texts by name"),
}


@pytest.mark.parametrize(("kind", "given", "message"), WRONG.values(), ids=WRONG.keys())
def test_what_is_wrong_is_said(kind: type[Any], given: Any, message: str) -> None:
    with pytest.raises(InputError) as error:
        from_plain(kind, given, "it")
    assert message in str(error.value)
