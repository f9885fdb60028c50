"""The web player's files and pages, as far as no browser is needed; `test_geometry_video` has the rest."""

from __future__ import annotations

import base64
import dataclasses
import io
import json
import re
import runpy
import shutil
import subprocess
import webbrowser
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest
from conftest import Finished
from file_server import serving
from folders import GOLDEN, ROOT, SAMPLES
from sequences import waving

import gvpipe
from gvpipe.coding.quality_scale import error_of
from gvpipe.foundation.errors import CorruptFile, InputError, OutputError
from gvpipe.media.jpeg import decode_jpeg
from gvpipe.rate_control.trials import Trial, Trials
from gvpipe.web.export import MOST_ENCODES

WEB = Path(gvpipe.__file__).parent / "web"
PLAYER_BYTES = 0.73e6  # what a page may hold beside 1.35 times its file

Run = Callable[..., Finished]


def _embedded(page: Path) -> bytes:
    (text,) = re.findall(r'<script type="text/plain" id="video">(.*?)</script>', page.read_text("utf-8"))
    return base64.b64decode(text, validate=True)


@pytest.mark.parametrize(
    "settings", [{}, {"codec": "laplacian"}, {"codec": "pca"}, {"image": "jpeg"}, {"profile": "precise"}], ids=str
)
def test_page_holds_the_file_unchanged(settings: dict[str, Any], video: Path, tmp_path: Path) -> None:
    if settings:
        video = tmp_path / "other.mp4"
        gvpipe.encode(waving(8, 6), video, **settings)
    report = gvpipe.export_html(video, tmp_path / "page.html")
    page = tmp_path / "page.html"
    assert _embedded(page) == video.read_bytes()
    assert report == gvpipe.ExportReport(page.stat().st_size, video.stat().st_size)
    assert report.bytes <= 1.35 * video.stat().st_size + PLAYER_BYTES


@pytest.mark.parametrize("name", ["pca-1-still", "pdct-1", "pdct-1-still", "mcgv-1-klt"])
def test_page_holds_files_of_these_codecs_unchanged(name: str, tmp_path: Path) -> None:
    path = GOLDEN / f"{name}.mp4"
    report = gvpipe.export_html(path, tmp_path / "page.html")
    assert _embedded(tmp_path / "page.html") == path.read_bytes()
    assert not report.converted and report.bytes <= 1.35 * path.stat().st_size + PLAYER_BYTES


@pytest.mark.parametrize("stream", [False, True])
def test_a_page_of_a_file_on_a_web_server(stream: bool, video: Path, tmp_path: Path) -> None:
    """It holds the file in the plain layout, which loads faster from memory."""
    served = tmp_path / "served.mp4"
    gvpipe.restream(video, served, "stream" if stream else "plain")
    with serving(served.read_bytes()) as (address, _):
        gvpipe.export_html(address, tmp_path / "a.html")
    assert _embedded(tmp_path / "a.html") == video.read_bytes()


def test_page_asks_for_nothing_else(video: Path, tmp_path: Path) -> None:
    gvpipe.export_html(video, tmp_path / "page.html", up="z")
    text = (tmp_path / "page.html").read_text("utf-8")
    assert text.count("<script") == text.count("</script") == 3
    assert re.findall(r'(?:src|href)="([^"]*)"', text.split("<script")[0]) == ["data:,", "#video"]
    assert "default-src 'none'" in text  # the browser refuses what the player might ask for
    assert 'up="z"' in text
    assert "$$" not in text.split("<script")[0]


def test_title_is_text(video: Path, tmp_path: Path) -> None:
    named = video.rename(tmp_path / "<b>&.mp4")
    gvpipe.export_html(named, tmp_path / "page.html")
    assert "<title>&lt;b&gt;&amp;</title>" in (tmp_path / "page.html").read_text("utf-8")


