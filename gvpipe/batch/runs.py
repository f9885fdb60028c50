"""Encode many sequences side by side, and resume where a run has ended."""

from __future__ import annotations

import dataclasses
import json
import os
import pickle
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gvpipe.api import checked_keywords
from gvpipe.batch.decision import FEW, Decision, decide, find_decided
from gvpipe.batch.encoding import Done, Task, prepare
from gvpipe.batch.inputs import Job, find_jobs
from gvpipe.batch.manifest import Entry, Manifest, open_manifest
from gvpipe.coding.codec import Codec
from gvpipe.foundation.arguments import StrPath, check_path
from gvpipe.foundation.atomic import output_error
from gvpipe.foundation.cores import count_cores
from gvpipe.foundation.progress import Progress
from gvpipe.foundation.version import __version__
from gvpipe.rate_control.purposes import describe, own_settings
from gvpipe.tasks.choice import open_executor
from gvpipe.tasks.executor import Executor, Outcome, WorkerDied

STAGE = "sequences"


@dataclass(frozen=True)
class BatchReport:
    """What a run did.

    Args:
        sequences: how many there are.
        encoded: how many files are new.
        skipped: how many were there.
        failed: input and error of each of the others.
        left_out: how many files are of no format that is read.
        bytes: of all files.
        seconds: of the run.
        manifest: its path.
        notes: what a user should know, and of how many sequences that are new.
        decided: the codec that all sequences have, and why; empty where each chose, or one codec was asked for.
    """

    sequences: int
    encoded: int
    skipped: int
    failed: list[dict[str, str]]
    left_out: int
    bytes: int
    seconds: float
    manifest: str
    notes: dict[str, int]
    decided: str = ""

    def to_json(self) -> dict[str, Any]:
        """The report as JSON values."""
        return dataclasses.asdict(self)


def encode_all(
    sources: StrPath | Sequence[StrPath],
    folder: StrPath,
    codec: str | Codec | Sequence[Codec] | None = None,
    progress: Progress | None = None,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    each: bool = False,
    **options: Any,
) -> BatchReport:
    """Encode many sequences, a geometry video each; a sequence that cannot be encoded stops no other.

    What each became is a line of ``manifest.jsonl`` in ``folder`` (`gvpipe.batch.manifest`). Sequences that it lists as done,
    of the same bytes, are skipped.

    Args:
        sources: globs, folders and files (`gvpipe.batch.inputs`).
        folder: of the outputs, which keep the inputs' folders; it is made if it is missing.
        codec: as for `gvpipe.encode`.
        progress: called with the part of the sequences that has ended.
        workers: processes of this machine, one sequence each; None: one for each core.
        scheduler: address of a Dask scheduler whose workers encode them instead; they see the same files (extra ``cluster``).
        each: of several candidates, such as those of codec ``auto``, each sequence chooses one, which takes all candidates'
            encodes of each. By default three sequences choose for all, evenly spaced (`gvpipe.batch.decision`); where there are
            no more, each chooses.
        options: other keywords of `gvpipe.encode`, and settings of the codec, the same for all.

    Raises:
        InputError: no sequence is found, two would become one file, an option cannot be used, a manifest of other settings,
            or the scheduler cannot be used.
        OutputError: the folder or the manifest cannot be written.
    """
    started = time.perf_counter()
    given = [sources] if isinstance(sources, str | os.PathLike) else list(sources)
    place = Path(check_path(folder, "the folder of the outputs"))
    keywords = checked_keywords(codec, **options)
    is_each = each and not isinstance(keywords["codec"], Codec)
    settings = {**settings_json(keywords), **({"each": True} if is_each else {})}
    if keywords.get("mesh") is not None:
        keywords["mesh"] = os.path.abspath(keywords["mesh"])  # workers may have another current folder
    found = find_jobs(given, place)
    _make(place)
    count = count_cores() if workers is None and scheduler is None else workers
    with open_manifest(place, settings) as manifest, open_executor(scheduler, count) as executor:
        assert executor is not None  # a count of workers or a scheduler is given
        decision = None if is_each else _decide(executor, found.jobs, manifest, keywords)
        if decision is not None:
            keywords["codec"] = [decision.codec]  # a list: without a target, its error is that which candidates compete at
        ended = _encode(executor, found.jobs, manifest, keywords, settings, decision)
        counts, notes, failed = Counter[str](), Counter[str](), []
        for number, (entry, done) in enumerate(ended, 1):
            notes.update(done.notes)
            if entry.error is not None:
                failed.append({"input": entry.input, "error": entry.error})
            else:
                counts.update({"encoded" if done.is_new else "skipped": 1, "bytes": entry.bytes})
            if progress:
                progress(STAGE, number / len(found.jobs))
    return BatchReport(
        sequences=len(found.jobs),
        encoded=counts["encoded"],
        skipped=counts["skipped"],
        failed=failed,
        left_out=len(found.left_out),
        bytes=counts["bytes"],
        seconds=time.perf_counter() - started,
        manifest=str(manifest.path),
        notes=dict(notes),
        decided="" if decision is None else decision.reason,
    )


