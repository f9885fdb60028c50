"""A run: workers, what they are given to do, and what is counted and kept of it."""

from __future__ import annotations

import json
import multiprocessing
import os
import shutil
import signal
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from multiprocessing.connection import wait
from pathlib import Path
from typing import Any

from fuzz.limits import ACCEPTED, BAD, BROKEN, CRASHED, HUNG, LARGE, REFUSED, SLOW, Verdict
from fuzz.reduction import reduce_finding
from fuzz.targets import Options, load_targets
from fuzz.worker import ACCEPTED as N_ACCEPTED
from fuzz.worker import BUSY, CASE, STARTED, Finding, Job, run_worker
from fuzz.worker import REFUSED as N_REFUSED

JOB_SECONDS = 2.0  # that a job should take
WAIT_SECONDS = 120.0  # of the clock, for one case
SAVE_SECONDS = 20.0  # between counts that are written
REDUCE_SECONDS = 60.0  # of the clock, to make one finding small
REDUCED = 12  # findings that are made small
START_SECONDS = 900.0  # of the clock, for sound files when kernels are compiled


@dataclass
class Count:
    """What was counted of a target, and where it is."""

    next: int = 0
    cases: int = 0
    seconds: float = 0.0
    kinds: dict[str, int] = field(default_factory=lambda: dict.fromkeys((ACCEPTED, REFUSED, *BAD), 0))
    job: int = 20


@dataclass
class _Worker:
    process: Any
    connection: Any
    shared: Any
    folder: str
    job: Job | None = None


