"""How soon a long capture plays over a slow connection: ``python tools/measure_stream.py capture.mp4 [--rate 10]``.

Makes the capture, unless the file is there: 20,000 vertices and 18,000 frames at 30 per second, in the stream layout. Three
segments of `samples/capture.py` are encoded, and repeated. A server on this machine sends it at so many Mbit/s to headless
Chromium (no GPU: WebGL on the processor) and to a Python process. Prints one line per number: what docs/web.md quotes.
"""

from __future__ import annotations

import argparse
import contextlib
import dataclasses
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gvpipe
from gvpipe.coding.registry import segment_parts
from gvpipe.container.bitstream import Bitstream
from gvpipe.container.mp4 import load, read_file, write_file

sys.path.insert(0, str(Path(__file__).parents[1] / "samples"))
sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
import capture
from browsers import browser as running
from browsers import served as served_folder
from file_server import Served, serving
from pages import run, write_pages

ENCODED = 3  # segments
JUMPS = (1 / 3, 0.9, 0.5, 0.05, 0.7)  # of the length
LOAD = """const started = performance.now();
const element = document.querySelector("geometry-video");
const times = {};
const note = (name) => () => (times[name] ??= performance.now() - started);
element.addEventListener("levelchange", () => requestAnimationFrame(note("coarse")), { once: true });
element.addEventListener("ready", () => requestAnimationFrame(note("whole")));
const ready = new Promise((resolve, reject) => {
  element.addEventListener("ready", resolve, { once: true });
  element.addEventListener("error", ({ detail }) => reject(detail), { once: true });
});
element.src = args[0];
await ready;
await new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve)));
return times;"""
SEEK = """const element = document.querySelector("geometry-video");
const started = performance.now();
await element.seek(args[0]);
return performance.now() - started;"""
PLAY = """const element = document.querySelector("geometry-video");
await element.seek(0);
const times = [];
const note = () => times.push(performance.now());
element.addEventListener("frame", note);
await element.play();
await new Promise((resolve) => setTimeout(resolve, 1000 * args[0]));
element.removeEventListener("frame", note);
element.pause();
return [times.length / args[0], Math.max(...times.slice(1).map((time, i) => time - times[i]))];"""


