"""All codecs decode to the same bits, whichever instructions the machine has and however many threads it runs."""

from __future__ import annotations

import os
import platform
import subprocess
import sys
from pathlib import Path

import pytest
from folders import GOLDEN, ROOT

EXCEPT = "pca-1-rbf"  # its powers are the C library's
FEATURES = "AVX2 FMA3 AVX512F AVX512CD AVX512_SKX AVX512_CLX AVX512_CNL AVX512_ICL"  # numpy names those that it lacks: no error
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
MACHINES = {
    "Haswell": {"OPENBLAS_CORETYPE": "Haswell"},
    "SkylakeX": {"OPENBLAS_CORETYPE": "SkylakeX"},
    "Prescott": {"OPENBLAS_CORETYPE": "Prescott"},
    "generic": {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""},
    "plain numpy": {"NPY_DISABLE_CPU_FEATURES": FEATURES},
    "plain C library": {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-AVX512F"},
    "one thread": {"OPENBLAS_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"},
    "two threads": {"OPENBLAS_NUM_THREADS": "2", "NUMBA_NUM_THREADS": "2", "OMP_NUM_THREADS": "2"},
}


def digests(files: list[Path], settings: dict[str, str]) -> list[str]:
    """A line for each file: the hash of all that it decodes to in a process with these environment variables."""
    environment = {**os.environ, **settings}
    command = [sys.executable, "-W", "ignore", "-c", DIGESTS, *map(str, files)]
    done = subprocess.run(command, env=environment, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


@pytest.mark.slow
@pytest.mark.skipif(platform.machine().lower() not in ("x86_64", "amd64"), reason="the settings are those of x86-64")
def test_all_golden_files_decode_to_the_same_bits_on_all_machines() -> None:
    files = sorted(path for path in GOLDEN.glob("*.mp4") if path.stem != EXCEPT)
    expected = digests(files, {})
    assert len(set(expected)) == len(files)
    for machine, settings in MACHINES.items():
        compiled_anew = "NUMBA_CPU_NAME" in settings
        some = [path for path in files if path.stem in FEW or not compiled_anew]
        if compiled_anew:  # kept from run to run, apart from this machine's code
            settings = {**settings, "NUMBA_CACHE_DIR": str(ROOT / "build" / "same_bits")}
        wanted = [line for line, path in zip(expected, files, strict=True) if path in some]
        assert digests(some, settings) == wanted, machine
