"""The widget as far as no page is needed: its traits are checked, ranges are answered, a saved notebook shows something."""

from __future__ import annotations

import base64
import html
import io
import pickle
import re
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from PIL import Image
from sequences import waving

import gvpipe
from gvpipe.foundation.errors import InputError
from gvpipe.notebook import display, libraries, prepared

pytest.importorskip("anywidget")


@pytest.fixture
def parted(tmp_path: Path) -> Path:
    """A geometry video with a field and two parts."""
    sheet = waving(8, 12)
    points = np.concatenate([sheet[:], np.add(sheet[:], [2, 0, 0])], axis=1)
    faces = np.concatenate([sheet.faces, sheet.faces + sheet.n_vertices])
    ranges = [(0, len(sheet.faces)), (len(sheet.faces), len(faces))]
    parts = tuple(
        gvpipe.Part(name, (i * sheet.n_vertices, (i + 1) * sheet.n_vertices), ranges[i]) for i, name in enumerate(["a", "b"])
    )
    fields = {"height": points[:, :, 2]}
    gvpipe.encode(gvpipe.MeshSequence(points, faces, fields=fields, parts=parts), tmp_path / "parted.mp4", "pca")
    return tmp_path / "parted.mp4"


@pytest.fixture
def kernel(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[dict[str, Any]]]:
    """As in a kernel: what is displayed, by media type."""
    import IPython.display

    shown: list[dict[str, Any]] = []
    monkeypatch.setattr("IPython.get_ipython", lambda: SimpleNamespace(kernel=object()))

    def show(data: dict[str, Any], **_: Any) -> Any:
        shown.append(data)
        return SimpleNamespace(update=lambda data, **_: shown.append(data))

    monkeypatch.setattr(IPython.display, "display", show)
    yield shown


def test_options_become_traits(parted: Path) -> None:
    widget: Any = gvpipe.show(
        parted, field="height", colormap="magma", field_range=(0, 1), speed=0.5, camera="left", parts="b", autoplay=False
    )
    assert (widget.field, widget.range, widget.speed, widget.parts) == ("height", (0, 1), 0.5, ["b"])
    assert widget.playing is False and widget.camera == pytest.approx((90, 0)) and widget.frame == 0
    assert widget._attributes == {"up": "y", "colormap": "magma", "loop": "", "shading": "smooth"}
    assert widget._data == parted.read_bytes() and widget.note == ""
    assert widget.layout.height == "420px"


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("frame", 12, "frame 12 of .*parted.mp4: there are 12"),
        ("speed", 0.01, "speed 0.01; browsers play at 0.0625 to 16"),
        ("field", "heigt", "has no field 'heigt'; it has 'height'; did you mean 'height'"),
        ("range", (1.0, 1.0), "low < high is needed"),
        ("camera", (0.0, 91.0), "the elevation from -90 to 90"),
        ("parts", ["a", "c"], "has no part 'c'; it has 'a', 'b'"),
    ],
)
def test_traits_that_the_video_cannot_have(name: str, value: Any, message: str, parted: Path) -> None:
    widget = gvpipe.show(parted)
    before = getattr(widget, name)
    with pytest.raises(InputError, match=message):
        setattr(widget, name, value)
    assert getattr(widget, name) == before


def test_arguments_that_cannot_be(parted: Path) -> None:
    cases: list[tuple[dict[str, Any], str]] = [
        ({"field": "x"}, "x"),
        ({"parts": "c"}, "part 'c' asked for"),
        ({"up": "x"}, "up is 'x'; one of y, z"),
        ({"colormap": "magma"}, "field"),
    ]
    for options, message in cases:
        with pytest.raises(InputError, match=message):
            gvpipe.show(parted, **options)


def test_a_frame_counts_from_the_end_and_parts_may_be_none(parted: Path) -> None:
    widget: Any = gvpipe.show(parted)
    widget.frame, widget.parts, widget.field = -1, [], "height"
    assert widget.frame == 11 and widget.parts == []
    widget.parts = widget.field = None


