"""Make the geometry videos of docs/gallery.md by the commands that stand there.

    python tools/make_gallery.py [OUTPUT_FOLDER]

They go to docs/gallery unless a folder is given. The first encodes compile kernels, which takes a minute once.
"""

from __future__ import annotations

import argparse
import re
import shlex
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "gallery.md"
COMMAND = re.compile(r"`gvpipe (encode samples/\S+ )(\w+\.mp4)([^`]*)`")


def commands(page: str) -> dict[str, list[str]]:
    """The arguments of each file's command, of which the second one names the input and the third one the file."""
    return {file: shlex.split(start + file + options) for start, file, options in COMMAND.findall(page)}


def main() -> None:
    """Run the commands."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", type=Path, default=PAGE.with_suffix(""), metavar="OUTPUT_FOLDER")
    folder = parser.parse_args().folder
    folder.mkdir(parents=True, exist_ok=True)
    for file, (name, source, _, *options) in commands(PAGE.read_text("utf-8")).items():
        command = [sys.executable, "-m", "gvpipe", name, ROOT / source, folder / file, *options]
        subprocess.run(command, check=True)


if __name__ == "__main__":
    main()
