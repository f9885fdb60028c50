"""Make a failing case small: take back every change that it fails without.

Each attempt runs in a process of its own, as it may crash or hang.
"""

from __future__ import annotations

import difflib
import json
import multiprocessing
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from fuzz.limits import CRASHED, HUNG, Verdict
from fuzz.parts import Parts, Target
from fuzz.worker import run_case, write_files

LARGEST_COMPARED = 8000  # bytes of a part whose changes are looked for one by one
WAIT = 40.0  # s of the clock, for one attempt


def reduce_parts(sound: Parts, failing: Parts, fails: Callable[[Parts], bool]) -> Parts:
    """Return parts that still fail, with as much of the sound parts as that allows.

    Args:
        sound: the seed's parts.
        failing: the case's.
        fails: whether parts fail as the case does.
    """
    best = failing
    for name in [*dict.fromkeys((*sound, *failing))]:
        if best.get(name) == sound.get(name):
            continue
        without = {key: sound[key] if key == name else best[key] for key in sound if key in best or key == name}
        if name not in sound:
            without = {key: data for key, data in best.items() if key != name}
        if fails(without):
            best = without
    for name, data in list(best.items()):
        for take_back in reversed(_changes(sound.get(name, b""), data)):
            candidate = {**best, name: take_back(best[name])}
            if fails(candidate):
                best = candidate
    return best


def _changes(sound: bytes, data: bytes) -> list[Callable[[bytes], bytes]]:
    """For each change, in the order of places, what takes it back as long as later ones alone have been."""
    if sound == data or max(len(sound), len(data)) > LARGEST_COMPARED:
        return []
    found = difflib.SequenceMatcher(None, sound, data, autojunk=False).get_opcodes()

    def make(old: bytes, start: int, stop: int) -> Callable[[bytes], bytes]:
        return lambda now: now[:start] + old + now[stop:]

    return [make(sound[i:j], start, stop) for tag, i, j, start, stop in found if tag != "equal"]


def reduce_finding(target: Target, finding: dict[str, Any], run_seed: int, seconds: float) -> bool:
    """Write the small form of a finding beside its files, in ``reduced/``; return whether it fails when run alone."""
    seed, parts = target.case(run_seed, finding["case"])
    folder = Path(finding["folder"], "reduced")
    end = time.monotonic() + seconds

    def fails(candidate: Parts) -> bool:
        if time.monotonic() > end:
            return False
        found = _run_alone(target, candidate, folder)
        died = finding["kind"] in (HUNG, CRASHED) and found.kind == finding["kind"] and "the process ended" in finding["detail"]
        return died or (found.kind, found.place) == (finding["kind"], finding["place"])

    if not fails(parts):
        return False
    best = reduce_parts(seed.parts, parts, fails)
    write_files(target.join(best), folder)
    changed = sorted(name for name in {*best, *seed.parts} if best.get(name) != seed.parts.get(name))
    (folder.parent / "finding.json").write_text(json.dumps({**finding, "changed": changed}, indent=1))
    return True


def _run_alone(target: Target, parts: Parts, folder: Path) -> Verdict:
    context = multiprocessing.get_context("fork")
    ours, theirs = context.Pipe(duplex=False)
    process = context.Process(target=lambda: theirs.send(run_case(target, parts, folder)))
    process.start()
    theirs.close()
    try:
        if not ours.poll(WAIT):
            return Verdict(HUNG)
        verdict: Verdict = ours.recv()
        return replace(verdict, detail="")
    except EOFError:
        return Verdict(CRASHED)
    finally:
        process.kill()
        process.join()
