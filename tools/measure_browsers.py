"""How fast browsers decode: ``python tools/measure_browsers.py FILE.mp4... [--browser chromium] [--loops 2]``.

A page in each browser that is installed loads each file and asks for all frames in order, without drawing. Prints a line
each: seconds from the request to the first frame, and frames per second after that, through all loops.
"""

from __future__ import annotations

import argparse
import os
import shutil
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from browsers import NEEDS, browser, missing, served
from pages import run, write_pages

DECODE = """const [name, loops] = args;
const started = performance.now();
const video = await GeometryVideo.load(name);
await video.frame(0);
const first = performance.now();
for (let k = 0; k < loops * video.frameCount; k++) await video.frame(k % video.frameCount);
return [(first - started) / 1000, (1000 * loops * video.frameCount) / (performance.now() - first)];"""


def main() -> None:
    """Measure, and print one line per browser and file."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE.mp4", help="geometry videos")
    parser.add_argument("--browser", choices=tuple(NEEDS), action="append", help="may be given several times [default: all]")
    parser.add_argument("--loops", type=int, default=2, help="how often all frames are asked for [default: 2]")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="gvpipe-") as place:
        folder = Path(place)
        (folder / "site").mkdir()
        write_pages(folder / "site")
        for number, file in enumerate(options.files):
            shutil.copy(file, folder / "site" / f"{number}.mp4")
        with served(folder / "site") as address:
            for name in options.browser or NEEDS:
                if reason := missing(name):
                    print(f"{name}: {reason}")
                    continue
                print(f"{name}; {os.getloadavg()[0]:.1f} processes want a core")
                with browser(name, folder / name, compiles=True) as driver:
                    driver.get(f"{address}/module.html")
                    for number, file in enumerate(options.files):
                        first, rate = run(driver, DECODE, f"{number}.mp4", options.loops)
                        print(f"  {file.name}: first frame after {first:.2f} s, then {rate:.0f} frames/s", flush=True)


if __name__ == "__main__":
    main()
