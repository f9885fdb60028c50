"""Fields as colours: values, ranges, legends, and what is refused."""

from __future__ import annotations

import itertools
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
from gvpipe.rendering.field_map import FieldMap
from gvpipe.rendering.field_range import parse_range
from gvpipe.rendering.legend import MOST_TICKS, log_ticks, round_ticks

Run = Callable[..., Any]


def measured() -> MeshSequence:
    """A square for three frames with stress at vertices, speed and a label of triangles; one vertex that nothing uses."""
    square = np.concatenate([sheet(0.0, 0.0), [[9.0, 9.0, 9.0]]]).astype(np.float32)
    stress = np.array([[0, 10, 20, 30, 1e6], [5, 5, 5, 5, -1e6], [-40, np.nan, np.inf, 0, 0]], np.float32)
    speed = np.array([[[3, 4, 0], [0, 0, 1]], [[0, 0, 0], [0, 0, 2]], [[6, 8, 0], [0, 0, 3]]], np.float32)
    load = stress.clip(0, 5)
    fields = {"stress": Field(stress, unit="MPa"), "speed": Field(speed, "triangle", unit="m/s")}
    return MeshSequence(np.repeat(square[None], 3, axis=0), SQUARE, fields={**fields, "load": load, "debt": 0 - load})


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


@pytest.mark.parametrize(
    ("low", "high", "labels"),
    [
        (0.1, 1000, ["0.1", "1", "10", "100", "1000"]),
        (0.03, 40, ["0.1", "1", "10"]),
        (1e-9, 1e9, ["1e-09", "1e-05", "0.1", "1000", "1e+07"]),
        (3, 30, ["5", "10", "20"]),
        (2.1, 4.9, ["2.1", "4.9"]),
        (5, 5, ["5"]),
    ],
)
def test_ticks_of_a_log_scale_are_powers_of_ten(low: float, high: float, labels: list[str]) -> None:
    ticks = log_ticks(low, high)
    assert list(ticks.values()) == labels and all(0 <= part <= 1 for part in ticks)
    for part, text in ticks.items():
        assert low * (high / low) ** part == pytest.approx(float(text), rel=1e-5)


def test_percentiles_are_numpy_s_to_21_bits() -> None:
    """Of all finite values drawn, whatever their sizes; a vertex that no triangle uses counts for nothing."""
    random = np.random.default_rng(0)
    square = np.concatenate([sheet(0.0, 0.0), [[9.0, 9.0, 9.0]]]).astype(np.float32)
    for exponent, sign in ((0, 0), (30, 0), (3, -1), (3, 1)):
        values = random.normal(size=(40, 5)) * 10 ** random.uniform(-exponent, exponent, (40, 5))
        values = (np.abs(values) * sign if sign else values).astype(np.float32)
        values[:, 4], values[3, :4] = 1e30, [np.nan, np.inf, -np.inf, 0]
        sequence = MeshSequence(np.repeat(square[None], 40, axis=0), SQUARE, fields={"value": values})
        for frames, (low, high) in itertools.product((range(40), [3, 7, 7]), ((0, 100), (2, 98), (49.5, 50.5), (0, 1e-6))):
            drawn = values[np.unique(frames), :4].astype(np.float64)
            wanted = np.percentile(drawn[np.isfinite(drawn)], [low, high], method="lower")
            found = FieldMap(sequence, "value", list(frames), limits=f"{low}%,{high}%").limits
            assert found == pytest.approx(tuple(wanted), rel=2.0**-20), (exponent, sign, low)
            assert (np.abs(found) <= np.abs(wanted)).all()
    assert FieldMap(measured(), "stress", [0, 1], limits="0%,100%").limits == (0.0, 30.0)