@pytest.mark.parametrize(
    ("settings", "kind"),
    [
        ({"profile": "precise"}, "mcgv, profile h264-10"),
        pytest.param({"image": "jpeg"}, "mcgv, profile jpeg", marks=pytest.mark.slow),
        pytest.param(
            {"prediction": "blended", "transform": "klt", "profile": "precise"},
            "mcgv, transform klt, profile h264-10",
            marks=pytest.mark.slow,
        ),
        ({"codec": "laplacian"}, "laplacian"),
    ],
    ids=str,
)
def test_conversion_is_measured(settings: dict[str, Any], kind: str, tmp_path: Path) -> None:
    gvpipe.encode(waving(10, 12), tmp_path / "other.mp4", **settings)
    report = gvpipe.export_html(tmp_path / "other.mp4", tmp_path / "page.html", quality=90, convert=True)
    (tmp_path / "inside.mp4").write_bytes(_embedded(tmp_path / "page.html"))
    added = gvpipe.compare(gvpipe.decode(tmp_path / "other.mp4"), gvpipe.decode(tmp_path / "inside.mp4"))
    assert report.converted == kind
    assert (report.rmse_diag, report.max_diag, report.kg) == pytest.approx(
        (added.rmse_diag, added.max_diag, added.kg), rel=1e-9
    )
    assert 0 < (report.kg or 0) <= error_of(90)
    assert gvpipe.open(tmp_path / "inside.mp4").bitstream.header["profile"] == "h264-8"


@pytest.mark.slow
def test_conversion_adds_little(tmp_path: Path) -> None:
    """To a file at default quality; vertices that coincide do so in the page too."""
    sequence = gvpipe.read(SAMPLES / "creature.npz").part(0, 30)
    corners = sequence.faces.ravel()  # a soup: each triangle has vertices of its own
    soup = gvpipe.MeshSequence(sequence.read(0, 30)[:, corners], np.arange(len(corners), dtype=np.int32).reshape(-1, 3), 30.0)
    gvpipe.encode(soup, tmp_path / "other.mp4", "laplacian")
    gvpipe.export_html(tmp_path / "other.mp4", tmp_path / "page.html", convert=True)
    (tmp_path / "inside.mp4").write_bytes(_embedded(tmp_path / "page.html"))
    own, shown = (gvpipe.compare(soup, gvpipe.decode(tmp_path / name)).kg for name in ("other.mp4", "inside.mp4"))
    assert own is not None and shown is not None and shown <= 1.15 * own
    positions = gvpipe.decode(tmp_path / "inside.mp4").read(0, 30)
    _, first, number = np.unique(corners, return_index=True, return_inverse=True)
    assert np.array_equal(positions, positions[:, first[number]])


