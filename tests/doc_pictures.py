"""Pictures of the documentation that tests make of other programs; ``--write-golden`` writes them."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from folders import ROOT
from PIL import Image

FOLDER = ROOT / "docs" / "integrations"


def keep(shot: bytes | Path, name: str, request: pytest.FixtureRequest, colourful: float = 0.03) -> None:
    """Check that a picture has the colours of a field, on more than that part of it; keep it where that is asked for."""
    picture = Image.open(io.BytesIO(shot) if isinstance(shot, bytes) else shot).convert("RGB")
    pixels = np.asarray(picture, int)
    assert (pixels.max(axis=2) - pixels.min(axis=2) > 60).mean() > colourful
    if request.config.getoption("--write-golden"):
        FOLDER.mkdir(exist_ok=True)
        picture.quantize(128).save(FOLDER / f"{name}.png", optimize=True)
