"""Encode one sequence here, in processes, and on a Dask cluster that loses a worker: seconds, and whether bytes are the same.

    python tools/measure_cluster.py --json docs/benchmarks/scale/cluster.json

The sequence, a torus of waves, is written as .npz and encoded five times: in this process, there with one BLAS thread as
workers have, with ``workers=2``, on a local cluster of as many processes, and on one of which a worker is killed (SIGKILL)
after `KILL_AT` of the segments. The scheduler says which tasks it took from the dead worker.

Seconds are of the wall clock, from the call to the file. Kernels are compiled before; the cluster has started, but its workers
have yet to load gvpipe. Processor time is of all processes, and of a cluster's start and end, too. The extra ``cluster`` is
needed, and a system that has SIGKILL.

Status 1: a file has other bytes than the first, or no task was in flight on the worker that was killed.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import signal
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits

import gvpipe
from gvpipe.benchmark.sweep import describe_machine
from gvpipe.benchmark.torus import make_torus

KILL_AT = 0.4  # part of the segments
STAGES = ("segments", "clips")  # in which segments are coded
WARM = (400, 4)  # vertices, frames
SILENT = 100  # of levels of logging: a worker that dies would be told


def main() -> int:
    """Measure, print and write."""
    given = _options()
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        source = folder / "torus.npz"
        gvpipe.write(make_torus(*WARM), folder / "warm.npz")
        gvpipe.write(make_torus(given.vertices, given.frames), source)
        gvpipe.encode(folder / "warm.npz", folder / "warm.mp4", given.codec)
        runs = measure(source, given.codec, given.segment, given.workers)
        result = {
            "gvpipe": gvpipe.__version__,
            "machine": describe_machine(),
            "command": ["python", "tools/measure_cluster.py", *sys.argv[1:]],
            "codec": given.codec,
            "vertices": gvpipe.read(source).n_vertices,
            "frames": given.frames,
            "segments": count_segments(folder / "0.mp4"),
            "runs": runs,
        }
    text = json.dumps(result, indent=1)
    print(text)
    if given.json:
        given.json.parent.mkdir(parents=True, exist_ok=True)
        given.json.write_text(text + "\n")
    return int(not all(run["same_bytes"] for run in runs) or not runs[-1]["killed"]["tasks_in_flight"])


def measure(source: Path, codec: str, segment: int, workers: int) -> list[dict[str, Any]]:
    """Encode beside the source in each way; say what it took."""
    runs: list[dict[str, Any]] = []

    def run(what: str, progress: Callable[[str, float], None] | None = None, **where: Any) -> None:
        path = source.with_name(f"{len(runs)}.mp4")
        started = time.perf_counter()
        gvpipe.encode(source, path, codec, progress, segment=segment, **where)
        seconds = time.perf_counter() - started
        data = path.read_bytes()
        found = {"what": what, "seconds": seconds, "bytes": len(data), "sha256": hashlib.sha256(data).hexdigest()}
        runs.append({**found, "same_bytes": data == source.with_name("0.mp4").read_bytes(), "killed": None})

    with _counted(runs):
        run("one process")
    with _counted(runs), threadpool_limits(1, user_api="blas"):
        run("one process, one BLAS thread")
    with _counted(runs):
        run(f"--workers {workers}", workers=workers)
    with _counted(runs), local_cluster(workers) as local:
        run(f"cluster of {workers}", scheduler=local.scheduler_address)
    with _counted(runs), local_cluster(workers) as local:
        killer = Killer(local)
        run(f"cluster of {workers}, one killed", killer, scheduler=local.scheduler_address)
        runs[-1]["killed"] = killer.report()
    return runs


class Killer:
    """Kills the worker of a cluster that has most tasks, once; a progress callback of `gvpipe.encode`.

    Args:
        local: a ``distributed.LocalCluster``, whose scheduler is in this process.
    """

    def __init__(self, local: Any) -> None:
        self._local = local
        self._address = ""
        self._done = 0.0

    def __call__(self, stage: str, done: float) -> None:
        if stage not in STAGES or done < KILL_AT or self._address:
            return
        held = {nanny: self._held(nanny) for nanny in self._local.workers.values()}
        nanny = max(held, key=lambda each: held[each])
        if held[nanny]:
            self._address, self._done = nanny.worker_address, done
            os.kill(nanny.pid, signal.SIGKILL)

    def report(self) -> dict[str, Any]:
        """The part of the segments that was coded before, and how many tasks the scheduler took from the dead worker."""
        events = self._local.scheduler.get_events(self._address)
        lost = [event for _, event in events if event["action"] == "remove-worker" and not event["expected"]]
        return {"signal": "SIGKILL", "done": self._done, "tasks_in_flight": sum(len(each["processing-tasks"]) for each in lost)}

    def _held(self, nanny: Any) -> int:
        """How many tasks a worker has: one that it does, and those that wait for it."""
        worker = self._local.scheduler.workers.get(nanny.worker_address)
        return len(worker.processing) if worker else 0


@contextmanager
def local_cluster(workers: int) -> Iterator[Any]:
    """A cluster of processes with one thread each."""
    from distributed import LocalCluster

    with LocalCluster(
        n_workers=workers, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs=SILENT
    ) as local:
        yield local


def count_segments(video: Path) -> int:
    """Segments, or clips, of a file."""
    settings = gvpipe.info(video).settings
    return int(settings.get("segments") or settings.get("clips") or 1)


@contextmanager
def _counted(runs: list[dict[str, Any]]) -> Iterator[None]:
    """Add the processor time of a run, that of ended child processes included."""
    before = sum(os.times()[:4])
    yield
    runs[-1]["cpu_seconds"] = sum(os.times()[:4]) - before
    print(json.dumps(runs[-1]), file=sys.stderr, flush=True)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--vertices", type=int, default=10_000, help="[default: 10000]")
    parser.add_argument("--frames", type=int, default=600, help="[default: 600]")
    parser.add_argument("--codec", default="pca", help="pca, laplacian or pdct [default: pca]")
    parser.add_argument("--segment", type=int, default=50, help="most frames of a segment [default: 50]")
    parser.add_argument("--workers", type=int, default=2, help="[default: 2]")
    parser.add_argument("--json", type=Path, help="a file for the result")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
