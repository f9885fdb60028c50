"""Rigid joints beside Dem Bones at equal numbers of bones: the table of docs/engines.md.

    python tools/compare_dem_bones.py ../shared/data/horse_gallop.npz [--bones 16 32]

Needs the package py-dem-bones, Python bindings of Electronic Arts' Dem Bones (Le and Deng 2012), at its own 30 iterations. Both
have the first frame as the rest pose, at most four bones a vertex, and no corrective shapes. Errors are KG, percent.
"""

from __future__ import annotations

import argparse
import time
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

import gvpipe
from gvpipe.metrics.vertex_errors import measure_errors
from gvpipe.model.sequence import MeshSequence

HEAD = "| sequence | bones | Dem Bones: KG | s | rigid joints | KG | s | affine joints | KG | s |"


def main() -> None:
    """Measure, and print rows of the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sources", nargs="+", type=Path)
    parser.add_argument("--bones", nargs="+", type=int, default=[16, 32])
    given = parser.parse_args()
    print(HEAD, flush=True)
    for path in given.sources:
        sequence = gvpipe.read(path)
        gvpipe.skin(sequence.part(0, 3), 4, rigid=True)  # compiles
        for count in given.bones:
            theirs, seconds = timed(lambda count=count, one=sequence: dem_bones(one, count))
            row = f"| {path.stem} | {count} | {theirs:.3f} | {seconds:.1f}"
            for rigid in (True, False):
                skin, seconds = timed(
                    lambda count=count, one=sequence, rigid=rigid: gvpipe.skin(one, count, rigid=rigid, correctives=0)
                )
                row += f" | {skin.joints} | {measure_errors(sequence, skin.read).kg:.3f} | {seconds:.1f}"
            print(f"{row} |", flush=True)


def timed(call: Any) -> tuple[Any, float]:
    """What a call returns, and the seconds it took."""
    start = time.perf_counter()
    found = call()
    return found, time.perf_counter() - start


def dem_bones(sequence: MeshSequence, count: int) -> float:
    """The KG error of Dem Bones."""
    solver = import_module("py_dem_bones")
    rest = sequence.read(0, 1)[0].astype(np.float64)
    poses = sequence.read(0, sequence.n_frames).astype(np.float64)
    found = solver.solve_skinning(rest, poses, count, faces=sequence.faces.tolist(), max_influences=4)
    points = np.concatenate([rest, np.ones((len(rest), 1))], axis=1)

    def read(start: int, stop: int) -> Any:
        blended = np.einsum("bv,fbij->fvij", found.weights, found.transforms[start:stop])
        return np.einsum("fvij,vj->fvi", blended[..., :3, :], points).astype(np.float32)

    return float(measure_errors(sequence, read).kg or 0)


if __name__ == "__main__":
    main()
