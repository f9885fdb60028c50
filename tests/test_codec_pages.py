"""The settings on the codecs' pages are those of the code."""

from __future__ import annotations

import dataclasses
import re
from fractions import Fraction
from typing import Any

import pytest
from folders import DOCS

from gvcodecs.laplacian import Laplacian
from gvcodecs.mcgv import Mcgv
from gvcodecs.pca import Pca
from gvcodecs.pdct import Pdct

PAGES = DOCS / "codecs"


def as_written(value: Any) -> str:
    """A default as the pages write it."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return f"`{value}`"
    return str(Fraction(value)) if 0 < value < 0.1 else f"{value:g}"


@pytest.mark.parametrize("codec", (Mcgv, Pca, Laplacian, Pdct), ids=lambda codec: codec.id)
def test_pages_list_settings_and_defaults(codec: Any) -> None:
    text = (PAGES / f"{codec.id}.md").read_text("utf-8")
    section = text.partition("\n## Settings\n")[2].partition("\n## ")[0]
    listed = re.findall(r"^\| `(\w+)` \|.*\| ([^|]+) \|$", section, re.MULTILINE)
    assert listed == [(field.name, as_written(field.default)) for field in dataclasses.fields(codec)]