class Session:
    """Runs cases until the time is over.

    Args:
        options: what is run.
        say: called with a line about each new finding.
    """

    def __init__(self, options: Options, say: Callable[[str], None]) -> None:
        self.options, self._say = options, say
        self.counts = {target.name: Count(next=options.first) for target in load_targets(options)}
        self.findings: dict[tuple[str, str, str], dict[str, Any]] = {}
        self.seconds = 0.0
        self._failed_starts = 0
        self._warming = 0.0  # seconds that workers spent on loading, on average

    def run(self) -> None:
        """Run all of it."""
        started, saved = time.monotonic(), 0.0
        workers = [self._start(number) for number in range(self.options.workers)]
        try:
            while any(worker.process for worker in workers):
                for worker in workers:
                    self._attend(worker)
                wait([worker.connection for worker in workers if worker.process], 0.1)
                elapsed = time.monotonic() - started
                loading = sum(worker.job is not None and worker.shared[CASE] < 0 for worker in workers)
                self._warming += (elapsed - self.seconds) * loading / len(workers)
                self.seconds = elapsed
                if elapsed > saved + SAVE_SECONDS:
                    saved = elapsed
                    self._save()
        finally:
            self._save()
            for worker in workers:
                if worker.process:
                    worker.process.kill()
                    worker.process.join()
                shutil.rmtree(worker.folder, ignore_errors=True)

    def reduce(self) -> None:
        """Make the findings small, each in at most `REDUCE_SECONDS`."""
        context = multiprocessing.get_context("spawn")
        for finding in list(self.findings.values())[:REDUCED]:
            process = context.Process(target=_reduce, args=(self.options, finding))
            process.start()
            process.join(3 * REDUCE_SECONDS)
            process.kill()

    def to_json(self) -> dict[str, Any]:
        """Counts and findings as JSON values."""
        return {
            "seed": self.options.seed,
            "seconds": round(self.seconds, 1),
            "cases": sum(count.cases for count in self.counts.values()),
            "targets": {
                name: {
                    "cases": count.cases,
                    **count.kinds,
                    "first": self.options.first,
                    "cases_per_second": round(count.cases / count.seconds, 1) if count.seconds else 0.0,
                }
                for name, count in self.counts.items()
            },
            "findings": list(self.findings.values()),
        }

    def _save(self) -> None:
        """Keep the counts so far, so that a run that is ended leaves them."""
        folder = Path(self.options.found)
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "counts.json").write_text(json.dumps(self.to_json(), indent=1))

    def _start(self, number: int) -> _Worker:
        import dataclasses

        context = multiprocessing.get_context("spawn")
        ours, theirs = context.Pipe()
        shared = context.Array("d", 5, lock=False)
        shared[CASE] = -1
        folder = f"{self.options.folder}-{number}"
        options = dataclasses.replace(self.options, folder=folder)
        process = context.Process(target=run_worker, args=(theirs, shared, options), daemon=True)
        process.start()
        theirs.close()
        return _Worker(process, ours, shared, folder)

    def _attend(self, worker: _Worker) -> None:
        """Take what a worker has sent, or look whether it still lives; give it a job."""
        if not worker.process:
            return
        try:
            while worker.connection.poll():
                message = worker.connection.recv()
                if message is None:
                    self._finish(worker)
                else:
                    self._record(message)
                    worker.connection.send(None)
        except (EOFError, ConnectionError):
            worker.process.join()
            self._bury(worker)
        else:
            if worker.job is None:
                self._give(worker)
            elif self._is_stuck(worker):
                worker.process.kill()

    def _give(self, worker: _Worker) -> None:
        options = self.options
        left = [
            (name, count)
            for name, count in self.counts.items()
            if not options.cases or count.next < options.first + options.cases
        ]
        if not left or (not options.cases and self.seconds - self._warming > options.seconds):
            worker.connection.send(None)
            worker.process.join(10)
            worker.process.kill()
            worker.process = None
            return
        name, count = min(left, key=lambda item: item[1].seconds)
        stop = count.next + count.job
        if options.cases:
            stop = min(stop, options.first + options.cases)
        worker.job = Job(name, count.next, stop)
        worker.shared[STARTED] = time.time()
        worker.shared[CASE] = -1
        worker.shared[N_ACCEPTED] = worker.shared[N_REFUSED] = worker.shared[BUSY] = 0
        worker.connection.send(worker.job)
        count.next = stop
        count.seconds += 1e-3  # so that two workers do not choose alike

    def _finish(self, worker: _Worker, stop: int | None = None) -> None:
        """Count a job that is done, or that ended before case ``stop``."""
        job = worker.job
        if job is None:
            return
        count, took = self.counts[job.target], worker.shared[BUSY]
        done = (job.stop if stop is None else stop) - job.first
        count.cases += done
        count.seconds += took
        for kind, place in ((ACCEPTED, N_ACCEPTED), (REFUSED, N_REFUSED)):
            count.kinds[kind] += int(worker.shared[place])
        if done:
            count.job = max(5, min(5000, int(count.job * min(4.0, JOB_SECONDS / max(took, 1e-3)))))
        worker.job = None

    def _is_stuck(self, worker: _Worker) -> bool:
        limit = WAIT_SECONDS if worker.shared[CASE] >= 0 else START_SECONDS
        return bool(time.time() - worker.shared[STARTED] > limit)

    def _bury(self, worker: _Worker) -> None:
        """A worker that a case has ended: keep the case, start another, and go on behind it.

        Raises:
            RuntimeError: workers end before their first case, again and again.
        """
        number, code, job = int(worker.shared[CASE]), worker.process.exitcode, worker.job
        self._failed_starts = self._failed_starts + 1 if job is not None and number < 0 else 0
        if self._failed_starts >= 3 * self.options.workers:
            raise RuntimeError(
                f"workers end with status {code} before their first case of {job.target if job else 'any target'}"
            )
        if job is not None:
            if number >= 0:
                hung = code in (-signal.SIGKILL, -getattr(signal, "SIGXCPU", 0))
                place = "no end" if hung else f"exit {signal.Signals(-code).name if code and code < 0 else code}"
                verdict = Verdict(HUNG if hung else CRASHED, f"{job.target}: {place}", f"the process ended: {place}")
                self._record(Finding(job.target, number, "", verdict, worker.folder))
            count = self.counts[job.target]
            self._finish(worker, max(number + 1, job.first) if number >= 0 else job.first)
            rest = job.stop - max(number + 1, job.first)
            if rest > 0 and count.next == job.stop:
                count.next = max(number + 1, job.first)
        fresh = self._start(int(worker.folder.rsplit("-", 1)[1]))
        worker.process, worker.connection, worker.shared, worker.job = fresh.process, fresh.connection, fresh.shared, None

    def _record(self, finding: Finding) -> None:
        """Count a finding; keep the files of the first of its kind and place."""
        verdict = finding.verdict
        self.counts[finding.target].kinds[verdict.kind] += 1
        key = (finding.target, verdict.kind, verdict.place)
        if key in self.findings:
            self.findings[key]["count"] += 1
            return
        folder = Path(self.options.found, f"{finding.target}-{verdict.kind}-{finding.number}")
        shutil.rmtree(folder, ignore_errors=True)
        if os.path.isdir(finding.folder):
            shutil.copytree(finding.folder, folder)
        self.findings[key] = {
            "target": finding.target,
            "kind": verdict.kind,
            "place": verdict.place,
            "case": finding.number,
            "seed_file": finding.seed,
            "count": 1,
            "folder": str(folder),
            "detail": verdict.detail,
        }
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "finding.json").write_text(json.dumps(self.findings[key], indent=1))
        line = verdict.detail.strip().splitlines()[-1][:300]
        self._say(f"{finding.target} case {finding.number}: {verdict.kind}, {verdict.place}: {line}")


def _reduce(options: Options, finding: dict[str, Any]) -> None:
    import dataclasses

    (target,) = load_targets(dataclasses.replace(options, targets=(finding["target"],)))
    reduce_finding(target, finding, options.seed, REDUCE_SECONDS)


KINDS = (ACCEPTED, REFUSED, CRASHED, BROKEN, SLOW, LARGE, HUNG)
