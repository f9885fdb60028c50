from __future__ import annotations

import pytest

from gvpipe.asset_coding.bounds import NOT_KEPT, Precision, check_names, precision
from gvpipe.foundation.errors import SettingError


@pytest.mark.parametrize(
    ("given", "kind", "is_float", "wanted"),
    [
        (None, "uv", True, Precision(bound=1 / 2048)),
        (None, "normal", True, Precision(bound=1.0)),
        (None, "scalar", True, Precision(bound=0.02)),
        (None, "color", True, Precision()),
        (None, "label", False, Precision()),
        ("exact", "scalar", True, Precision()),
        ("none", "scalar", True, NOT_KEPT),
        ("0.5%", "scalar", True, Precision(bound=0.1)),
        (0.25, "scalar", True, Precision(bound=0.25)),
        ("2.5", "label", False, Precision(bound=2)),
        ("0.5%,nan=keep", "scalar", True, Precision(bound=0.1, holes=True)),
        ("exact,nan=keep", "scalar", True, Precision(holes=True)),
    ],
)
def test_precision(given: float | str | None, kind: str, is_float: bool, wanted: Precision) -> None:
    found = precision(given, kind, is_float, 20.0, 512, "field 'a'")
    assert found.is_kept == wanted.is_kept
    assert found.holes == wanted.holes
    assert found.bound == pytest.approx(wanted.bound)


def test_uv_without_images() -> None:
    assert precision(None, "uv", True, 1.0, 0, "uv").bound == 1 / 8192


@pytest.mark.parametrize("given", ["fine", "-1", "0", "nan", "inf%", "1e400"])
def test_what_is_no_bound(given: str) -> None:
    with pytest.raises(SettingError, match="field 'a': .* cannot be a bound"):
        precision(given, "scalar", True, 1.0, 0, "field 'a'")


def test_names() -> None:
    check_names({"stress": 1}, ["stress"], "field")
    with pytest.raises(SettingError, match="no field 'stres'; there are stress; did you mean 'stress'"):
        check_names({"stres": 1}, ["stress"], "field")
    with pytest.raises(SettingError, match="there are none"):
        check_names({"uv": 1}, [], "attribute")
