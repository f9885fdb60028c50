"""How a page opens, by attributes of its element: what they are, that they are text, and what is refused."""

from __future__ import annotations

import re
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from asset_files import write_asset
from sequences import waving

import gvpipe
from gvpipe import Field
from gvpipe.foundation.errors import InputError
from gvpipe.model.sequence import MeshSequence
from gvpipe.rendering.field_map import FieldMap

Run = Callable[..., Any]
ODD = "\"><script>alert(1)</script> & 't"


def simulation() -> MeshSequence:
    """A waving sheet with stress, a displacement, a field by triangle, one of an odd name, and one without a value above 0."""
    sheet = waving(8, 6)
    random = np.random.default_rng(0)
    stress = 10 ** random.uniform(-2, 3, (6, 64))
    stress[:, :20] *= -1
    fields = {
        "stress": Field(stress.astype(np.float32), unit="MPa"),
        "a:b": Field(random.normal(size=(6, 64, 3)).astype(np.float32)),
        "cell": Field(random.normal(size=(6, len(sheet.faces))).astype(np.float32), "triangle"),
        ODD: Field(np.ones((6, 64), np.float32)),
        "debt": Field(-np.abs(stress).astype(np.float32)),
    }
    return MeshSequence(sheet.positions[:], sheet.faces, 24.0, fields=fields)


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("view") / "simulation.mp4"
    write_asset(path, simulation())
    return path


class Tags(HTMLParser):
    """Attributes of the page's player, as a browser reads them."""

    found: dict[str, str | None]

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag == "geometry-video":
            assert len(dict(attrs)) == len(attrs)
            self.found = dict(attrs)


def attributes(page: Path) -> dict[str, str | None]:
    parser = Tags()
    parser.feed(page.read_text("utf-8").split('<script type="text/plain"')[0])
    return {name: value for name, value in parser.found.items() if name not in ("src", "up", "autoplay", "loop")}


def exported(file: Path, **view: Any) -> dict[str, str | None]:
    gvpipe.export_html(file, file.with_suffix(".html"), **view)
    return attributes(file.with_suffix(".html"))


@pytest.mark.parametrize(
    ("view", "wanted"),
    [
        ({}, {}),
        ({"speed": 1, "shading": "smooth"}, {}),
        ({"speed": 0.1, "shading": "flat"}, {"speed": "0.1", "shading": "flat"}),
        ({"camera": "left"}, {"camera": "90,0"}),
        ({"camera": "-20.5,1e1"}, {"camera": "-20.5,10"}),
        ({"camera": (30, -90.0)}, {"camera": "30,-90"}),
        ({"warp": "a:b"}, {"warp": "a:b"}),
        ({"warp": "a:b:1e3"}, {"warp": "a:b:1000"}),
        ({"clip": "x=0.3"}, {"clip": "x=0.3"}),
        ({"clip": "-z=-2e1"}, {"clip": "-z=-20"}),
        ({"field": ODD}, {"field": ODD}),
        ({"field": "a:b", "colormap": "magma"}, {"field": "a:b", "colormap": "magma"}),
        ({"field": "cell", "field_range": (-1, 2.5)}, {"field": "cell", "range": "-1,2.5"}),
        ({"field": "cell", "field_range": "-1, 2.5"}, {"field": "cell", "range": "-1,2.5"}),
        ({"field": ODD, "field_range": "2%,98%"}, {"field": ODD}),  # of one value: the player's own range
        ({"field": "stress", "log": True, "field_range": (1, 10)}, {"field": "stress", "range": "1,10", "scale": "log"}),
    ],
    ids=str,
)
def test_what_is_asked_for_is_attributes(view: dict[str, Any], wanted: dict[str, str], file: Path) -> None:
    assert exported(file, **view) == wanted


@pytest.mark.parametrize(("limits", "log"), [("2%,98%", False), ("10%,90%", True), ("symmetric", False), (None, True)])
def test_ranges_are_those_of_pictures(limits: str | None, log: bool, file: Path) -> None:
    with gvpipe.open(file) as video:
        wanted = FieldMap(video.sequence(), "stress", range(6), limits=limits, log=log).limits
    low, high = str(exported(file, field="stress", field_range=limits, log=log)["range"]).split(",")
    assert (float(low), float(high)) == wanted


