"""The table of real assets in docs/formats.md: what is read of each, carried, written, and how far it is from its reference.

    python tools/asset_table.py ../shared/data              # print it
    python tools/asset_table.py ../shared/data --write      # between the markers of docs/formats.md
    python tools/asset_table.py ../shared/data --only mix1  # assets whose path holds this text

The folder has ``assets/MANIFEST.csv`` (columns file, kind, reference), the files, and ``reference/*.npz`` by other readers.

- Read: frames, vertices and triangles, and what is there beside.
- Carried: what of the first frames differs after they were encoded by ``pca`` and decoded, beyond the bounds.
- Written: what of the decoded sequence differs after it was written in a format and read again.
- Distance: the largest of a vertex from its reference, at all its times, as part of the diagonal.
"""

from __future__ import annotations

import argparse
import csv
import re
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from check_assets import compare_gltf
from check_round_trips import PATTERNS, again, differences
from check_scenes import check_file, mesh_beside
from check_simulations import ASSETS, Asset, from_reference

import gvpipe
from gvpipe.foundation.errors import GvpipeError, InputError
from gvpipe.model.sequence import MeshSequence

PAGE = Path(__file__).parent.parent / "docs" / "formats.md"
MARKED = re.compile(r"(<!-- assets -->\n).*?(<!-- end -->)", re.DOTALL)
SCENES = ("usd", "abc", "pointcache")
FORMATS = ("glb", "usdc", "abc")
SINGLE = (".gltf", ".glb", ".usda", ".usdc", ".usd", ".usdz", ".abc", ".pc2", ".mdd")
ROUNDING = 1e-5  # of normals and other numbers that a format stores
FRAMES = 3  # of each asset, that are encoded and written
NAMES = 4  # of attributes or fields in a cell
LONGEST = 150  # characters of a cell
EXPLAINED = {
    "bunny_walk_fbx": "; Blender's exporter left keys out (its Simplify): 41 of 441 curves have all 24",
    "max_cache_box.pc2": "object space, another order: see its .fbx",
}


@dataclass(frozen=True)
class Source:
    """One row: a file or a pattern of frames.

    Args:
        name: below the folder of assets.
        kind: of the manifest.
        references: names in the folder of references.
        asset: how simulations and FBX files are compared.
    """

    name: str
    kind: str
    references: tuple[str, ...] = ()
    asset: Asset | None = None


