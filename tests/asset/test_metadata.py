from __future__ import annotations

from typing import Any

import pytest

from gvpipe.asset.metadata import Metadata
from gvpipe.foundation.errors import InputError


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"up_axis": "w"}, "up axis 'w'"),
        ({"metres_per_unit": 0.0}, "above 0"),
        ({"metres_per_unit": float("inf")}, "above 0"),
        ({"start_time": float("nan")}, "seconds are needed"),
        ({"texts": {"a": 1}}, "texts by name"),
    ],
)
def test_wrong_metadata_is_refused(change: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        Metadata(**change)


def test_metadata_is_compared_by_value() -> None:
    assert Metadata("y", 0.01, texts={"a": "b"}) == Metadata("y", 0.01, texts={"a": "b"})