@pytest.mark.parametrize(
    ("view", "words"),
    [
        ({"field": "stres"}, "field 'stres' asked for; there are: stress, .*; did you mean 'stress'"),
        ({"field": "stress", "colormap": "errors"}, "colormap 'errors'; pages have viridis, magma, coolwarm, gray"),
        ({"field": "stress", "colormap": "magm"}, "colormap 'magm'; .*; did you mean 'magma'"),
        ({"colormap": "magma"}, "without a field; name one"),
        ({"field_range": "2%,98%"}, "without a field; name one"),
        ({"log": True}, "without a field; name one"),
        ({"field": "stress", "field_range": "9,1"}, "a range from 9 to 1"),
        ({"field": "stress", "field_range": (0, 1), "log": True}, "both ends must be above 0"),
        ({"field": "debt", "log": True}, "field 'debt' has no value above 0 to show"),
        ({"speed": 17}, "speed 17; browsers play at 0.0625 to 16"),
        ({"speed": float("nan")}, "speed nan"),
        ({"shading": "round"}, "shading 'round'; smooth or flat"),
        ({"camera": "up"}, "view 'up': one of three-quarter"),
        ({"camera": (0, 91)}, "camera 0,91; an azimuth and an elevation from -90 to 90"),
        ({"clip": "w=3"}, "a plane 'w=3'; x=0.3, y=30% or -z=0.3 is needed"),
        ({"clip": "x=nan"}, "a plane 'x=nan'"),
        ({"warp": "stress"}, "no field of vectors 'stress' on its vertices to warp by; it has 'a:b'"),
        ({"warp": "a:c"}, "no field of vectors 'a:c' .*; did you mean 'a:b'"),
        ({"warp": ":2"}, "NAME or NAME:SCALE is needed"),
    ],
    ids=str,
)
def test_what_cannot_be_names_the_file(view: dict[str, Any], words: str, file: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=words) as caught:
        gvpipe.export_html(file, tmp_path / "page.html", **view)
    assert str(caught.value).startswith(str(file)) and "\n" not in str(caught.value)
    assert not list(tmp_path.iterdir())


def test_parts_of_the_box_become_places(file: Path, tmp_path: Path) -> None:
    """With the origin of a file that has one."""
    sequence = simulation()
    moved = MeshSequence(sequence.positions[:], sequence.faces, 24.0, origin=np.array([0.0, 1e6, 0.0]))
    gvpipe.encode(moved, tmp_path / "far.mp4", "pca")
    for path, offset in ((file, 0.0), (tmp_path / "far.mp4", 1e6)):
        ((name, place),) = [str(exported(path, clip="-y=25%")["clip"]).split("=")]
        with gvpipe.open(path) as video:
            low, high = video[0][:, 1].min(), video[0][:, 1].max()
        assert name == "-y" and float(place) == pytest.approx(float(low + 0.25 * (high - low)) + offset, abs=1e-6)


def test_a_camera_of_another_type_is_a_mistake(file: Path, tmp_path: Path) -> None:
    given: Any = (1, 2, 3)
    with pytest.raises(TypeError, match="a view's name or"):
        gvpipe.export_html(file, tmp_path / "page.html", camera=given)
    with pytest.raises(TypeError, match="speed is"):
        gvpipe.export_html(file, tmp_path / "page.html", speed="fast")  # type: ignore[arg-type]


def test_commands_take_the_same(run: Run, file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    options = ["--field", "stress", "--range", "0%,50%", "--colormap", "gray", "--log", "--speed", "0.5"]
    options += ["--warp", "a:b:2", "--camera", "20,-10", "--shading", "flat"]
    assert run("export-html", file, tmp_path / "a.html", *options).status == 0
    found = attributes(tmp_path / "a.html")
    assert {**found, "range": None} == {
        "field": "stress",
        "colormap": "gray",
        "range": None,
        "scale": "log",
        "speed": "0.5",
        "warp": "a:b:2",
        "camera": "20,-10",
        "shading": "flat",
    }
    monkeypatch.setattr("gvpipe.web.browser.open_page", lambda page: False)
    played = run("play", file, *options)
    page = Path(played.out.strip())
    assert played.status == 0 and attributes(page) == found
    page.unlink()
    page.parent.rmdir()
    refused = run("play", file, "--range", "0,1")
    assert refused.status == 1 and re.fullmatch(r"Error: .*simulation\.mp4: a colour map, a range .*\n", refused.err)


@pytest.mark.parametrize("convert", [False, True])
def test_conversions_open_as_asked_for(convert: bool, file: Path) -> None:
    assert exported(file, convert=convert, field="stress", camera="top") == {"field": "stress", "camera": "0,90"}
