"""Textures that move in USD: asset paths with a sample for each time code."""

from __future__ import annotations

from pathlib import Path

import pytest
from moving import is_of, pictures, sheet

import gvpipe
from gvpipe.model.moving_texture import with_pictures

pytest.importorskip("pxr")
FRAMES = 5


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("usd")
    gvpipe.write(with_pictures(sheet(FRAMES), pictures(FRAMES), "skin"), path / "a.usda")
    return path


def test_each_frame_has_a_file(folder: Path) -> None:
    text = (folder / "a.usda").read_text()
    assert "inputs:file.timeSamples" in text and "skin_0004.png" in text
    assert len(list((folder / "a_textures").iterdir())) == FRAMES


@pytest.mark.parametrize("suffix", [".usda", ".usdz"])
def test_they_come_back(suffix: str, folder: Path, tmp_path: Path) -> None:
    path = folder / "a.usda"
    if suffix == ".usdz":
        path = tmp_path / "a.usdz"
        gvpipe.write(with_pictures(sheet(FRAMES), pictures(FRAMES), "skin"), path)
    sequence = gvpipe.read(path)
    row = sequence.images[0].pictures
    assert row is not None and all(is_of(row.pixels(frame), frame) for frame in range(FRAMES))
    part = gvpipe.read(path, frames=(2, 4)).images[0].pictures
    assert part is not None and len(part) == 2 and is_of(part.pixels(0), 2)


def test_a_missing_file_is_named(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "a_textures").mkdir()
    for path in [folder / "a.usda", *(folder / "a_textures").iterdir()]:
        if path.name != "skin_0003.png":
            (tmp_path / path.relative_to(folder)).write_bytes(path.read_bytes())
    sequence = gvpipe.read(tmp_path / "a.usda")
    assert any("skin_0003.png of frame 3 is missing" in note for note in sequence.notes)
    row = sequence.images[0].pictures
    assert row is not None and is_of(row.pixels(3), 2) and is_of(row.pixels(4), 4)
