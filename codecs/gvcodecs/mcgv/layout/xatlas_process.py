"""xatlas in a process of its own, which may hang or crash without harm.

xatlas's threads sleep on condition variables. Its destructor wakes them without holding their mutex, so a thread that is about
to sleep misses it, and the destructor waits for ever (docs/decisions/0123-xatlas-in-a-process.md).
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from pathlib import Path

from gvcodecs.mcgv.layout import xatlas_worker
from gvcodecs.mcgv.layout.xatlas_worker import Charts, Mesh
from gvpipe.errors import InputError

ATTEMPTS = 2
SECONDS = 600.0  # that an attempt may take, whatever the meshes
SECONDS_TRIANGLE = 0.02  # and as many for each triangle: a hundred times what xatlas takes


def run_xatlas(meshes: list[Mesh]) -> list[Charts]:
    """Charts of meshes (`gvcodecs.mcgv.layout.xatlas_worker.make_charts`).

    Raises:
        InputError: xatlas hung or died twice.
    """
    command = [sys.executable, "-P", str(Path(xatlas_worker.__file__))]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), "OPENBLAS_NUM_THREADS": "1"}
    limit = SECONDS + SECONDS_TRIANGLE * sum(len(triangles) for _, triangles in meshes)
    request = pickle.dumps(meshes, protocol=5)
    reason = ""
    for _ in range(ATTEMPTS):
        try:
            done = subprocess.run(command, input=request, capture_output=True, timeout=limit, env=environment)
        except subprocess.TimeoutExpired:
            reason = f"took more than {limit:.0f} s"
            continue
        except OSError as exc:
            raise InputError(f"xatlas, which makes charts, cannot be run: {exc}; --set placement=halves needs none") from exc
        if done.returncode == 0:
            charts: list[Charts] = pickle.loads(done.stdout)
            return charts
        said = done.stderr.decode(errors="replace").strip().splitlines()
        reason = f"ended with status {done.returncode}" + (f" ({said[-1]})" if said else "")
    raise InputError(f"xatlas, which makes charts, {reason}, {ATTEMPTS} times; --set placement=halves needs none")
