"""The plots of the documentation's curves, in Chromium: a pointer, keys, and the legend."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import browsers
import pytest
from folders import ROOT
from pages import run

pytestmark = [pytest.mark.slow, pytest.mark.skipif(bool(browsers.missing()), reason=browsers.missing())]
DOCS = ROOT / "docs"
READY = """const root = document.querySelector("#curves");
    const curves = () => root.querySelectorAll("g[data-codec]");
    for (let k = 0; k < 100 && !curves().length; k++) await new Promise((done) => setTimeout(done, 50));
    const plot = root.querySelector("svg"), status = root.querySelector("[role=status]");"""


@pytest.fixture
def page(site: tuple[Path, str], browser: Any) -> Any:
    """The browser with the plots open, as the site has them."""
    text = (DOCS / "curves.md").read_text("utf-8")
    element = text[text.index('<div id="curves"') : text.index("</script>")] + "</script>"
    (site[0] / "page").mkdir(exist_ok=True)
    (site[0] / "page" / "curves.html").write_text(f'<!doctype html><link rel="icon" href="data:,">{element}', "utf-8")
    for name in ("curves.js", "curve-points.js"):
        shutil.copy(DOCS / name, site[0])
    shutil.copytree(DOCS / "benchmarks" / "curves", site[0] / "benchmarks" / "curves", dirs_exist_ok=True)
    browser.get(f"{site[1]}/page/curves.html")
    return browser


def test_keys_and_the_pointer_choose_points(page: Any) -> None:
    keys = """const press = (key) => plot.dispatchEvent(new KeyboardEvent("keydown", { key, cancelable: true }));
    for (const key of ["ArrowRight", "ArrowDown", "ArrowRight"]) press(key);"""
    told = run(page, f"{READY}{keys} return [status.textContent, curves()[1].dataset.codec];")
    assert told[0].startswith(f"{told[1]}\nquality 15\n")
    pointed = """const boxOf = (codec) => codec.lastElementChild.getBoundingClientRect();
    const highest = [...curves()].sort((a, b) => boxOf(a).y - boxOf(b).y)[0], mark = boxOf(highest); // no other is near
    plot.dispatchEvent(new PointerEvent("pointermove", { clientX: mark.x + 2, clientY: mark.y + 2 }));
    const tip = root.querySelector(".tip"), box = tip.getBoundingClientRect();
    return [tip.textContent, highest.dataset.codec, tip.hidden, Math.abs(box.top - mark.bottom) < 40];"""
    text, codec, is_hidden, is_near = run(page, f"{READY}{pointed}")
    assert text.startswith(f"{codec}\n") and not is_hidden and is_near


def test_the_legend_hides_a_codec_on_all_sequences(page: Any) -> None:
    chosen = """const before = curves().length, codec = curves()[0].dataset.codec;
    root.querySelector("button").click();
    const [sequence, metric] = root.querySelectorAll("select");
    const title = plot.getAttribute("aria-label");
    sequence.value = sequence.options[1].value;
    sequence.dispatchEvent(new Event("change"));
    metric.value = "max_diag";
    metric.dispatchEvent(new Event("change"));
    await new Promise((done) => setTimeout(done, 500));
    return [before, title, plot.getAttribute("aria-label"), root.querySelector(`[data-codec="${codec}"]`) === null];"""
    before, title, other, is_gone = run(page, f"{READY}{chosen}")
    assert f"{before - 1} codecs" in title and title.startswith("KG error") and other.startswith("largest error") and is_gone
