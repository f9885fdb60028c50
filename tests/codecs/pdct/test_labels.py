"""Labels of clusters as bytes."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from gvcodecs.pdct.labels import decode_labels, encode_labels
from gvpipe.container.cursor import Cursor


@given(st.lists(st.integers(0, 4), min_size=1, max_size=60))
def test_labels_come_back(values: list[int]) -> None:
    labels = np.array(values)
    assert np.array_equal(decode_labels(Cursor(encode_labels(labels, 5), "x"), len(labels), 5, "x"), labels)