def main() -> None:
    """Measure, and print one line per number."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", type=Path, metavar="FILE.mp4", help="in the stream layout; made if it is not there")
    parser.add_argument("--codec", default="pca", help="of a capture that is made [default: pca]")
    parser.add_argument("--frames", type=int, default=18_000, help="of a capture that is made [default: 18000]")
    parser.add_argument("--rate", type=float, default=10, help="Mbit/s [default: 10]")
    parser.add_argument("--seconds", type=float, default=10, help="how long it plays [default: 10]")
    parser.add_argument("--times", type=int, default=3, help="how often the first frame is measured [default: 3]")
    options = parser.parse_args()
    if not options.file.exists():
        make(options.file, options.codec, options.frames)
    with gvpipe.open(options.file) as video:
        frames, vertices, codec = len(video), video.shape[1], video.bitstream.codec
    print(f"file: {codec}, {vertices} vertices, {frames} frames, {options.file.stat().st_size} bytes; {options.rate:g} Mbit/s")
    print(f"processes that want a core: {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    with serving(options.file.read_bytes()) as (url, served):
        served.rate = 1e6 * options.rate
        with tempfile.TemporaryDirectory(prefix="gvpipe-") as folder:
            measure_browser(Path(folder), url, served, frames, options)
            measure_python(Path(folder), url, codec)


def make(path: Path, codec: str, n_frames: int) -> None:
    """Encode some segments of a capture, and write them again and again until there are that many frames."""
    gvpipe.encode(capture.make_capture(ENCODED * capture.SEGMENT), path, codec, segment=capture.SEGMENT, stream=True)
    bitstream = repeated(load(read_file(path)), n_frames // (ENCODED * capture.SEGMENT))
    write_file(bitstream, path, parts=segment_parts(bitstream))


def repeated(bitstream: Bitstream, times: int) -> Bitstream:
    """The bitstream of a sequence that repeats that of a codec without pictures, all of whose frames differ."""
    sections: dict[str, bytes] = {}
    numbered: list[tuple[str, int, bytes]] = []
    for name, data in bitstream.sections.items():
        match = re.fullmatch(r"(\w+)\.(\d+)", name)
        if match and match[1] != "field":
            numbered.append((match[1], int(match[2]), data))
        else:
            sections[name] = data
    count = 1 + max(number for _, number, _ in numbered)
    for again in range(times):
        sections |= {f"{name}.{again * count + number}": data for name, number, data in numbered}
    grown = ("segments", "clips", "steps")
    header: dict[str, Any] = {key: times * value if key in grown else value for key, value in bitstream.header.items()}
    return dataclasses.replace(bitstream, n_frames=times * bitstream.n_frames, header=header, sections=sections)


def measure_browser(folder: Path, url: str, served: Served, frames: int, options: argparse.Namespace) -> None:
    """Print how Chromium plays the file."""
    write_pages(folder)
    with served_folder(folder) as address, running("chromium", folder / "profile") as browser:
        firsts, worked = [], []
        for _ in range(options.times):
            served.sent.clear()
            browser.get(f"{address}/player.html")
            before = processor_time(folder / "profile")
            firsts.append(run(browser, LOAD, url))
            worked.append(processor_time(folder / "profile") - before)
        for name, words in {"coarse": "coarsest level drawn", "whole": "whole mesh drawn"}.items():
            print(f"Chromium: {words} after {seconds([first[name] / 1000 for first in firsts if name in first])}")
        print(f"Chromium: {seconds(worked)} of processor time, and {served.n_sent} bytes, until then")
        jumps = [run(browser, SEEK, int(jump * frames)) / 1000 for jump in JUMPS]
        print(f"Chromium: a jump takes {seconds(jumps)}")
        rate, gap = run(browser, PLAY, options.seconds)
        print(f"Chromium: plays {rate:.1f} frames per second, longest gap {gap:.0f} ms")
        memory = max(memory_of(process) for process in renderers(folder / "profile"))
        print(f"Chromium: memory of the page's process {memory:.0f} MB; {served.n_sent} bytes were sent in all")


def renderers(profile: Path) -> Iterator[Path]:
    """The folder in ``/proc`` of each page's process of a browser."""
    for process in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):  # it has ended meanwhile
            words = (process / "cmdline").read_bytes().decode("utf-8", "replace")
            if "--type=renderer" in words and str(profile) in words:
                yield process


def memory_of(process: Path) -> float:
    """What is a process's own, MB."""
    lines = (process / "smaps_rollup").read_text().splitlines()
    return sum(int(line.split()[1]) for line in lines if line.startswith(("Private_Clean", "Private_Dirty"))) / 1024


def processor_time(profile: Path) -> float:
    """Seconds that a browser's pages have worked so far."""
    ticks = 0
    for process in renderers(profile):
        fields = (process / "stat").read_text().rpartition(")")[2].split()
        ticks += int(fields[11]) + int(fields[12])
    return ticks / os.sysconf("SC_CLK_TCK")


def measure_python(folder: Path, url: str, codec: str) -> None:
    """Print how a process of its own reads the file."""
    warm = folder / "warm.mp4"
    gvpipe.encode(capture.make_capture(capture.SEGMENT), warm, codec, segment=capture.SEGMENT, stream=True)
    done = subprocess.run([sys.executable, "-c", capture.READER, str(warm), url], check=True, capture_output=True, text=True)
    for line in done.stdout.splitlines():
        print(f"Python: {line}")


def seconds(times: list[float]) -> str:
    """Numbers for people."""
    return f"{', '.join(f'{time:.2f}' for time in times)} s"


if __name__ == "__main__":
    main()
