"""xatlas may hang or die: the encoder goes on, or says so."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from gvpipe.foundation.errors import InputError
from gvpipe.mesh import xatlas_process, xatlas_worker
from gvpipe.mesh.xatlas_process import run_xatlas
from gvpipe.mesh.xatlas_worker import Mesh

REMEDY = "do without"
# one that writes its own name into a file each time, and works from the second time on
SECOND_TIME = """
import pickle, sys, time
with open({tries!r}, "a") as tries:
    tries.write("x")
if open({tries!r}).read() == "x":
    {first}
print("library output", file=sys.stderr)
sys.stdout.buffer.write(pickle.dumps(["charts"]))
"""
# the worker's steps, in processes that are forked from one that has no threads: 10,000 starts in two minutes
MANY = """
import os, signal, sys
import numpy as np, xatlas
from gvpipe.mesh.xatlas_worker import charts_of

turn = np.arange(12) * np.pi / 6
ring = np.stack([np.cos(turn), np.sin(turn), 0 * turn], 1).astype(np.float32)
tube = np.concatenate([ring, ring + np.float32([0, 0, 1])])
i = np.arange(12); j = (i + 1) % 12
triangles = np.concatenate([np.stack([i, j, i + 12], 1), np.stack([j, j + 12, i + 12], 1)]).astype(np.uint32)
for _ in range(int(sys.argv[1])):
    child = os.fork()
    if not child:
        signal.alarm(60)
        charts = [charts_of(tube, triangles), charts_of(ring[:3], triangles[:1] * 0 + np.uint32([0, 1, 2]))]
        os._exit(0 if len(charts[1][0]) == 3 else 1)
    assert os.waitpid(child, 0)[1] == 0
print("none hung")
"""

# holds up each thread that is about to sleep, between its look at the flag and its sleep
LATE = """
#define _GNU_SOURCE
#include <dlfcn.h>
#include <pthread.h>
#include <unistd.h>
int pthread_cond_wait(pthread_cond_t *condition, pthread_mutex_t *mutex)
{
    sleep(2);
    return ((int (*)(pthread_cond_t *, pthread_mutex_t *))dlsym(RTLD_NEXT, "pthread_cond_wait"))(condition, mutex);
}
"""
IN_THIS_PROCESS = """
import numpy as np, xatlas
atlas = xatlas.Atlas()
atlas.add_mesh(np.eye(3, dtype=np.float32), np.arange(3, dtype=np.uint32)[None])
atlas.generate()
print("generated", flush=True)
del atlas
"""
IN_ANOTHER = """
import numpy as np
from gvpipe.mesh.xatlas_process import run_xatlas
print(sorted(map(int, run_xatlas([(np.eye(3, dtype=np.float32), np.arange(3, dtype=np.uint32)[None])], "")[0][0])))
"""


def square() -> Mesh:
    return strip(1)


def strip(n_squares: int) -> Mesh:
    """Squares of side 1 in a row."""
    corners = np.array([[x, y, 0] for x in range(n_squares + 1) for y in (0, 1)], np.float32)
    return corners, np.array([[i, i + 1, i + 2] if i % 2 == 0 else [i + 1, i, i + 2] for i in range(2 * n_squares)], np.uint32)


def test_charts_of_two_meshes() -> None:
    for vertex, triangles, places, chart in run_xatlas([square(), square()], REMEDY):
        assert sorted(vertex) == [0, 1, 2, 3] and len(triangles) == 2 and len(set(chart)) == 1
        sides = np.linalg.norm(np.diff(places[np.argsort(vertex)], axis=0), axis=1)
        own = np.linalg.norm(np.diff(square()[0], axis=0), axis=1)
        np.testing.assert_allclose(sides, own, atol=0.1)  # places have the mesh's unit


def test_meshes_of_several_processes_keep_their_order(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(xatlas_process, "MESHES_PROCESS", 2)
    sizes = [3, 1, 4, 1, 5, 9, 2]
    found = run_xatlas([strip(n) for n in sizes], REMEDY)
    assert [len(triangles) for _, triangles, _, _ in found] == [2 * n for n in sizes]
    assert [int(np.unique(vertex).size) for vertex, _, _, _ in found] == [2 * n + 2 for n in sizes]


@pytest.mark.slow
@pytest.mark.parametrize("first", ["time.sleep(600)", "sys.exit(3)", "import os, signal; os.kill(os.getpid(), signal.SIGTERM)"])
def test_a_process_that_hangs_or_dies_once(first: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    _use(SECOND_TIME.format(tries=str(tmp_path / "tries"), first=first), tmp_path, monkeypatch)
    charts: object = run_xatlas([square()], REMEDY)
    assert charts == ["charts"]
    assert (tmp_path / "tries").read_text() == "xx"


def test_a_process_that_dies_each_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    _use("raise ValueError('no such mesh')", tmp_path, monkeypatch)
    with pytest.raises(InputError, match=r"status 1 \(ValueError: no such mesh\), 4 times; do without"):
        run_xatlas([square()], REMEDY)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="this system has no fork")
def test_many_starts_and_ends() -> None:
    """A thousand; ``GVPIPE_STARTS=10000`` for ten."""
    count = os.environ.get("GVPIPE_STARTS", "1000")
    done = subprocess.run([sys.executable, "-c", MANY, count], capture_output=True, text=True, timeout=1500)
    assert (done.stdout, done.stderr) == ("none hung\n", "")


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux" or shutil.which("cc") is None, reason="needs Linux and a C compiler")
def test_a_thread_that_misses_its_end(tmp_path: Path) -> None:
    """The destructor's call comes between a thread's look at the flag and its sleep: in this process it waits for ever."""
    (tmp_path / "late.c").write_text(LATE)
    subprocess.run(["cc", "-shared", "-fPIC", "-o", tmp_path / "late.so", tmp_path / "late.c", "-ldl"], check=True)
    environment = {**os.environ, "LD_PRELOAD": str(tmp_path / "late.so"), "OPENBLAS_NUM_THREADS": "1"}
    run = partial(subprocess.run, capture_output=True, text=True, env=environment)
    with pytest.raises(subprocess.TimeoutExpired) as caught:
        run([sys.executable, "-c", IN_THIS_PROCESS], timeout=10)
    assert caught.value.stdout == b"generated\n"
    assert run([sys.executable, "-c", IN_ANOTHER], timeout=60).stdout == "[0, 1, 2]\n"


def _use(program: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Run another program in the worker's place, with little patience."""
    (folder / "worker.py").write_text(program)
    monkeypatch.setattr(xatlas_worker, "__file__", str(folder / "worker.py"))
    monkeypatch.setattr(xatlas_process, "SECONDS", 3.0)
