"""The process that runs a library which writes; see `gvpipe.io.library.writing_process`.

It ends by one message: ``(done, notes)``, or ``(input, text)`` or ``(output, text)`` of an `InputError` or any other error.
"""

from __future__ import annotations

import importlib
import os
import pickle
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from typing import IO, TYPE_CHECKING, Any

from gvpipe.foundation.atomic import output_error
from gvpipe.foundation.errors import GvpipeError, InputError

if TYPE_CHECKING:
    from gvpipe.model.sequence import MeshSequence

ASK, DONE, INPUT, OUTPUT = "ask", "done", "input", "output"
POSITIONS, EXACT, CELLS, SHOT = ".positions", ".exact", ".cells.", ".shot"  # no names of fields that any reader makes
_answers: list[IO[bytes]] = []  # to the process that started this one


@dataclass(frozen=True)
class Asked:
    """Frames of an array that the other process has."""

    what: str
    shape: tuple[int, ...]
    dtype: Any

    def __getitem__(self, key: slice, /) -> Any:
        start, stop, _ = key.indices(self.shape[0])
        _send(ASK, self.what, start, stop)
        return pickle.load(sys.stdin.buffer)


@dataclass(frozen=True)
class AskedShots:
    """The shots of a capture that the other process has. Frames can be read of the shot alone that was asked for last.

    Args:
        lengths: frames of each.
        fps: of all.
    """

    lengths: tuple[int, ...]
    fps: float

    def __iter__(self) -> Iterator[MeshSequence]:
        for number in range(len(self.lengths)):
            _send(ASK, SHOT, number, number + 1)
            yield pickle.load(sys.stdin.buffer)


def main() -> None:
    """Write one file."""
    _answers.append(os.fdopen(os.dup(1), "wb"))
    os.dup2(2, 1)  # nothing but answers may reach the other process
    module, function, sequence, temporary, path = pickle.load(sys.stdin.buffer)
    try:
        _send(DONE, getattr(importlib.import_module(module), function)(sequence, temporary, path.stem))
    except InputError as exc:
        _send(INPUT, str(exc))
    except GvpipeError as exc:
        _send(OUTPUT, str(exc))
    except OSError as exc:
        _send(OUTPUT, str(output_error(path, exc)))
    except Exception as exc:
        _send(OUTPUT, f"cannot write {path}: {' '.join(str(exc).split())}; check the folder and the disk")
    os._exit(0)  # closing what could not be written may crash


def _send(*message: Any) -> None:
    pickle.dump(message, _answers[0], protocol=5)
    _answers[0].flush()


if __name__ == "__main__":
    sys.modules["gvpipe.io.library.writing_worker"] = sys.modules["__main__"]  # the sequence's `Asked` is this one
    main()
