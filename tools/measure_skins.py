"""Bytes of skinned GLB files beside those of morph targets and of geometry videos: the table of docs/engines.md.

    python tools/measure_skins.py ../shared/data/*.npz [--gltfpack COMMAND] [--json OUT.json]

Of each input: the source's bytes (positions as float32, or the file if it is no .npz), the MP4 at default settings, the GLB
with morph targets, that one after gltfpack, the GLB with a skeleton at KG 0.15, and the same compressed. KG is that of the
compressed file. Times are of `gvpipe.skin`, over that of `gvpipe.encode`.
"""

from __future__ import annotations

import argparse
import json
import shlex
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

import gvpipe
from gvpipe.foundation.arrays import Float32
from gvpipe.io.gltf.scene_writing import prepare, world_matrix
from gvpipe.metrics.vertex_errors import measure_errors
from gvpipe.model.sequence import MeshSequence

TARGET_KG = 0.15
HEAD = (
    "| sequence | source | MP4 | morph targets | after gltfpack | skeleton (joints + shapes) | compressed | KG | fit / encode |"
)


def main() -> None:
    """Measure, print rows of the table, and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sources", nargs="+", type=Path)
    parser.add_argument("--gltfpack", metavar="COMMAND", type=shlex.split, help="such as 'npx gltfpack'")
    parser.add_argument("--json", type=Path, metavar="OUT.json")
    given = parser.parse_args()
    rows = []
    print(HEAD, flush=True)
    for path in given.sources:
        with tempfile.TemporaryDirectory() as folder:
            rows.append(measure(path, Path(folder), given.gltfpack or []))
        print(shown(rows[-1]), flush=True)
    if given.json:
        given.json.write_text(json.dumps({"gvpipe": gvpipe.__version__, "rows": rows}, indent=1) + "\n")


def measure(path: Path, folder: Path, gltfpack: list[str]) -> dict[str, Any]:
    """The row of a file."""
    sequence = gvpipe.read(path)
    gvpipe.encode(sequence.part(0, 2), folder / "warm.mp4")  # compiles
    start = time.perf_counter()
    gvpipe.encode(sequence, folder / "a.mp4", "mcgv")
    encoding = time.perf_counter() - start
    start = time.perf_counter()
    skin = gvpipe.skin(sequence, target_kg=TARGET_KG)
    fitting = time.perf_counter() - start
    gvpipe.write(sequence, folder / "morph.glb")
    gvpipe.write(sequence, folder / "skin.glb", skin=skin)
    gvpipe.write(sequence, folder / "small.glb", skin=skin, compress="meshopt")
    row: dict[str, Any] = {
        "sequence": path.stem,
        "joints": skin.joints,
        "shapes": len(skin.shapes),
        "kg": kg_of(folder / "small.glb", sequence),
    }
    row["source"] = 12 * sequence.n_frames * sequence.n_vertices if path.suffix == ".npz" else path.stat().st_size
    row |= {name: (folder / file).stat().st_size for name, file in FILES.items()}
    row["time"] = fitting / encoding
    if gltfpack:
        options = ["-cc", "-kn", "-i", str(folder / "morph.glb"), "-o", str(folder / "packed.glb")]
        subprocess.run([*gltfpack, *options], check=True, stdout=subprocess.DEVNULL)
        row["gltfpack"] = (folder / "packed.glb").stat().st_size
    return row


FILES = {"mp4": "a.mp4", "morph": "morph.glb", "skin": "skin.glb", "compressed": "small.glb"}


def kg_of(path: Path, sequence: MeshSequence) -> float | None:
    """Karni and Gotsman's error of a compressed file, percent; its vertices have another order, and its scene may be turned."""
    read, sources = gvpipe.read(path), prepare(sequence, is_packed=True).split.sources
    rows = np.empty(sequence.n_vertices, np.int64)
    rows[sources] = np.arange(len(sources))
    to_source = np.linalg.inv(world_matrix(sequence.metadata)).T

    def shown(start: int, stop: int) -> Float32:
        absolute = read.read(start, stop)[:, rows].astype(np.float64) + read.origin
        return (absolute @ to_source - sequence.origin).astype(np.float32)

    return measure_errors(sequence, shown).kg


def shown(row: dict[str, Any]) -> str:
    """A row as Markdown."""
    kg = "-" if row["kg"] is None else f"{row['kg']:.3f}"
    packed = f"{row['gltfpack']:,}" if "gltfpack" in row else "-"
    shapes = f" + {row['shapes']}" if row["shapes"] else ""
    return (
        f"| {row['sequence']} | {row['source']:,} | {row['mp4']:,} | {row['morph']:,} | {packed} | "
        f"{row['skin']:,} ({row['joints']}{shapes}) | {row['compressed']:,} | {kg} | {row['time']:.1f} |"
    )


if __name__ == "__main__":
    main()
