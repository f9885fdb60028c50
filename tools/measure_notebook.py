"""How soon a cell of JupyterLab plays, and how fast: ``python tools/measure_notebook.py FILE.mp4... [--runs 3]``.

Starts JupyterLab and headless Chromium (no GPU: WebGL on the processor), and for each file a kernel of its own that has
imported gvpipe. Runs a cell with ``gvpipe.show(FILE)`` several times and prints, for each: seconds from the cell's start to the
second frame that the player shows, and frames per second while it plays. Needs ``pip install jupyterlab 'gvpipe[notebook]'``.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from browsers import browser as running
from jupyter_lab import command, in_player, lab, open_notebook, write_notebook

MEASURE = """await jupyterapp.commands.execute("notebook:clear-all-cell-outputs");
    await until(() => !document.querySelector("geometry-video"), "the player goes");
    await jupyterapp.commands.execute("notebook:insert-cell-below");
    jupyterapp.shell.currentWidget.content.activeCell.model.sharedModel.setSource(`gvpipe.show("${args[0]}")`);
    const start = performance.now();
    jupyterapp.commands.execute("notebook:run-cell");
    while (!document.querySelector("geometry-video")) await new Promise((resolve) => setTimeout(resolve, 5));
    const times = new Map();
    document.querySelector("geometry-video").addEventListener("frame", ({ detail }) => times.set(detail, performance.now()));
    await until(() => times.size >= 2, "frames");
    const [, second] = times.values();
    let shown = 0;
    document.querySelector("geometry-video").addEventListener("frame", () => shown++);
    await new Promise((resolve) => setTimeout(resolve, 1000 * args[1]));
    return [(second - start) / 1000, shown / args[1]];"""


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("files", type=Path, nargs="+", help="geometry videos")
    parser.add_argument("--runs", type=int, default=3, help="cells a file, default %(default)s; the first starts the player")
    parser.add_argument("--seconds", type=float, default=5, help="how long frames are counted, default %(default)s")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder, settings, profile = (Path(name) / part for part in ("notebooks", "settings", "profile"))
        for made in (folder, settings, profile):
            made.mkdir()
        with lab(folder, settings) as address, running("chromium", profile, (1100, 900)) as driver:
            for file in options.files:
                shutil.copy(file, folder / file.name)
                write_notebook(folder / f"{file.stem}.ipynb", ["import gvpipe"])
                open_notebook(driver, address, f"{file.stem}.ipynb")
                command(driver, "notebook:run-all-cells")
                for i in range(options.runs):
                    seconds, rate = in_player(driver, MEASURE, file.name, options.seconds)
                    print(f"{file.name}, cell {i + 1}: plays after {seconds:.2f} s, {rate:.1f} frames a second")


if __name__ == "__main__":
    main()
