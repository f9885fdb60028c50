"""Digests of what the golden files decode to, a line each: machines that print the same lines decode to the same bits.

python tools/golden_digests.py > linux.txt
"""

from __future__ import annotations

import argparse
import hashlib
from pathlib import Path

import numpy as np

import gvpipe

GOLDEN = Path(__file__).resolve().parent.parent / "tests" / "golden"


def main() -> None:
    """Print the name and the digest of each golden file."""
    raw = argparse.RawDescriptionHelpFormatter
    argparse.ArgumentParser(description=__doc__, formatter_class=raw).parse_args()
    for path in sorted(GOLDEN.glob("*.mp4")):
        print(f"{path.stem} {digest(path)}")


def digest(path: Path) -> str:
    """SHA-256, in hex, of the triangles, positions, attributes and fields of a geometry video."""
    with gvpipe.open(path) as video:
        arrays = [video.faces, video[:], *(np.asarray(each) for each in video.attributes.values())]
        arrays += [field[:] for field in video.fields.values()]
    state = hashlib.sha256()
    for array in arrays:
        little = array.astype(array.dtype.newbyteorder("<"))
        state.update(f"{little.dtype.str} {little.shape}\n".encode() + np.ascontiguousarray(little).tobytes())
    return state.hexdigest()


if __name__ == "__main__":
    main()