def main() -> int:
    """Print or write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="with assets/MANIFEST.csv and reference/")
    parser.add_argument("--only", default="", help="assets whose path holds this text")
    parser.add_argument("--write", action="store_true", help="write the table into docs/formats.md")
    given = parser.parse_args()
    heads = ("asset", "read", "carried", *(f"written: {kind}" for kind in FORMATS), "distance")
    lines = [f"| {' | '.join(heads)} |", "| --- " * len(heads) + "|"]
    for source in sources(given.folder):
        if given.only in source.name:
            lines.append(f"| {' | '.join(cells(given.folder, source))} |")
            print(lines[-1], flush=True)
    if given.write:
        page = PAGE.read_text("utf-8")
        PAGE.write_text(MARKED.sub(lambda found: found[1] + "\n".join(lines) + "\n" + found[2], page), "utf-8")
    return 0


def sources(folder: Path) -> Iterator[Source]:
    """Yield the rows: scenes and caches by the manifest, sequences of files by their folder, the rest by `ASSETS`."""
    with open(folder / "assets" / "MANIFEST.csv", newline="") as file:
        entries = list(csv.DictReader(file))
    seen: set[str] = set()
    for entry in entries:
        path = Path(entry["file"])
        references = tuple(entry["reference"].split())
        if entry["kind"] in ("objseq", "plyseq", "offseq") and str(path.parent) not in seen:
            seen.add(str(path.parent))
            yield Source(f"{path.parent}/*.{entry['kind'][:3]}", entry["kind"], references)
        elif entry["kind"] in ("gltf", "gltf_broken", *SCENES) and path.suffix.lower() in SINGLE:
            yield Source(entry["file"], entry["kind"], references)
    for asset in ASSETS:
        yield Source(asset.path, "listed", (), asset)


def cells(folder: Path, source: Source) -> list[str]:
    """The cells of a row."""
    path = folder / "assets" / source.name
    clip = source.asset.clip if source.asset else None
    name = source.name + (f" ({clip})" if clip else "")
    try:
        sequence = gvpipe.read(path, clip=clip, mesh=mesh_beside(path))
        held = describe(sequence)
    except InputError as exc:
        return cleaned([name, f"refused: {exc}", *["-"] * (2 + len(FORMATS))], path)
    try:
        carried, *written = round_trip(sequence)
    except GvpipeError as exc:
        carried, written = f"refused: {exc}", ["-"] * len(FORMATS)
    return cleaned([name, held, carried, *written, distance(folder, source, path, sequence)], path)


def describe(sequence: MeshSequence) -> str:
    """What was read, short."""
    held = [f"{len(sequence)} x {sequence.n_vertices}, {len(sequence.faces)} triangles, {sequence.fps:.4g} fps"]
    counts = (("parts", len(sequence.parts)), ("materials", len(sequence.materials)), ("images", len(sequence.images)))
    held += [f"{count} {what}" for what, count in counts if count]
    for what, names in (("", list(sequence.attributes)), ("fields ", list(sequence.fields))):
        more = f" and {len(names) - NAMES} more" if len(names) > NAMES else ""
        held += [what + " ".join(names[:NAMES]) + more] if names else []
    return ", ".join(held)


def round_trip(sequence: MeshSequence) -> list[str]:
    """What differs after encoding, and after writing in each format."""
    first = sequence.part(0, min(FRAMES, len(sequence)))
    with tempfile.TemporaryDirectory() as folder:
        video = Path(folder, "a.mp4")
        gvpipe.encode(first, video, "pca")
        decoded = gvpipe.decode(video)
        carried = ", ".join(differences(first, decoded, gvpipe.info(video))) or "all"
        return [carried, *(shortened(again(decoded, Path(folder, PATTERNS[kind]), ROUNDING)) for kind in FORMATS)]


def shortened(text: str) -> str:
    """What differs, without what the writer said, and without the metadata, where each format has its own."""
    found = text.split(" (said: ")[0].replace(", split along seams", " (seams)").split(", ")
    return ", ".join(one for one in found if one != "metadata") or "equal"


def distance(folder: Path, source: Source, path: Path, sequence: MeshSequence) -> str:
    """The distance from the reference, in words."""
    explained = next((text for part, text in EXPLAINED.items() if part in source.name), "")
    references = [folder / "reference" / name for name in source.references]
    if source.asset is not None:
        reference = source.asset.reference
        if not reference:
            return "no reference"
        found = from_reference(sequence, source.asset, folder / "reference" / f"{reference}.npz")
        return re.sub(r"^\d+ reference times: (vertices )?", "", found) + explained
    if source.kind in SCENES:
        return explained or check_file(path, source.name, references, mesh_beside(path)).distance
    if not references:
        return "no reference"
    if source.kind == "gltf":
        own = [name for name in references if "blender" not in name.name]  # Blender joins what a node shows
        return f"{max(gltf_distance(path, name, sequence) for name in own):.1e}" if own else "no reference"
    with np.load(references[0]) as held:
        expected = held["positions"]
        frames = held["frames"].astype(int) if "frames" in held.files else np.arange(len(expected))
    read = np.stack([sequence.read_absolute(frame, frame + 1)[0] for frame in frames - frames.min()])
    diagonal = float(np.linalg.norm(np.ptp(expected[0], axis=0)))
    if read.shape != expected.shape:
        return "of another order"
    return f"{np.linalg.norm(read - expected, axis=2).max() / diagonal:.1e}"


def gltf_distance(path: Path, reference: Path, sequence: MeshSequence) -> float:
    """The largest over all clips of a reference."""
    with np.load(reference) as archive:
        held = dict(archive)
    return max(one.distance for one in compare_gltf(path, held, sequence))


def cleaned(row: list[str], path: Path) -> list[str]:
    """Cells without paths of this machine and without bars."""
    short = [re.sub(r"/\S*/", "", cell.replace(str(path.parent) + "/", "")) for cell in row[1:]]
    return [(cell if len(cell) <= LONGEST else cell[:LONGEST] + " ...").replace("|", "\\|") for cell in (row[0], *short)]


if __name__ == "__main__":
    sys.exit(main())
