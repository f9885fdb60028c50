"""All codecs decode to the same bits, whichever instructions the machine has and however many threads it runs."""

from __future__ import annotations

import pytest
from folders import GOLDEN
from machines import GENERIC, MACHINES, lines_as, only_x86_64

EXCEPT = "pca-1-rbf"  # its powers are the C library's
DIGESTS = """
import hashlib, os, sys
import numpy as np
import gvpipe
from gvpipe.container.mp4 import read_file
from gvpipe.coding.registry import open_reader

for path in sys.argv[1:]:
    digest = hashlib.sha256()
    video = gvpipe.decode(path)
    digest.update(np.ascontiguousarray(video.positions))
    for each in [*video.attributes.values()]:
        digest.update(np.ascontiguousarray(each.values))
    for each in video.fields.values():
        digest.update(np.ascontiguousarray(each[:]))
    reader = open_reader(read_file(path))
    while True:  # what lies below float32, where a codec keeps it
        inner = getattr(reader, "distinct", None) or getattr(reader, "_reader", None)
        if inner is None:
            break
        reader = inner
    if hasattr(reader, "_decode"):
        segment = reader._decode(*(0, 0) if type(reader).__name__ == "PcaReader" else (0,))
        if hasattr(segment, "coefficients"):
            for numbers in (segment.coefficients, segment.basis.vectors, segment.basis.mean):
                digest.update(np.ascontiguousarray(numbers))
        elif type(reader).__name__ in ("PcaReader", "LaplacianReader", "TrajectoryReader"):
            raise TypeError(f"{path}: a segment has no coefficients")
    print(digest.hexdigest(), os.path.basename(path))
"""
FEW = ("laplacian-1-still", "mcgv-1-rigid", "pca-1-still", "pdct-1-still")  # all codecs, quick to compile for


@pytest.mark.slow
@only_x86_64
def test_all_golden_files_decode_to_the_same_bits_on_all_machines() -> None:
    files = sorted(path for path in GOLDEN.glob("*.mp4") if path.stem != EXCEPT)
    expected = lines_as({}, DIGESTS, *files)
    assert len(set(expected)) == len(files)
    for machine, settings in MACHINES.items():
        some = [path for path in files if path.stem in FEW or settings is not GENERIC]
        wanted = [line for line, path in zip(expected, files, strict=True) if path in some]
        assert lines_as(settings, DIGESTS, *some) == wanted, machine
