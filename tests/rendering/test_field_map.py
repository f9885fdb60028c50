"""Fields as colours: values, ranges, legends, and what is refused."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from shapes import FRONT_VIEW, SQUARE, sheet

import gvpipe
from gvpipe.asset.field import Field
from gvpipe.foundation.errors import InputError
from gvpipe.model.sequence import MeshSequence
from gvpipe.rasterizer.colormaps import colormap
from gvpipe.rasterizer.colours import HOLE, to_linear
from gvpipe.rasterizer.renderer import Renderer
from gvpipe.rendering.field_map import FieldMap, parse_range
from gvpipe.rendering.legend import MOST_TICKS, round_ticks

Run = Callable[..., Any]


def measured() -> MeshSequence:
    """A square for three frames with stress at vertices, speed and a label of triangles; one vertex that nothing uses."""
    square = np.concatenate([sheet(0.0, 0.0), [[9.0, 9.0, 9.0]]]).astype(np.float32)
    stress = np.array([[0, 10, 20, 30, 1e6], [5, 5, 5, 5, -1e6], [-40, np.nan, np.inf, 0, 0]], np.float32)
    speed = np.array([[[3, 4, 0], [0, 0, 1]], [[0, 0, 0], [0, 0, 2]], [[6, 8, 0], [0, 0, 3]]], np.float32)
    fields = {"stress": Field(stress, unit="MPa"), "speed": Field(speed, "triangle", unit="m/s")}
    return MeshSequence(np.repeat(square[None], 3, axis=0), SQUARE, fields={**fields, "load": stress.clip(0, 5)})


def test_values_are_parts_of_the_range_that_is_drawn() -> None:
    sequence = measured()
    first = FieldMap(sequence, "stress", [0])
    assert first.limits == (0.0, 30.0)
    assert np.allclose(first.values(0)[:4], [0, 1 / 3, 2 / 3, 1])
    whole = FieldMap(sequence, "stress", [0, 1, 2])
    assert whole.limits == (-40.0, 30.0)
    assert np.isnan(whole.values(2)[[1, 2]]).all() and whole.values(2)[0] == 0.0
    assert FieldMap(sequence, "stress", [0, 1, 2], limits="symmetric").limits == (-40.0, 40.0)
    assert np.allclose(FieldMap(sequence, "stress", [0], limits=(10, 20)).values(0)[:4], [-1, 0, 1, 2])
    lengths = FieldMap(sequence, "speed", [0, 1, 2])
    assert lengths.limits == (0.0, 10.0) and np.allclose(lengths.values(0), [[0.5], [0.1]])
    constant = FieldMap(sequence, "stress", [1])
    assert constant.limits == (5.0, 5.0) and np.allclose(constant.values(1)[:4], 0.5)


def test_colours_at_known_values() -> None:
    """Seen from the front, the light has no colour: a pixel has the hue of the map at its value."""
    sequence = measured()
    for name in ("viridis", "magma", "coolwarm"):
        shown = FieldMap(sequence, "stress", [0], name)
        renderer = Renderer.of(sequence, (64, 64), plain=True, colors=name)
        picture = renderer.draw(sequence[0], FRONT_VIEW, shown.values(0))
        pixel = to_linear(picture[32, 32] / 255)  # on the diagonal, half way from 0 to 20 of 30
        expected = to_linear(colormap(name))[round(255 / 3)]
        assert np.allclose(pixel / pixel.max(), expected / expected.max(), atol=0.05)
    holes = FieldMap(sequence, "stress", [0, 1, 2])
    pixel = to_linear(renderer.draw(sequence[2], FRONT_VIEW, holes.values(2))[38, 34] / 255)
    assert np.ptp(pixel) == 0 and abs(pixel[0] / to_linear(HOLE)[0] - 1) < 0.15


def test_triangle_fields_are_flat(tmp_path: Path) -> None:
    gvpipe.render(measured(), tmp_path / "a.png", field="speed", size=(400, 300), view="front", frame=0)
    with Image.open(tmp_path / "a.png") as image:
        picture = np.asarray(image).astype(int)
    mesh = picture[140:160, 200:340].reshape(-1, 3)
    colours, counts = np.unique(mesh, axis=0, return_counts=True)
    assert counts[np.argsort(counts)[-2:]].sum() > 0.9 * len(mesh) and len(colours) < 60


@pytest.mark.parametrize(
    ("low", "high", "labels"),
    [
        (0, 246, ["0", "50", "100", "150", "200"]),
        (-0.52, 0.52, ["-0.4", "-0.2", "0", "0.2", "0.4"]),
        (20, 220, ["50", "100", "150", "200"]),
        (101325, 101325.6, ["101325", "101325.1", "101325.2", "101325.3", "101325.4", "101325.5", "101325.6"]),
        (3e-9, 9e-9, ["3e-09", "4e-09", "5e-09", "6e-09", "7e-09", "8e-09", "9e-09"]),
        (5, 5, ["5"]),
        (0, 0, ["0"]),
        (1e20, 1e20 * (1 + 1e-13), ["1e+20", "1e+20"]),
        (-1e308, 1e308, None),
        (0, 1e-320, None),
    ],
)
def test_ticks_are_round_numbers(low: float, high: float, labels: list[str] | None) -> None:
    ticks = round_ticks(low, high)
    assert all(0 <= part <= 1 for part in ticks) and 1 <= len(ticks) <= MOST_TICKS + 1
    if labels is not None:
        assert list(ticks.values()) == labels
    if high > low and len(ticks) > 2:
        assert all(abs(low + part * (high - low) - float(text)) < 1e-6 * (high - low) for part, text in ticks.items())


def test_legend_has_the_map_and_the_unit_beside_the_picture(tmp_path: Path) -> None:
    legend = FieldMap(measured(), "stress", [0], "magma").legend((512, 512))
    bar = legend[:, 20].astype(int)
    for end in colormap("magma")[[0, -1]]:
        assert np.abs(bar - np.rint(255 * end)).sum(axis=1).min() == 0
    without = FieldMap(measured(), "load", [0], "magma").legend((512, 512))
    assert legend.shape[0] == without.shape[0] == 512 and not np.array_equal(legend, without)
    gvpipe.render(measured(), tmp_path / "a.png", field="stress", size=(300, 200), frame=0)
    with Image.open(tmp_path / "a.png") as image:
        assert image.size == (300, 200)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"field": "stres"}, "field 'stres' asked for; there are: stress, speed, load; did you mean 'stress'"),
        ({"field": "stress", "colormap": "jet"}, "colormap 'jet'; one of viridis"),
        ({"field": "stress", "field_range": (3, 1)}, "a range from 3 to 1; the first number must be below the second"),
        ({"field": "stress", "field_range": (0, np.nan)}, "two finite numbers"),
        ({"field": "stress", "field_range": "wide"}, "range 'wide'; two numbers such as 0,250 or 'symmetric'"),
        ({"field": "stress", "size": 100}, "160x120 pixels are the least"),
        ({"field": "stress", "error_of": measured()}, "both the field 'stress' and errors"),
        ({"colormap": "magma"}, "without a field"),
        ({"field_range": (0, 1)}, "without a field"),
        ({"parts": "leg"}, "part 'leg' asked for; it has no named parts"),
    ],
)
def test_what_cannot_be_is_said_in_one_line(options: dict[str, Any], words: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=words) as caught:
        gvpipe.render(measured(), tmp_path / "a.png", **options)
    assert "\n" not in str(caught.value) and not list(tmp_path.iterdir())


def test_ranges_are_read_as_text() -> None:
    assert parse_range("0,250") == (0.0, 250.0) and parse_range("-1e3, 5") == (-1000.0, 5.0)
    assert parse_range("symmetric") == "symmetric"
    for wrong in ("", "1", "1,2,3", "a,b", "2,1", "1,1", "0,inf"):
        with pytest.raises(InputError, match="range"):
            parse_range(wrong)


def test_command_refuses_fields_that_are_not_there(run: Run, video: Path, tmp_path: Path) -> None:
    for options, words in (
        (("--field", "stress"), "field 'stress' asked for; there are none"),
        (("--field", "stress", "--range", "5,1"), "a range from 5 to 1"),
        (("--colormap", "magma"), "without a field"),
        (("--part", "leg"), "no named parts"),
    ):
        ended = run("render", video, tmp_path / "a.png", *options)
        assert ended.status == 1 and words in ended.err and ended.err.count("\n") == 1, ended
    assert run("render", video, tmp_path / "a.png", "--plain", "--size", 64).status == 0
