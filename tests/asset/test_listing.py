from __future__ import annotations

import io
import json

import numpy as np
from PIL import Image as Pillow

from gvpipe.asset.listing import Things, count_polygons, list_things
from gvpipe.asset.material import Image, Material
from gvpipe.asset.metadata import NO_METADATA
from gvpipe.asset.part import Part


def png() -> bytes:
    file = io.BytesIO()
    Pillow.new("RGB", (3, 2)).save(file, "PNG")
    return file.getvalue()


def test_all_things_are_json() -> None:
    parts = (Part("leg", (0, 5), (0, 3), 1, "body"), Part("arm", (5, 8), (3, 4)))
    images = (Image("a", "image/png", png()),)
    polygons = np.array([4, 3, 3], np.int32)
    values = list_things(Things(parts, count_polygons(polygons), (Material("wood"), Material("iron")), images, NO_METADATA))
    assert json.loads(json.dumps(values)) == values
    assert values["parts"] == [
        {"name": "leg", "vertices": [0, 5], "triangles": [0, 3], "material": "iron", "parent": "body"},
        {"name": "arm", "vertices": [5, 8], "triangles": [3, 4], "material": None, "parent": ""},
    ]
    assert values["polygons"] == {"3": 2, "4": 1} and values["materials"] == ["wood", "iron"]
    assert values["images"] == [{"name": "a", "media_type": "image/png", "size": [3, 2], "bytes": len(png())}]