def test_a_log_scale() -> None:
    sequence = measured()
    shown = FieldMap(sequence, "stress", [0], log=True)
    assert shown.limits == (10.0, 30.0)
    assert np.allclose(shown.values(0)[1:4], np.log([1, 2, 3]) / np.log(3)) and np.isnan(shown.values(0)[0])
    given = FieldMap(sequence, "stress", [0, 1, 2], limits="1,100", log=True)
    assert np.allclose(given.values(0)[1:4], np.log10([10, 20, 30]) / 2)
    assert np.isnan(given.values(2)[:4]).all()  # below 0, no number, without end, 0
    middle = FieldMap(sequence, "stress", [0, 1, 2], limits="0%,50%", log=True)
    assert middle.limits == (5.0, 5.0)  # of 5, 5, 5, 5, 10, 20, 30
    plain = FieldMap(sequence, "stress", [0], limits="1,100").legend((512, 512))
    assert not np.array_equal(plain, given.legend((512, 512)))


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
        ({"field": "stres"}, "field 'stres' asked for; there are: stress, speed, load, debt; did you"),
        ({"field": "stress", "colormap": "jet"}, "colormap 'jet'; one of viridis"),
        ({"field": "stress", "field_range": (3, 1)}, "a range from 3 to 1; the first number must be below the second"),
        ({"field": "stress", "field_range": (0, np.nan)}, "two finite numbers"),
        (
            {"field": "stress", "field_range": "wide"},
            "range 'wide'; two numbers such as 0,250, two percentiles such as 2%,98% or",
        ),
        ({"field": "stress", "size": 100}, "160x120 pixels are the least"),
        ({"field": "stress", "error_of": measured()}, "both the field 'stress' and errors"),
        ({"colormap": "magma"}, "without a field"),
        ({"field_range": (0, 1)}, "without a field"),
        ({"log": True}, "without a field"),
        ({"field": "stress", "log": True, "field_range": (0, 5)}, "from 0 to 5 with a log scale; both ends must be above 0"),
        ({"field": "stress", "log": True, "field_range": "symmetric"}, "a log scale has no 0"),
        ({"field": "debt", "log": True}, "field 'debt' has no value above 0 to show; leave out the log scale"),
        ({"field": "stress", "field_range": "98%,2%"}, "a range from 98% to 2%; two percentiles from 0 to 100 in order"),
        ({"field": "stress", "field_range": "2%,98"}, "range '2%,98'; two numbers"),
        ({"parts": "leg"}, "part 'leg' asked for; it has no named parts"),
    ],
)
def test_what_cannot_be_is_said_in_one_line(options: dict[str, Any], words: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=words) as caught:
        gvpipe.render(measured(), tmp_path / "a.png", **options)
    assert "\n" not in str(caught.value) and not list(tmp_path.iterdir())


def test_ranges_are_read_as_text() -> None:
    assert parse_range("0,250") == (0.0, 250.0) and parse_range("-1e3, 5") == (-1000.0, 5.0)
    assert parse_range("symmetric") == "symmetric" and parse_range("2%, 98%") == "2%, 98%"
    for wrong in ("", "1", "1,2,3", "a,b", "2,1", "1,1", "0,inf", "0%,101%", "-1%,5%", "5%,5%", "1%,2", "nan%,5%"):
        with pytest.raises(InputError, match="range"):
            parse_range(wrong)


def test_command_refuses_fields_that_are_not_there(run: Run, video: Path, tmp_path: Path) -> None:
    for options, words in (
        (("--field", "stress"), "field 'stress' asked for; there are none"),
        (("--field", "stress", "--range", "5,1"), "a range from 5 to 1"),
        (("--colormap", "magma"), "without a field"),
        (("--log",), "a log scale is given without a field"),
        (("--field", "stress", "--range", "9%,1%"), "a range from 9% to 1%"),
        (("--part", "leg"), "no named parts"),
    ):
        ended = run("render", video, tmp_path / "a.png", *options)
        assert ended.status == 1 and words in ended.err and ended.err.count("\n") == 1, ended
    assert run("render", video, tmp_path / "a.png", "--plain", "--size", 64).status == 0
