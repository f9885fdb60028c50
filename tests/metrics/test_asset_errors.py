from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from asset_scene import scene

import gvpipe
from gvpipe.asset.attribute import Attribute
from gvpipe.metrics.asset_errors import angles
from gvpipe.metrics.correspondence import match_corners


def test_equal_scenes_have_no_error() -> None:
    errors = gvpipe.compare(scene(), scene())
    assert set(errors.attributes) == {"uv", "normal", "color", "mass", "group", "density"}
    assert all(error == {"max": 0, "mean": 0} for error in [*errors.attributes.values(), *errors.fields.values()])


def test_errors_are_those_that_were_made() -> None:
    source = scene()
    mass = np.asarray(source.attributes["mass"]).copy()
    mass[3] += 0.5
    stress = source.fields["stress"][:].copy()
    stress[2, 5] -= 2
    changed = dataclasses.replace(
        source, attributes={**source.attributes, "mass": mass}, fields={**source.fields, "stress": stress}
    )
    errors = gvpipe.compare(source, changed)
    assert errors.attributes["mass"]["max"] == pytest.approx(0.5, rel=1e-6)
    assert errors.fields["stress"]["max"] == pytest.approx(2, rel=1e-5)
    assert errors.fields["stress"]["mean"] == pytest.approx(2 / stress.size, rel=1e-5)


def test_what_one_side_lacks_is_null() -> None:
    source = scene()
    errors = gvpipe.compare(source, source.bare())
    assert errors.attributes["uv"] == {"max": None, "mean": None}
    assert errors.fields["stress"] == {"max": None, "mean": None}


def test_domains_and_the_order_of_triangles_do_not_matter() -> None:
    source = scene()
    corner = Attribute(np.asarray(source.attributes["normal"])[source.faces.reshape(-1)], "corner", "normal")
    turned = gvpipe.MeshSequence(
        source.positions, np.roll(source.faces[::-1], 1, axis=1), attributes={"normal": source.attributes["normal"]}
    )
    other = gvpipe.MeshSequence(source.positions, source.faces, attributes={"normal": corner})
    assert gvpipe.compare(other, turned).attributes["normal"]["max"] == 0


def test_angles() -> None:
    x, y, none = np.eye(3)[0], np.eye(3)[1], np.zeros(3)
    assert angles([x, x, x, none, none], [x, 2 * y, -x, none, x]).tolist() == pytest.approx([0, 90, 180, 0, 180])
    small = np.radians(1e-4)
    assert angles(x, [np.cos(small), np.sin(small), 0]) == pytest.approx(1e-4, rel=1e-9)


def test_corners_are_matched() -> None:
    rng = np.random.default_rng(1)
    faces = rng.integers(0, 30, (50, 3))
    order, turns = rng.permutation(50), rng.integers(0, 3, 50)
    others = np.take_along_axis(faces[order], (turns[:, None] + np.arange(3)) % 3, axis=1)
    corners = match_corners(faces, others)
    assert np.array_equal(faces.reshape(-1)[corners], others.reshape(-1))
    assert np.array_equal(np.sort(corners), np.arange(150))


@pytest.mark.parametrize("dtype", ["uint8", "uint16"])
def test_colours_of_different_types_are_compared_from_0_to_1(dtype: str) -> None:
    source = scene()
    largest = np.iinfo(dtype).max
    exact = np.random.default_rng(3).integers(0, largest, (source.n_vertices, 3), endpoint=True).astype(dtype)
    floats = (exact / np.float64(largest)).astype(np.float32)
    floats[4, 1] += np.float32(0.25)
    one, other = (
        gvpipe.MeshSequence(source.positions, source.faces, attributes={"color": Attribute(values, "vertex", "color")})
        for values in (exact, floats)
    )
    assert gvpipe.compare(one, other).attributes["color"]["max"] == pytest.approx(0.25, abs=1e-6)
    assert gvpipe.compare(one, one).attributes["color"]["max"] == 0