def test_a_page_gets_parts_of_the_file(parted: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(prepared, "MOST_AT_ONCE", 100)
    widget: Any = gvpipe.show(parted)
    data, sent = widget._prepared.data(), []
    assert widget._data is None
    monkeypatch.setattr(type(widget), "send", lambda _, content, buffers=None: sent.append((content, buffers)))
    for start, stop in ((0, 65536), (10, 20), (len(data) - 5, len(data) + 5), (len(data) + 5, None), (7, None)):
        widget._take(widget, {"kind": "range", "number": "n-1", "start": start, "stop": stop}, [])
        content, (part,) = sent.pop()
        assert part == data[start:stop] and content == {"kind": "range", "number": "n-1", "size": len(data)}
    wrong: list[tuple[Any, Any]] = [(-1, 5), (5, 3), (None, 3), ("0", 5), (0.5, 2)]
    for start, stop in wrong:
        widget._take(widget, {"kind": "range", "number": "n-2", "start": start, "stop": stop}, [])
        assert "were asked for" in sent.pop()[0]["error"]
    for message in ({}, None, "range", {"kind": "other"}, {"kind": "pick", "vertex": 10**9}):
        widget._take(widget, message, [])
    assert sent == []


def test_picks_reach_those_who_asked(parted: Path) -> None:
    widget: Any = gvpipe.show(parted)
    told: list[Any] = []
    widget.on_pick(told.append)
    message = {"kind": "pick", "vertex": 70, "triangle": 120, "frame": 3, "part": "b", "value": 0.0}
    widget._take(widget, message, [])
    widget.on_pick(told.append, remove=True)
    widget._take(widget, message, [])
    (pick,) = told
    assert (pick.vertex, pick.part, list(pick.values)) == (70, "b", ["height"])


def test_a_saved_notebook_has_a_still_and_the_player(parted: Path) -> None:
    widget: Any = gvpipe.show(parted, field="height", up="z")
    bundle = widget.saved()
    assert np.asarray(Image.open(io.BytesIO(bundle["image/png"]))).shape == (240, 240, 3)
    markup = bundle["text/html"]
    (page,) = re.findall(r'data-page="([^"]*)"', markup)
    text = html.unescape(page)
    assert '<geometry-video src="#video" up="z" field="height"' in text
    (video,) = re.findall(r'<script type="text/plain" id="video">(.*?)</script>', text)
    assert base64.b64decode(video) == parted.read_bytes()
    (size,) = re.findall(r"player and file, (\d+) kB in this notebook; embed=False leaves them out", markup)
    assert int(size) == pytest.approx(len(text) / 1000, abs=1)
    left: Any = gvpipe.show(parted, embed=False)
    assert "data-page" not in left.saved()["text/html"] and len(left.saved()["text/html"]) < 40_000


def test_the_last_line_of_a_cell(parted: Path, kernel: list[dict[str, Any]]) -> None:
    sequence = waving(8, 6)
    for shown in (gvpipe.open(parted), sequence):
        bundle = shown._repr_mimebundle_()
        assert set(bundle) == {"text/html", "text/plain", "image/png"} and "data-page" in bundle["text/html"]
        assert "application/vnd.jupyter.widget-view+json" in kernel.pop()
        assert shown is sequence or not kernel
    assert "encoded by pca" in kernel.pop()["text/plain"]


def test_a_comparison_shows_both_sides(parted: Path, kernel: list[dict[str, Any]], tmp_path: Path) -> None:
    source = gvpipe.decode(parted)
    comparison = gvpipe.compare(source, parted)
    assert pickle.loads(pickle.dumps(comparison)) == comparison and comparison.sides[0] is source
    bundle = comparison._repr_mimebundle_()
    assert bundle["text/html"].count("data-page") == 4 and "<polyline" in bundle["text/html"]
    assert "SideBySide" in kernel[-1]["text/plain"]
    kernel.clear()
    for_ever = pickle.loads(pickle.dumps(comparison))
    del source
    for alone in (comparison, for_ever):  # nothing holds its source
        bundle = alone._repr_mimebundle_()
        assert "KG error" in bundle["text/html"] and "data-page" not in bundle["text/html"] and not kernel


def test_where_there_is_no_player_there_is_a_still(
    parted: Path, kernel: list[dict[str, Any]], monkeypatch: pytest.MonkeyPatch
) -> None:
    player = gvpipe.open(parted)
    monkeypatch.setattr(display, "has_widgets", lambda: False)
    assert libraries.REMEDY.replace("'", "&#x27;") in player._repr_mimebundle_()["text/html"]
    monkeypatch.setattr(display, "has_widgets", lambda: True)
    monkeypatch.setattr(display, "MOST_SAMPLES", 10)
    large = waving(8, 7)
    assert display.TOO_LARGE in large._repr_mimebundle_()["text/html"] and "<img" in large._repr_mimebundle_()["text/html"]
    point = gvpipe.MeshSequence(np.zeros((2, 1, 3)), np.zeros((0, 3), np.int32))
    assert "which is no length above 0" in point._repr_mimebundle_()["text/html"]
    monkeypatch.setattr("IPython.get_ipython", lambda: SimpleNamespace(kernel=None))
    assert set(player._repr_mimebundle_()) == {"text/html", "text/plain"}
    assert kernel == []


def test_without_anywidget_show_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(libraries, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"pip install 'gvpipe\[notebook\]'"):
        gvpipe.show("x.mp4")


def test_players_side_by_side_are_linked(parted: Path, tmp_path: Path, kernel: list[dict[str, Any]]) -> None:
    pair: Any = gvpipe.show(parted, gvpipe.decode(parted))
    assert pair.players[0].name == str(parted) and len(pair.children) == 2
    kernel.clear()
    bundle = pair._repr_mimebundle_()
    assert bundle["text/html"].count("data-page") == 4 and len(kernel) == 1
    gvpipe.encode(waving(8, 3), tmp_path / "short.mp4", "pca")
    with pytest.raises(InputError, match=r"parted.mp4 has 12, .*short.mp4 has 3"):
        gvpipe.show(parted, tmp_path / "short.mp4")


def test_a_bar_follows_what_takes_long(kernel: list[dict[str, Any]], monkeypatch: pytest.MonkeyPatch) -> None:
    from gvpipe.notebook import progress_bar

    bar = progress_bar.ProgressBar("walk")
    bar("positions", 0.1)
    assert kernel == []
    monkeypatch.setattr("gvpipe.notebook.progress_bar.time.monotonic", lambda: 1e9)
    bar("positions", 0.25)
    bar.finish("encoded")
    assert [each["text/plain"] for each in kernel] == ["encoding walk: positions 25%", "encoded"]
    assert 'value="0.250"' in kernel[0]["text/html"]


def test_marimo_gets_a_widget_or_a_still(parted: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with gvpipe.open(parted) as video:
        shown: Any = video._display_()
        assert shown.n_frames == 12 and shown.playing
        monkeypatch.setattr(display, "has_widgets", lambda: False)
        still: Any = video._display_()
    assert "data:image/png" in still._repr_html_() and libraries.REMEDY in html.unescape(still._repr_html_())