def settings_json(keywords: Mapping[str, Any]) -> dict[str, Any]:
    """What is asked for, as JSON values: codecs with their settings other than defaults, and the keywords that are set."""
    given = keywords["codec"]
    codecs = [
        {"id": one.id, "quality": one.quality, **own_settings(one)} for one in ([given] if isinstance(given, Codec) else given)
    ]
    others = {name: value for name, value in keywords.items() if name != "codec" and value not in (None, False, {}, ())}
    values: dict[str, Any] = json.loads(json.dumps({"codecs": codecs, **others}, default=str))
    return values


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as exc:
        raise output_error(folder, exc) from exc


def _encode(
    executor: Executor,
    jobs: Sequence[Job],
    manifest: Manifest,
    keywords: Mapping[str, Any],
    settings: Mapping[str, Any],
    decision: Decision | None,
) -> Iterator[tuple[Entry, Done]]:
    """Let workers encode; yield what became of each sequence once the manifest has it."""
    place = manifest.path.parent
    tasks = [_task(job, place, manifest.entries.get(job.output)) for job in jobs]
    for outcome in executor.run(prepare, pickle.dumps(dict(keywords)), tasks):
        job, done = jobs[outcome.index], _done(outcome)
        error = done.error and done.error.replace(tasks[outcome.index].source, job.source)
        entry = Entry(
            input=job.source,
            hash=done.hash,
            output=job.output,
            error=error,
            bytes=done.bytes,
            seconds=round(done.seconds, 3),
            gvpipe=__version__,
            settings=settings,
            description=done.description,
            decided="" if decision is None else describe(decision.codec),
        )
        if done.is_new:
            manifest.add(entry)
        yield entry, done


def _decide(executor: Executor, jobs: Sequence[Job], manifest: Manifest, keywords: Mapping[str, Any]) -> Decision | None:
    """The codec for all sequences: that of the manifest, which an earlier run decided on, or a new one; None: each chooses."""
    candidates = keywords["codec"]
    if isinstance(candidates, Codec) or len(candidates) < 2 or len(jobs) <= FEW:
        return None
    for entry in manifest.entries.values():
        codec = find_decided(candidates, entry.decided) if entry.error is None else None
        if codec is not None:
            return Decision(codec, f"codec {entry.decided} for all, as an earlier run decided")
    return decide(executor, jobs, candidates, keywords)


def _task(job: Job, place: Path, before: Entry | None) -> Task:
    target = place.absolute() / job.output
    is_done = before is not None and before.error is None and target.is_file() and target.stat().st_size == before.bytes
    return Task(os.path.abspath(job.source), str(target), before.hash if before is not None and is_done else None)


def _done(outcome: Outcome) -> Done:
    """What a worker says, or that it died."""
    if isinstance(outcome.value, Done):
        return outcome.value
    error = outcome.error
    if isinstance(error, WorkerDied):
        return Done(None, f"{error}; give it more memory (fewer --workers), or fewer frames (--frames)", 0, 0.0)
    return Done(None, " ".join(str(error).split()), 0, 0.0)
