"""Real sequences, where the folder that holds them stands beside the project."""

from __future__ import annotations

from pathlib import Path

import pytest
from folders import DATA
from sequences import same_triangles

import gvpipe

NAMES = sorted(path.stem for path in DATA.glob("*.npz"))


@pytest.mark.slow
@pytest.mark.skipif(not NAMES, reason="no ../shared/data")
@pytest.mark.parametrize("image", ["h264", "jpeg"])
@pytest.mark.parametrize("name", NAMES)
def test_sequence_comes_back_in_its_own_order(name: str, image: str, tmp_path: Path) -> None:
    source = gvpipe.read(DATA / f"{name}.npz")
    report = gvpipe.encode(source, tmp_path / "a.mp4", image=image, preset="ultrafast")
    decoded = gvpipe.decode(tmp_path / "a.mp4")
    assert same_triangles(decoded.faces, source.faces)
    measured = gvpipe.compare(source, decoded)
    assert measured.kg is not None
    assert measured.kg < 0.8
    assert report.bpvf < 20
