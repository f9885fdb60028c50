"""How fast the web player is: ``python tools/measure_player.py FILE.mp4 [--size 512] [--seconds 5]``.

Exports the file, opens the page in headless Chromium (no GPU: WebGL on the processor) and prints the numbers of docs/player.md:
unique frames per second while playing, the longest time between two, milliseconds for a frame at random, and for loading; and
how often and how long the page was busy for more than 50 ms at once, from its start to the end of playing.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
from pathlib import Path

import gvpipe

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from browsers import browser as running

MEASURE = """
const [size, seconds, done] = arguments;
(async () => {
  await customElements.whenDefined("geometry-video");
  const element = document.querySelector("geometry-video");
  const canvas = element.shadowRoot.querySelector("canvas");
  const busy = [];
  const keep = ({ startTime, duration }) => busy.push([startTime, duration]);
  const observer = new PerformanceObserver((list) => list.getEntries().forEach(keep));
  observer.observe({ type: "longtask", buffered: true });
  if (!element.video) await new Promise((resolve) => element.addEventListener("ready", resolve, { once: true }));
  const loaded = performance.now();
  element.style.cssText = `width: ${size}px; height: ${size}px`;
  element.style.height = `${2 * size - canvas.clientHeight}px`; // the bar comes below the picture
  if (element.paused) await element.play();
  const times = [];
  const record = () => times.push(performance.now());
  element.addEventListener("frame", record);
  await new Promise((resolve) => setTimeout(resolve, 1000 * seconds));
  element.removeEventListener("frame", record);
  observer.disconnect();
  const frames = element.video.frameCount;
  let milliseconds = 0;
  for (let i = 0; i < 40; i++) {
    const start = performance.now();
    await element.video.frame((i * 61) % frames);
    milliseconds += performance.now() - start;
  }
  const gaps = times.slice(1).map((time, i) => time - times[i]);
  done([canvas.clientWidth, canvas.clientHeight, times.length / seconds, Math.max(...gaps), milliseconds / 40, loaded, busy]);
})();
"""


def main() -> None:
    """Measure, and print one line per number."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", type=Path, metavar="FILE.mp4", help="a geometry video")
    parser.add_argument("--size", type=int, default=512, help="pixels, width and height of the picture [default: 512]")
    parser.add_argument("--seconds", type=float, default=5, help="how long it plays [default: 5]")
    options = parser.parse_args()
    folder = Path(tempfile.mkdtemp(prefix="gvpipe-"))
    try:
        report = gvpipe.export_html(options.file, folder / "page.html")
        with running("chromium", folder / "profile", (options.size + 100, options.size + 300)) as browser:
            browser.get((folder / "page.html").as_uri())
            width, height, rate, gap, seek, load, busy = browser.execute_async_script(MEASURE, options.size, options.seconds)
    finally:
        shutil.rmtree(folder)
    size = options.file.stat().st_size
    print(f"page: {report.bytes} bytes; 1.35 x file + 0.7 MB = {1.35 * size + 0.7e6:.0f}")
    print(f"playing at {width}x{height}: {rate:.1f} unique frames/s, longest gap {gap:.0f} ms")
    print(f"random frame: {seek:.1f} ms; page ready after {load:.0f} ms")
    print("busy for more than 50 ms:", ", ".join(f"{length:.0f} ms at {at:.0f}" for at, length in busy) or "never")


if __name__ == "__main__":
    main()
