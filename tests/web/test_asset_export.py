"""Assets in pages: what the exporter makes of them."""

from __future__ import annotations

import base64
import re
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from asset_files import picture
from folders import SAMPLES
from sequences import waving

import gvpipe
from gvpipe import Field, Image, Material, Part, Texture
from gvpipe.container.mp4 import read_file


def noise(shape: tuple[int, ...], seed: int = 0) -> npt.NDArray[np.float32]:
    return np.cumsum(np.random.default_rng(seed).normal(size=shape), axis=0).astype(np.float32)


def asset() -> gvpipe.MeshSequence:
    """Two sheets with a texture, and fields of every domain."""
    sheet = waving(8, 10)
    frames = np.concatenate([sheet.read(0, 10), sheet.read(0, 10) + np.array([2, 0, 0], np.float32)], axis=1)
    faces = np.concatenate([sheet.faces, sheet.faces + 64])
    return gvpipe.MeshSequence(
        frames,
        faces,
        24.0,
        attributes={"uv": frames[0, :, :2]},
        fields={"heat": Field(noise((10, 128)), unit="K"), "cell": Field(noise((10, len(faces), 2)), "triangle")},
        parts=(Part("a", (0, 64), (0, 98), 0), Part("b", (64, 128), (98, 196), 0)),
        materials=(Material("paper", base_color_texture=Texture(0)),),
        images=(Image("dots", "image/png", picture([[[9, 9, 9]]])),),
    )


@pytest.mark.parametrize(("codec", "convert"), [("mcgv", False), ("pca", False), ("laplacian", True)])
def test_pages_carry_the_asset(codec: str, convert: bool, tmp_path: Path) -> None:
    """The file as it is; or converted, with fields within the sum of both bounds, of the triangle that they belong to."""
    gvpipe.encode(asset(), tmp_path / "a.mp4", codec)
    gvpipe.export_html(tmp_path / "a.mp4", tmp_path / "a.html", convert=convert)
    inside = tmp_path / "inside.mp4"
    inside.write_bytes(embedded(tmp_path / "a.html"))
    assert (inside.read_bytes() == (tmp_path / "a.mp4").read_bytes()) != convert
    whole, shown = gvpipe.open(tmp_path / "a.mp4"), gvpipe.open(inside)
    assert [part.name for part in shown.parts] == ["a", "b"]
    assert shown.materials == whole.materials and shown.images[0].data == whole.images[0].data
    bound = 2 * shown.directory.attributes[0].bound
    assert np.abs(np.asarray(shown.attributes["uv"]) - np.asarray(whole.attributes["uv"])).max() <= bound
    heat, cell = shown.directory.fields
    assert heat.bound == (2 if convert else 1) * whole.directory.fields[0].bound
    assert (heat.unit, heat.components, cell.components) == ("K", 0, 2)
    source = asset()
    assert np.abs(shown.fields["heat"].read(0, 10) - source.fields["heat"].read(0, 10)).max() <= heat.bound
    rows = {tuple(sorted(face)): row for row, face in enumerate(source.faces.tolist())}
    order = [rows[tuple(sorted(face))] for face in shown.faces.tolist()]
    assert np.abs(shown.fields["cell"].read(0, 10) - source.fields["cell"].read(0, 10)[:, order]).max() <= cell.bound


def test_a_conversion_leaves_normals_of_frames_behind(tmp_path: Path) -> None:
    """The player computes them."""
    sheet = waving(6, 5)
    up = np.zeros((5, 36, 3), np.float32)
    up[:, :, 2] = 1
    sequence = gvpipe.MeshSequence(sheet.positions, sheet.faces, fields={"normal": Field(up, kind="normal")})
    gvpipe.encode(sequence, tmp_path / "a.mp4", "laplacian")
    gvpipe.export_html(tmp_path / "a.mp4", tmp_path / "a.html", convert=True)
    (tmp_path / "inside.mp4").write_bytes(embedded(tmp_path / "a.html"))
    assert "field.0" not in read_file(tmp_path / "inside.mp4").sections


def test_a_sample_with_all_of_it_becomes_a_page(tmp_path: Path) -> None:
    gvpipe.encode(SAMPLES / "flag.npz", tmp_path / "flag.mp4", preset="fast")
    report = gvpipe.export_html(tmp_path / "flag.mp4", tmp_path / "flag.html")
    assert report.converted == "" and report.bytes <= 1.35 * report.video_bytes + 0.73e6
    assert embedded(tmp_path / "flag.html") == (tmp_path / "flag.mp4").read_bytes()


def embedded(page: Path) -> bytes:
    (text,) = re.findall(r'<script type="text/plain" id="video">(.*?)</script>', page.read_text("utf-8"))
    return base64.b64decode(text, validate=True)
