"""A process of its own for a library that dies where it cannot write: HDF5 and Alembic do on a full disk.

The process gets a sequence without its frames, and asks for those that it writes. A message from there is a pickle: ``(ask,
what, start, stop)``, or how it ended, as `gvpipe.io.library.writing_worker` says. Messages from here are the sequence and
arrays.
"""

from __future__ import annotations

import contextlib
import pickle
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from gvpipe.asset.field import Field
from gvpipe.foundation.arrays import Array
from gvpipe.foundation.atomic import atomic_path
from gvpipe.foundation.errors import InputError, OutputError
from gvpipe.io.library import process as library_process
from gvpipe.io.library.writing_worker import ASK, CELLS, DONE, EXACT, INPUT, POSITIONS, SHOT, Asked, AskedShots
from gvpipe.model.capture import Capture
from gvpipe.model.sequence import MeshSequence

WORKER = "gvpipe.io.library.writing_worker"
LITTLE_SPACE = 1 << 20  # bytes that are left on a disk that counts as full


def write_by(module: str, function: str, given: MeshSequence | Capture, path: Path) -> tuple[str, ...]:
    """Write a file by ``function(sequence, temporary path, name)`` of a module, in a process of its own.

    For a capture the function gets `gvpipe.io.library.writing_worker.AskedShots`.

    The name is the file's, without folder and extension. Returns what the function returns.

    Raises:
        InputError: as the function raises it.
        OutputError: the file cannot be written; nothing of it is left.
    """
    with atomic_path(path) as temporary:
        process = library_process.start_process(WORKER, path)
        assert process.stdin is not None and process.stdout is not None  # they are pipes
        try:
            state, result = _serve(process, (module, function, temporary, path), given)
        except (EOFError, OSError, pickle.UnpicklingError) as exc:
            raise OutputError(f"cannot write {path}: {_why(path)}") from exc
        finally:
            process.kill()
            process.wait()
            for pipe in (process.stdin, process.stdout):
                with contextlib.suppress(OSError):
                    pipe.close()
        if state != DONE:
            raise (InputError if state == INPUT else OutputError)(str(result).replace(str(temporary), str(path)))
    notes: tuple[str, ...] = result
    return notes


def _serve(process: Any, order: tuple[str, str, Path, Path], given: MeshSequence | Capture) -> tuple[str, Any]:
    """Answer what the process asks until it says how it ended."""
    module, function, temporary, path = order
    head: Any
    if isinstance(given, MeshSequence):
        sequence, head = given, _without_frames(given)
    else:
        sequence, head = given.shots[0], AskedShots(given.lengths, given.fps)
    request: Any = (module, function, head, temporary, path)
    while True:
        pickle.dump(request, process.stdin, protocol=5)
        process.stdin.flush()
        state, *asked = pickle.load(process.stdout)
        if state != ASK:
            return state, asked[0]
        if asked[0] == SHOT and isinstance(given, Capture):
            sequence = given.shots[asked[1]]  # frames that are asked for from now on are its own
            request = _without_frames(sequence)
        else:
            request = _frames(sequence, *asked)


def _frames(sequence: MeshSequence, what: str, start: int, stop: int) -> Array:
    if what == POSITIONS:
        return sequence.read(start, stop)
    if what == EXACT:
        return sequence.read_absolute(start, stop)
    if what.startswith(CELLS) and sequence.volume is not None:
        return np.asarray(sequence.volume.cell_fields[what.removeprefix(CELLS)].values[start:stop])
    return np.asarray(sequence.fields[what].values[start:stop])


def _without_frames(sequence: MeshSequence) -> MeshSequence:
    """The sequence whose frames and fields are asked for."""
    fields = {name: _asked(name, each) for name, each in sequence.fields.items()}
    volume = sequence.volume
    if volume is not None:
        inside = {name: _asked(CELLS + name, each) for name, each in volume.cell_fields.items()}
        volume = replace(volume, cell_fields=inside)
    exact = Asked(EXACT, sequence.shape, "f8") if sequence.is_rounded else None
    return sequence.reading_from(Asked(POSITIONS, sequence.shape, "f4"), exact, fields=fields, volume=volume)


def _asked(what: str, each: Field) -> Field:
    return Field(Asked(what, each.values.shape, each.values.dtype), each.domain, each.kind, each.unit, name=what)


def _why(path: Path) -> str:
    """Why the process may have died."""
    with contextlib.suppress(OSError):
        if shutil.disk_usage(path.parent).free < LITTLE_SPACE:
            return "No space left on device; free some space or choose another disk"
    return "its library died of it, as it does on a full disk; check the folder and the disk"
