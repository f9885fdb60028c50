"""Some parts of a sequence: their triangles, with what lies beside them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from looks import sheets
from PIL import Image
from shapes import EMPTY

import gvpipe
from gvpipe.asset.attribute import Attribute
from gvpipe.asset.field import Field
from gvpipe.asset.material import Material
from gvpipe.foundation.errors import InputError
from gvpipe.model.part_choice import only_parts, parts_alone
from gvpipe.model.sequence import MeshSequence

COLOURS = ((1.0, 0.0, 0.0, 1.0), (0.0, 1.0, 0.0, 1.0), (0.0, 0.0, 1.0, 1.0))


def three() -> MeshSequence:
    materials = [Material(base_color=colour, unlit=True, double_sided=True) for colour in COLOURS]
    return sheets(
        [0.0, 1.0, 2.0],
        materials,
        attributes={
            "corner": Attribute(np.arange(18.0), "corner"),
            "patch": Attribute(np.arange(6), "triangle"),
            "mass": Attribute(np.arange(3.0), "part"),
            "vertex": Attribute(np.arange(12.0)),
        },
        fields={"load": Field(np.arange(6.0, dtype=np.float32)[None], "triangle"), "heat": Field(np.zeros((1, 12)))},
    )


def test_rows_of_what_is_left_stay_with_it() -> None:
    sequence = only_parts(three(), ["sheet 2", "sheet 0"])
    assert [(part.name, part.triangles, part.material) for part in sequence.parts] == [
        ("sheet 0", (0, 2), 0),
        ("sheet 2", (2, 4), 2),
    ]
    assert np.array_equal(sequence.faces, three().faces[[0, 1, 4, 5]]) and sequence.n_vertices == 12
    assert np.asarray(sequence.attributes["corner"]).ravel().tolist() == [*range(6), *range(12, 18)]
    assert np.asarray(sequence.attributes["patch"]).ravel().tolist() == [0, 1, 4, 5]
    assert np.asarray(sequence.attributes["mass"]).ravel().tolist() == [0, 2]
    assert len(sequence.attributes["vertex"]) == 12
    assert sequence.fields["load"][0].tolist() == [0, 1, 4, 5] and sequence.fields["heat"].shape == (1, 12)


def test_parts_of_one_name_belong_together() -> None:
    sequence = three()
    first, second, third = sequence.parts
    twice = replace(sequence, parts=(first, second, replace(third, name=first.name)))
    assert len(only_parts(twice, ["sheet 0"]).faces) == 4


@pytest.mark.parametrize("number", range(3))
def test_only_the_part_is_painted(number: int, tmp_path: Path) -> None:
    gvpipe.render(three(), tmp_path / "a.png", parts=f"sheet {number}", size=64, view="front")
    with Image.open(tmp_path / "a.png") as image:
        picture = np.asarray(image)
    assert picture[32, 32].tolist() == [round(255 * channel) for channel in COLOURS[number][:3]]
    seen = (picture != EMPTY).any(axis=2)
    assert 50 < seen[32].sum() < 64  # it fills the picture


def test_an_unknown_part_is_named_with_those_there_are(tmp_path: Path) -> None:
    with pytest.raises(
        InputError, match="part 'sheet2' asked for; there are: sheet 0, sheet 1, sheet 2; did you mean 'sheet 2'"
    ):
        gvpipe.render(three(), tmp_path / "a.png", parts=["sheet 0", "sheet2"])
    many = sheets([0.0] * 20, [Material()] * 20)
    with pytest.raises(InputError, match="sheet 11 and 8 more"):
        only_parts(many, ["leg"])
    assert not list(tmp_path.iterdir())


def test_parts_alone_have_their_vertices_and_polygons() -> None:
    given = replace(three(), polygons=np.full(3, 4, np.int32))
    sequence = parts_alone(given, ["sheet 2", "sheet 0"])
    assert [(part.name, part.vertices, part.triangles) for part in sequence.parts] == [
        ("sheet 0", (0, 4), (0, 2)),
        ("sheet 2", (4, 8), (2, 4)),
    ]
    kept = [*range(4), *range(8, 12)]
    assert np.array_equal(sequence[0], given[0][kept])
    assert np.array_equal(sequence[0][sequence.faces], given[0][given.faces[[0, 1, 4, 5]]])
    assert sequence.polygons is not None and sequence.polygons.tolist() == [4, 4]
    assert np.asarray(sequence.attributes["vertex"]).ravel().tolist() == kept
    assert sequence.fields["load"][0].tolist() == [0, 1, 4, 5] and sequence.fields["heat"].shape == (1, 8)
    assert sequence.materials == given.materials