def test_a_conversion_takes_few_encodes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the error allowed is out of reach, the best of them is shown, and the report has its error."""
    gvpipe.encode(waving(8, 6), tmp_path / "other.mp4", "laplacian")
    qualities: list[float] = []
    encode = Trials.__call__

    def counted(self: Trials, quality: float) -> Trial:
        qualities.append(quality)
        trial = encode(self, quality)
        return dataclasses.replace(trial, errors=dataclasses.replace(trial.errors, kg=10 / len(qualities)))

    monkeypatch.setattr(Trials, "__call__", counted)
    report = gvpipe.export_html(tmp_path / "other.mp4", tmp_path / "page.html", quality=40, convert=True)
    assert len(qualities) == MOST_ENCODES and qualities == sorted(qualities)
    assert report.kg == 10 / MOST_ENCODES


def test_command_says_what_it_did(run: Run, video: Path, tmp_path: Path) -> None:
    gvpipe.encode(waving(8, 6), tmp_path / "other.mp4", "laplacian")
    plain = run("export-html", video, tmp_path / "a.html")
    assert plain.status == 0 and plain.err == "" and "kB" in plain.out
    converted = run("export-html", "--convert", tmp_path / "other.mp4", tmp_path / "b.html")
    assert converted.status == 0
    assert re.search(
        r"a conversion of laplacian to mcgv.*rmse \d\.\de-\d\d, at most \d\.\de-\d\d, of the diagonal \(KG \d\.\de-\d\d %\)",
        converted.err,
    )
    values = json.loads(run("export-html", video, tmp_path / "a.html", "--json").out)
    assert values == gvpipe.export_html(video, tmp_path / "a.html").to_json()


def test_play_prints_the_page_where_there_is_no_browser(run: Run, video: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr("sys.platform", "linux")
    done = run("play", video)
    page = Path(done.out.strip())
    assert done.status == 0 and "no browser can be opened here; open the page" in done.err
    assert _embedded(page) == video.read_bytes()
    shutil.rmtree(page.parent)


def test_play_opens_the_page_in_the_browser(run: Run, video: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []
    monkeypatch.setenv("BROWSER", "any")

    def noted(address: str) -> bool:
        opened.append(address)
        return True

    monkeypatch.setattr(webbrowser, "open", noted)
    done = run("play", video)
    assert done.out == f"{video} plays in your browser\n"
    (address,) = opened
    page = Path(address.removeprefix("file://"))
    assert _embedded(page) == video.read_bytes()
    shutil.rmtree(page.parent)


def test_what_cannot_be_exported(run: Run, video: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"end its name in \.html"):
        gvpipe.export_html(video, tmp_path / "page.mp4")
    with pytest.raises(InputError, match="up is 'x'"):
        gvpipe.export_html(video, tmp_path / "page.html", up="x")
    with pytest.raises(OutputError, match="no folder"):
        gvpipe.export_html(video, tmp_path / "nowhere" / "page.html")
    video.write_bytes(video.read_bytes()[:-9] + bytes(9))
    with pytest.raises(CorruptFile):
        gvpipe.export_html(video, tmp_path / "page.html")
    assert not list(tmp_path.glob("*.html"))
    assert run("play", tmp_path / "none.mp4").status == 1


def test_the_player_s_constants_are_python_s() -> None:
    script = runpy.run_path(str(ROOT / "tools" / "web_constants.py"))
    assert (WEB / "src" / "constants.js").read_text("utf-8") == script["make"](), "run tools/web_constants.py"


def test_the_player_s_constants_are_used() -> None:
    names = re.findall(r"^export const (\w+)", (WEB / "src" / "constants.js").read_text("utf-8"), re.MULTILINE)
    sources = [path.read_text("utf-8") for path in (WEB / "src").rglob("*.js") if path.name != "constants.js"]
    assert len(set(names)) == len(names) > 80
    assert [name for name in names if not any(re.search(rf"\b{name}\b", text) for text in sources)] == []


def test_licences_are_beside_the_bundles() -> None:
    packages = json.loads((WEB / "package.json").read_text())["devDependencies"]
    for bundle, names in {"player.js": ("three.js", "Draco"), "geometry-video.js": ("Draco",)}.items():
        notice = (WEB / "bundle" / bundle).read_text("utf-8")[:3000]
        assert all(name in notice for name in names)
    assert {path.stem for path in (WEB / "LICENSES").iterdir()} == {"NOTICE", "three", "draco"}
    assert set(packages) == {"three", "draco3d", "esbuild", "fflate"}  # the latter two only build


def test_lock_file_names_no_registry() -> None:
    lock = json.loads((WEB / "package-lock.json").read_text())
    packages = {name: package for name, package in lock["packages"].items() if name}
    assert all("resolved" not in package and package["integrity"].startswith("sha512-") for package in packages.values())


@pytest.mark.skipif(shutil.which("node") is None, reason="no node")
@pytest.mark.skipif(not (WEB / "node_modules").exists(), reason="no packages; npm ci in gvpipe/web")
def test_bundles_are_what_the_sources_build(tmp_path: Path) -> None:
    subprocess.run(["node", "build.mjs", tmp_path], cwd=WEB, check=True, capture_output=True)
    built = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    assert built == {path.name: path.read_bytes() for path in (WEB / "bundle").iterdir()}


def test_the_jpeg_that_probes_browsers_shows_decoders_that_differ() -> None:
    """Its checksum is that of OpenCV's samples; FFmpeg's decoder, which is off by one in places, has another."""
    source = (WEB / "src" / "jpeg_decoder.js").read_text("utf-8")
    data = base64.b64decode("".join(re.findall(r'^  "([A-Za-z0-9+/=]+)",$', source, re.MULTILINE)), validate=True)
    side, checksum = (int(re.findall(rf"const {name} = (\d+);", source)[0]) for name in ("PROBE_SIDE", "PROBE_CRC32"))
    with av.open(io.BytesIO(data), "r", format="jpeg_pipe") as file:
        other = next(file.decode(video=0)).to_ndarray(format="gray")
    assert zlib.crc32(decode_jpeg(data, side, side).tobytes()) == checksum != zlib.crc32(other.tobytes())
