"""What each simulation file of a folder of assets loses on its way through a geometry video, as a Markdown table.

    python tools/check_losses.py ../shared/data

Each file is read without and with its volume, encoded (codec pca), decoded to .pvd, .vtkhdf and .xdmf, and read again. "same":
positions, triangles, parts, and names of attributes and fields are those of the decoded video, bit for bit. Other words are
what a step said: what is not carried, a note, an error, or what differs.
"""

from __future__ import annotations

import argparse
import re
import tempfile
from pathlib import Path

import numpy as np
from check_simulations import ASSETS, Asset

import gvpipe
from gvpipe.foundation.errors import GvpipeError
from gvpipe.model.sequence import MeshSequence

FORMATS = (".pvd", ".vtkhdf", ".xdmf")
CARRIED_AGAIN = re.compile(r"^the source has what is not carried: ")  # a note that says what the column before says
NO_PLACE = re.compile(r"\w+ has no place for (.*); left out.*")  # but for metadata: of all files the name of the source
OF_PARTS = ("other parts", "other volume")  # whose blocks are parts
BY_DESIGN = re.compile(r"whole numbers alone, so kept exactly|--volume carries volume cells")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path, help="folder with assets/")
    given = parser.parse_args()
    print(f"| file | volume | not carried | notes | {' | '.join(FORMATS)} |")
    print("|" + " --- |" * (4 + len(FORMATS)))
    for asset in ASSETS:
        if asset.path.startswith("sim/"):
            for volume in (False, True):
                print(_row(asset, given.data / "assets", volume), flush=True)


def _row(asset: Asset, folder: Path, volume: bool) -> str:
    """One line of the table."""
    head = [asset.path.removeprefix("sim/"), "yes" if volume else "no"]
    with tempfile.TemporaryDirectory() as held:
        try:
            video = Path(held) / "a.mp4"
            report = gvpipe.encode(gvpipe.read(folder / asset.path, volume=volume), video, "pca")
            decoded = gvpipe.read(video)
        except GvpipeError as exc:
            return _line([*head, "-", f"refused: {str(exc).replace(str(folder), '')}", *("-" for _ in FORMATS)])
        said = [note for note in report.notes if not CARRIED_AGAIN.search(note) and not BY_DESIGN.search(note)]
        written = [_written(decoded, Path(held) / f"a{suffix}") for suffix in FORMATS]
    left = [name for name in report.not_carried if not name.startswith("field data")]
    n_whole = len(report.not_carried) - len(left)
    left += [f"field data ({n_whole})"] if n_whole else []
    return _line([*head, ", ".join(left) or "nothing", "; ".join(said) or "-", *written])


def _written(given: MeshSequence, path: Path) -> str:
    """What a format said of a sequence, and how it differs when it is read again."""
    try:
        notes = gvpipe.write(given, path)
        found = gvpipe.read(path, volume=given.volume is not None)
    except GvpipeError as exc:
        return f"error: {str(exc).replace(str(path.parent), '')}"
    said = []
    for note in notes:
        lost = NO_PLACE.fullmatch(note)
        names = [name for name in lost.group(1).split(", ") if name != "metadata"] if lost else []
        said += [f"no {', '.join(names)}"] if names else [] if lost else [note]
    differing = [each for each in _differences(given, found) if not ("no parts" in said and each in OF_PARTS)]
    return "; ".join([*said, *differing]) or "same"


def _differences(given: MeshSequence, found: MeshSequence) -> list[str]:
    """What is not as it was."""
    is_same = {
        "positions": np.array_equal(given[:], found[:]),
        "triangles": {*map(frozenset, given.faces.tolist())} == {*map(frozenset, found.faces.tolist())},
        "parts": [part.name for part in given.parts] == [part.name for part in found.parts],
        "names of numbers": {*given.fields, *given.attributes} == {*found.fields, *found.attributes},
        "volume": _inside(given) == _inside(found),
    }
    return [f"other {name}" for name, same in is_same.items() if not same]


def _inside(sequence: MeshSequence) -> tuple[object, ...]:
    volume = sequence.volume
    if volume is None:
        return ()
    return len(volume.cells.types), volume.n_points, {*volume.point_fields}, {*volume.cell_fields}, volume.blocks


def _line(cells: list[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


if __name__ == "__main__":
    main()
