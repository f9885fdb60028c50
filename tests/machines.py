"""Environment variables with which a process computes as on another x86-64 machine."""

from __future__ import annotations

import hashlib
import os
import platform
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest
from folders import ROOT

import gvpipe
from gvpipe.benchmark.sweep import settings_of

# numpy names those that it lacks: no error
FEATURES = "AVX2 FMA3 AVX512F AVX512CD AVX512_SKX AVX512_CLX AVX512_CNL AVX512_ICL AVX512_SPR X86_V3 X86_V4"
PLAIN_NUMPY = {"NPY_DISABLE_CPU_FEATURES": FEATURES}
PLAIN_C_LIBRARY = {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-AVX512F"}
OLD = {"OPENBLAS_CORETYPE": "Prescott", **PLAIN_NUMPY, **PLAIN_C_LIBRARY}  # all that a library chooses; kernels stay
GENERIC = {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""}  # kernels are compiled anew
MACHINES = {
    "Haswell": {"OPENBLAS_CORETYPE": "Haswell"},
    "SkylakeX": {"OPENBLAS_CORETYPE": "SkylakeX"},
    "Prescott": {"OPENBLAS_CORETYPE": "Prescott"},
    "generic": GENERIC,
    "plain numpy": PLAIN_NUMPY,
    "plain C library": PLAIN_C_LIBRARY,
    "one thread": {"OPENBLAS_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"},
    "two threads": {"OPENBLAS_NUM_THREADS": "2", "NUMBA_NUM_THREADS": "2", "OMP_NUM_THREADS": "2"},
}
only_x86_64 = pytest.mark.skipif(
    platform.machine().lower() not in ("x86_64", "amd64"), reason="the settings are those of x86-64"
)


def lines_as(machine: dict[str, str], script: str, *arguments: object, python: str = sys.executable) -> list[str]:
    """What a script prints in a process with these environment variables; kernels that it compiles anew are kept."""
    if "NUMBA_CPU_NAME" in machine:  # from run to run, apart from this machine's code
        machine = {**machine, "NUMBA_CACHE_DIR": str(ROOT / "build" / "same_bits")}
    environment = {**os.environ, **machine}
    command = [python, "-W", "ignore", "-c", script, *map(str, arguments)]
    done = subprocess.run(command, env=environment, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def encoded_digest(path: str | Path, codec: str) -> str:
    """The hash of the file of a sequence at KG 0.1; ``codec`` is ``id`` or ``id:key=value``."""
    (settings,) = settings_of(codec, [75.0], {})  # the error decides
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder, "coded.mp4")
        gvpipe.encode(path, target, settings, target_kg=0.1)
        return f"{hashlib.sha256(target.read_bytes()).hexdigest()} {Path(path).stem} {codec}"
