"""xatlas in processes of its own, which may hang or crash without harm.

xatlas's threads sleep on condition variables. Its destructor wakes them without holding their mutex, so a thread that is about
to sleep misses it, and the destructor waits for ever. Meshes are added to a list that moves while threads read it, so each has
an atlas (docs/decisions/0074-xatlas-runs-in-its-own-processes.md).
"""

from __future__ import annotations

import os
import pickle
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np

from gvpipe.foundation.arrays import Float64, Int32, Int64
from gvpipe.foundation.errors import InputError
from gvpipe.foundation.isolation.python import TimeoutExpired, run_python
from gvpipe.mesh import xatlas_worker
from gvpipe.mesh.xatlas_worker import Charts, Mesh

PATCH = 1 << 13  # triangles that xatlas should get at once: its time grows with their square
ATTEMPTS = 4
SECONDS = 600.0  # that an attempt may take, whatever the meshes
SECONDS_TRIANGLE = 0.02  # and as many for each triangle: a hundred times what xatlas takes
TRIANGLES_PROCESS = 5_000  # that a process is worth: it takes a tenth of a second to start
MESHES_PROCESS = 64  # at most, since each atlas keeps a thread for each processor


def patches_of(points: Float64, faces: Int32, most: int = PATCH) -> list[Int64]:
    """Numbers of triangles ``(m, 3)`` that xatlas gets at once, each list in order.

    Triangles are cut into halves of like size across their longest side, until none has more than ``most``.
    """
    if len(faces) <= most:
        return [np.arange(len(faces))] if len(faces) else []
    centres = points[faces].mean(axis=1)
    along = centres[:, int(np.ptp(centres, axis=0).argmax())]
    order = np.argsort(along, kind="stable")
    half = len(faces) // 2
    sides = [np.sort(side) for side in (order[:half], order[half:])]
    return [side[part] for side in sides for part in patches_of(points, faces[side], most)]


def run_xatlas(meshes: Sequence[Mesh], remedy: str) -> list[Charts]:
    """Charts of each mesh (`gvpipe.mesh.xatlas_worker.charts_of`), found by a process for each processor.

    Args:
        meshes: with the arguments of `charts_of`.
        remedy: what a user can do without charts, for messages.

    Raises:
        InputError: xatlas hung or died four times.
    """
    n_processors = os.cpu_count() or 1
    n_triangles = sum(len(mesh[1]) for mesh in meshes)
    n_shares = max(min(n_processors, n_triangles // TRIANGLES_PROCESS), -(-len(meshes) // MESHES_PROCESS), 1)
    largest_first = sorted(range(len(meshes)), key=lambda number: -len(meshes[number][1]))
    shares = [largest_first[start::n_shares] for start in range(n_shares)]
    with ThreadPoolExecutor(min(n_shares, n_processors)) as pool:
        answers = list(pool.map(partial(_run, remedy=remedy), ([meshes[number] for number in share] for share in shares)))
    return [answers[place % n_shares][place // n_shares] for place in np.argsort(largest_first)]


def _run(meshes: Sequence[Mesh], remedy: str) -> list[Charts]:
    """Charts of some meshes, by one process."""
    limit = SECONDS + SECONDS_TRIANGLE * sum(len(mesh[1]) for mesh in meshes)
    request = pickle.dumps(meshes, protocol=5)
    reason = ""
    for _ in range(ATTEMPTS):
        try:
            done = run_python([str(Path(xatlas_worker.__file__))], {"OPENBLAS_NUM_THREADS": "1"}, request, limit)
        except TimeoutExpired:
            reason = f"took more than {limit:.0f} s"
            continue
        except OSError as exc:
            raise InputError(f"xatlas, which makes charts, cannot be run: {exc}; {remedy}") from exc
        if done.status == 0:
            charts: list[Charts] = pickle.loads(done.out)
            return charts
        reason = f"ended with status {done.status}" + (f" ({done.last_line})" if done.err.strip() else "")
    raise InputError(f"xatlas, which makes charts, {reason}, {ATTEMPTS} times; {remedy}")
