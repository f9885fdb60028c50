from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gvpipe.asset.attribute import Attribute, as_attribute
from gvpipe.foundation.errors import InputError

ROWS = {"vertex": 4, "corner": 6, "triangle": 2, "part": 1}


@pytest.mark.parametrize(
    ("name", "shape", "dtype", "domain", "kind"),
    [
        ("uv", (4, 2), float, "vertex", "uv"),
        ("uv1", (6, 2), float, "corner", "uv"),
        ("normal", (6, 3), np.float32, "corner", "normal"),
        ("tangent", (4, 4), float, "vertex", "tangent"),
        ("color", (4, 4), np.uint8, "vertex", "color"),
        ("color_of_day", (4, 3), float, "vertex", "color"),
        ("group", (2,), np.int64, "triangle", "label"),
        ("mass", (4,), float, "vertex", "scalar"),
        ("flow", (4, 5), float, "vertex", "vector"),
        ("uv", (4, 3), float, "vertex", "vector"),
    ],
)
def test_arrays_get_domain_and_kind(name: str, shape: tuple[int, ...], dtype: Any, domain: str, kind: str) -> None:
    made = as_attribute(name, np.ones(shape, dtype), ROWS, "mesh")
    assert (made.domain, made.kind) == (domain, kind)
    assert made.shape == (shape[0], shape[1] if len(shape) > 1 else 1)
    assert made.dtype == (np.float32 if np.dtype(dtype).kind == "f" else dtype)


def test_values_are_shared_by_indices() -> None:
    seam = Attribute(np.arange(8.0).reshape(4, 2), "corner", "uv", np.array([0, 1, 2, 0, 2, 3]))
    assert len(seam) == 6
    assert seam[3].tolist() == [0, 1]
    turned = seam.select(np.array([5, 4, 3, 2, 1, 0]))
    assert turned.tolist() == np.asarray(seam)[::-1].tolist()
    assert turned.values is seam.values
    copied = np.array(seam, copy=True)
    copied[:] = 7
    assert seam[0].tolist() == [0, 1]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"values": np.zeros((2, 2, 2))}, r"shape \(2, 2, 2\)"),
        ({"values": np.array(["a"])}, "numbers are needed"),
        ({"values": np.array([[0, np.nan]])}, "value 0 is"),
        ({"values": np.array([[0, 1e39]])}, "value 0 is"),
        ({"domain": "face"}, "vertex, corner, triangle, part"),
        ({"kind": "colour"}, "did you mean 'color'"),
        ({"kind": "normal"}, "2 components; a normal has 3"),
        ({"kind": "label"}, "labels are integers"),
        ({"values": np.zeros((2, 2), int), "kind": "uv"}, "floating-point"),
        ({"indices": np.array([0, 2])}, "index 1 is 2; there are values 0..1"),
        ({"indices": np.array([0.5])}, "integers are needed"),
    ],
)
def test_wrong_attributes_are_refused(change: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        Attribute(**({"values": np.zeros((2, 2))} | change))


def test_rows_must_be_those_of_the_mesh() -> None:
    with pytest.raises(InputError, match=r"mesh: attribute 'uv' has 5 rows; one per vertex \(4\)"):
        as_attribute("uv", np.zeros((5, 2)), ROWS, "mesh")
    with pytest.raises(InputError, match="has 4 rows; 6 are needed, one per corner"):
        as_attribute("uv", Attribute(np.zeros((4, 2)), "corner"), ROWS, "mesh")


def test_a_given_kind_stays() -> None:
    given = Attribute(np.zeros((4, 2)), kind="vector")
    assert as_attribute("uv", given, ROWS, "mesh") is given
    assert as_attribute("uv", Attribute(np.zeros((4, 2))), ROWS, "mesh").kind == "uv"


def test_float64_that_float32_would_flatten_is_refused() -> None:
    far = 1e9 + np.random.default_rng(1).random(100)
    with pytest.raises(InputError, match="float32 would round its values by up to .*; subtract an offset first"):
        Attribute(far)
    assert np.asarray(Attribute(far - 1e9)).max() <= 1
    assert np.asarray(Attribute(np.full(4, 0.1))).dtype == np.float32
    with pytest.raises(TypeError, match="unit of attribute is 3"):
        Attribute(np.zeros(4), unit=3)  # type: ignore[arg-type]
