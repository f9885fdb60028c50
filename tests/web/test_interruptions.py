"""What comes between: servers that fail, files that stall, scripts that pause, move and close while something is under way."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import browsers
import pages
import pytest
from file_server import serving
from sequences import waving

import gvpipe

pytestmark = [pytest.mark.skipif(bool(browsers.missing()), reason=browsers.missing()), pytest.mark.slow]
Run = Callable[..., Any]
WAIT = "const wait = (ms) => new Promise((resolve) => setTimeout(resolve, ms));"
# for 20 s at most: a field of 720,000 exact values takes five where two programs share a core
UNTIL = f"{WAIT} const until = async (test) => {{ for (let i = 0; i < 2000 && !test(); i++) await wait(10); return test(); }};"
READY = "await new Promise((resolve) => element.addEventListener('ready', resolve, { once: true }));"
NAME = "(error) => error.name"
STREAM: dict[str, Any] = {"quality": 80, "segment": 20}
CODECS: dict[str, dict[str, Any]] = {
    "mcgv": {"codec": "mcgv", "preset": "ultrafast", "gop": 20, "clusters": 2, **STREAM},
    "pca": {"codec": "pca", "quality": 99, "segment": 20},
}


@pytest.fixture(scope="module", params=CODECS)
def stream(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """A file of ten segments, too large for the first request."""
    path = tmp_path_factory.mktemp("stream") / "a.mp4"
    gvpipe.encode(waving(84, 200), path, stream=True, **CODECS[request.param])
    assert path.stat().st_size > 5 << 15
    return path.read_bytes()


def test_a_failure_in_mid_play_keeps_the_frame(player: Run, stream: bytes) -> None:
    with serving(stream) as (url, served):
        player(f"element.src = args[0]; {READY} element.playbackRate = 8; await element.play();", url)
        served.status = 500
        video, frame, ready, paused, kind, text = player(
            f"""{UNTIL} await until(() => element.error);
            return [element.video !== null, element.currentFrame, element.readyState, element.paused, element.error.kind,
              element.shadowRoot.querySelector(".message").textContent];"""
        )
        assert video and frame > 0 and ready == 4 and paused and kind == "load"
        assert "status 500" in text and "\n" not in text
        assert served.n_refused <= 10  # one for each segment at most, and not one for each frame
        served.status = 0
        played, later, error, text = player(
            f"""{UNTIL} await element.play(); const played = await until(() => element.ended);
            return [played, element.currentFrame, element.error, element.shadowRoot.querySelector(".message").textContent];"""
        )
        assert played and later == 199 and error is None and text == ""


def test_a_field_that_fails_keeps_the_video(player: Run, tmp_path: Path) -> None:
    path = tmp_path / "a.mp4"
    sequence = waving(60, 200)
    sequence = dataclasses.replace(sequence, fields={"height": sequence.read(0, 200)[:, :, 2].copy()})
    gvpipe.encode(sequence, path, stream=True, fields={"height": "exact"}, **CODECS["pca"])
    with serving(path.read_bytes()) as (url, served):
        player(f"element.src = args[0]; {READY}", url)
        served.status = 503
        kept = player(
            f"{UNTIL} element.setAttribute('field', 'height'); await until(() => element.error); return element.video !== null"
        )
        served.status = 0
        shown = player(
            f"""{UNTIL} element.removeAttribute("field"); element.setAttribute("field", "height");
            return until(() => !element.shadowRoot.querySelector(".legend").hidden);"""
        )
    assert kept and shown


def test_a_stall_is_told(player: Run, stream: bytes) -> None:
    with serving(stream) as (url, served):
        served.held = len(stream) * 2 // 3
        player(
            f"""window.log = [];
            for (const name of ["waiting", "playing", "ended"]) element.addEventListener(name, () => window.log.push(name));
            element.src = args[0]; {READY} await element.play();""",
            url,
        )
        waits, paused, text = player(
            f"""{UNTIL} const waits = await until(() => window.log.includes("waiting"));
            return [waits, element.paused, element.shadowRoot.querySelector(".message").textContent];"""
        )
        assert waits and not paused and "Waiting" in text
        served.go.set()
        log, text = player(
            f"""{UNTIL} await until(() => element.ended);
            return [window.log, element.shadowRoot.querySelector(".message").textContent];"""
        )
        assert log == ["playing", "waiting", "playing", "ended"] and text == ""


def test_pause_and_play_while_a_file_loads(player: Run, site: tuple[Path, str]) -> None:
    pages.encode_file(site, waving(10, 24))
    during, outcome, paused, frame = player(
        f"""{WAIT} element.src = "x.mp4"; const played = element.play().then(() => "plays", {NAME});
        const during = element.paused; element.pause(); {READY} await wait(300);
        return [during, await played, element.paused, element.currentFrame];"""
    )
    assert (during, outcome, paused, frame) == (False, "AbortError", True, 0)
    assert player(
        f"""{WAIT} element.remove(); const other = document.createElement("geometry-video"); other.autoplay = true;
        other.src = "x.mp4"; document.body.append(other); other.pause();
        await new Promise((resolve) => other.addEventListener("ready", resolve, {{ once: true }})); await wait(300);
        const held = other.paused; other.remove();
        const late = document.createElement("geometry-video"); late.src = "x.mp4";
        const played = late.play(); document.body.append(late); await played;
        const plays = !late.paused; late.remove();
        return [held, plays];"""
    ) == [True, True]


def test_asked_for_in_a_row_the_last_counts(player: Run, site: tuple[Path, str]) -> None:
    pages.encode_file(site, waving(10, 24))
    assert player(
        f"""{WAIT} element.src = "x.mp4"; element.seek(20); await element.play();
        const first = [element.paused, element.currentFrame >= 20];
        element.src = "x.mp4#2"; const lost = element.seek(7); element.src = "x.mp4#3"; await lost; {READY}
        const kept = element.currentFrame; const lone = document.createElement("geometry-video");
        const never = lone.play().catch({NAME}); lone.pause();
        const again = element.play().catch({NAME}); element.pause();
        return [first, kept, await never, await again];"""
    ) == [[False, True], 0, "AbortError", "AbortError"]


def test_pause_in_a_listener_counts(player: Run, site: tuple[Path, str]) -> None:
    pages.encode_file(site, waving(10, 24))
    for event in ("loadstart", "loadedmetadata", "canplay", "ready"):
        assert player(
            f"""{WAIT} element.autoplay = true; element.addEventListener(args[0], () => element.pause(), {{ once: true }});
            element.src = `x.mp4#${{args[0]}}`; {READY} await wait(200); const found = [element.paused, element.currentFrame];
            element.src = ""; return found;""",
            event,
        ) == [True, 0], event


def test_an_element_without_webcodecs(player: Run, site: tuple[Path, str]) -> None:
    pages.encode_file(site, waving(10, 24))
    last, bounds = player(
        f"""{UNTIL} delete window.VideoDecoder; element.src = "x.mp4"; {READY} await element.play();
        await until(() => element.ended); return [element.currentFrame, element.video.bounds.max.every(Number.isFinite)];"""
    )
    assert last == 23 and bounds


def test_a_level_that_is_left_is_no_error(player: Run, site: tuple[Path, str]) -> None:
    gvpipe.encode(waving(40, 24), site[0] / "p.mp4", codec="pca")
    assert player(
        f"""{WAIT} element.src = "p.mp4"; {READY} element.lod = 1; element.src = "p.mp4#again"; await element.play();
        await wait(200); return [element.error, element.paused];"""
    ) == [None, False]


def test_an_element_that_is_moved_goes_on(player: Run, site: tuple[Path, str]) -> None:
    pages.encode_file(site, waving(10, 24))
    assert player(
        f"""{WAIT} element.src = "x.mp4"; {READY} const {{ video }} = element; element.loop = true; await element.play();
        const box = document.createElement("div"); document.body.append(box); box.append(element); await wait(100);
        const same = element.video === video && !element.paused; element.remove(); await wait(0);
        return [same, element.video, element.readyState];"""
    ) == [True, None, 0]


def test_what_is_under_way_ends_when_it_is_closed(module: Run, stream: bytes) -> None:
    with serving(stream) as (url, served):
        served.held = len(stream) * 2 // 3
        assert (
            module(
                f"""const video = await GeometryVideo.load(args[0]); const pending = video.frame(199).catch({NAME});
            setTimeout(() => video.close(), 200);
            const found = [await pending];
            for (const work of [() => video.frame(0), () => video.play(() => {{}}), () => video.setLevel(0)]) {{
              found.push(await work().catch({NAME}));
            }}
            return found;""",
                url,
            )
            == ["AbortError"] * 4
        )
        served.go.set()


def test_loading_ends_by_a_signal(module: Run, tmp_path: Path) -> None:
    path = tmp_path / "a.mp4"
    gvpipe.encode(waving(60, 100), path, codec="pdct", quality=95)
    with serving(path.read_bytes()) as (url, served):
        served.rate = 8 * 20_000
        name, kept = module(
            f"""const control = new AbortController(); setTimeout(() => control.abort(), 300);
            const kept = await GeometryVideo.load(args[0], {{ signal: AbortSignal.abort() }}).catch({NAME});
            return [await GeometryVideo.load(args[0], {{ signal: control.signal }}).catch({NAME}), kept];""",
            url,
        )
    assert (name, kept) == ("AbortError", "AbortError")


def test_a_cut_connection_is_one_error(module: Run, stream: bytes, tmp_path: Path) -> None:
    path = tmp_path / "a.mp4"
    gvpipe.encode(waving(60, 100), path, codec="pdct", quality=95)
    for data in (stream, path.read_bytes()):
        with serving(data) as (url, served):
            served.cut = 30_000
            kind, message = module("return GeometryVideo.load(args[0]).catch((error) => [error.kind, error.message])", url)
            assert kind in ("load", "truncated") and "\n" not in message


@pytest.mark.parametrize(
    ("body", "wanted"),
    [
        ("GeometryVideo.load(null)", "TypeError: the source is Null; an address, a Blob or bytes are needed"),
        ("GeometryVideo.load('')", "TypeError: the source is empty; an address, a Blob or bytes are needed"),
        ("GeometryVideo.load('http://[bad')", "GeometryVideoError: http://[bad is no address"),
        ("video.play(() => {}, { rate: -1 })", "NotSupportedError: playbackRate is -1; 0.0625 to 16 are possible"),
        ("video.play(() => {}, { rate: NaN })", "NotSupportedError: playbackRate is NaN; 0.0625 to 16 are possible"),
        ("video.setLevel(0.5)", "GeometryVideoError: level 0.5: there are levels 0..0"),
        ("video.setLevel(null)", "GeometryVideoError: level null: there are levels 0..0"),
        ("video.frame(0, new Float32Array(3))", "RangeError: positions: a Float32Array of 300 numbers is needed"),
    ],
)
def test_wrong_arguments_are_one_error(body: str, wanted: str, module: Run, site: tuple[Path, str]) -> None:
    pages.encode_file(site, waving(10, 6))
    found = module(
        f"""const video = await GeometryVideo.load("x.mp4");
        return {body}.catch((error) => `${{error.name}}: ${{error.message}}`);"""
    )
    assert found == wanted


def test_a_page_that_forbids_webassembly_says_so(browser: Any, site: tuple[Path, str]) -> None:
    pages.encode_file(site, waving(10, 6))
    policy = "default-src 'self'; script-src 'self' 'unsafe-inline'; worker-src blob:; style-src 'unsafe-inline'"
    meta = f'<meta http-equiv="Content-Security-Policy" content="{policy}">'
    (site[0] / "strict.html").write_text(pages.MODULE_PAGE.replace("<script", f"{meta}<script", 1))
    browser.get(f"{site[1]}/strict.html")
    kind, message = pages.run(browser, "return GeometryVideo.load('x.mp4').catch((error) => [error.kind, error.message])")
    assert kind == "unsupported" and "'wasm-unsafe-eval'" in message
