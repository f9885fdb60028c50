"""xatlas in processes of its own, which may hang or crash without harm.

xatlas's threads sleep on condition variables. Its destructor wakes them without holding their mutex, so a thread that is about
to sleep misses it, and the destructor waits for ever. Meshes are added to a list that moves while threads read it, so each has
an atlas (docs/decisions/0074-xatlas-runs-in-its-own-processes.md).
"""

from __future__ import annotations

import os
import pickle
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

from gvcodecs.mcgv.layout import xatlas_worker
from gvcodecs.mcgv.layout.xatlas_worker import Charts, Mesh
from gvpipe.foundation.errors import InputError
from gvpipe.foundation.isolation.python import TimeoutExpired, run_python

ATTEMPTS = 4
SECONDS = 600.0  # that an attempt may take, whatever the meshes
SECONDS_TRIANGLE = 0.02  # and as many for each triangle: a hundred times what xatlas takes
TRIANGLES_PROCESS = 5_000  # that a process is worth: it takes a tenth of a second to start
MESHES_PROCESS = 64  # at most, since each atlas keeps a thread for each processor


def run_xatlas(meshes: list[Mesh]) -> list[Charts]:
    """Charts of each mesh (`gvcodecs.mcgv.layout.xatlas_worker.charts_of`), found by a process for each processor.

    Raises:
        InputError: xatlas hung or died four times.
    """
    n_processors = os.cpu_count() or 1
    n_triangles = sum(len(triangles) for _, triangles in meshes)
    n_shares = max(min(n_processors, n_triangles // TRIANGLES_PROCESS), -(-len(meshes) // MESHES_PROCESS), 1)
    largest_first = sorted(range(len(meshes)), key=lambda number: -len(meshes[number][1]))
    shares = [largest_first[start::n_shares] for start in range(n_shares)]
    with ThreadPoolExecutor(min(n_shares, n_processors)) as pool:
        answers = list(pool.map(_run, ([meshes[number] for number in share] for share in shares)))
    return [answers[place % n_shares][place // n_shares] for place in np.argsort(largest_first)]


def _run(meshes: list[Mesh]) -> list[Charts]:
    """Charts of some meshes, by one process."""
    limit = SECONDS + SECONDS_TRIANGLE * sum(len(triangles) for _, triangles in meshes)
    request = pickle.dumps(meshes, protocol=5)
    reason = ""
    for _ in range(ATTEMPTS):
        try:
            done = run_python([str(Path(xatlas_worker.__file__))], {"OPENBLAS_NUM_THREADS": "1"}, request, limit)
        except TimeoutExpired:
            reason = f"took more than {limit:.0f} s"
            continue
        except OSError as exc:
            raise InputError(f"xatlas, which makes charts, cannot be run: {exc}; --set placement=halves needs none") from exc
        if done.status == 0:
            charts: list[Charts] = pickle.loads(done.out)
            return charts
        reason = f"ended with status {done.status}" + (f" ({done.last_line})" if done.err.strip() else "")
    raise InputError(f"xatlas, which makes charts, {reason}, {ATTEMPTS} times; --set placement=halves needs none")
