"""New Pythons, which import what this one has installed, and nothing from the current folder.

Python puts the current folder on the module path of ``python -m`` and ``python -c``. A stranger's folder may hold a
``pickle.py``. So every process starts here, with ``-P``, and its path is this process's without the current folder. Two folders
stay even if they are current: that of this gvpipe, and that of the program that runs, which is the user's own.

No other module imports `subprocess` or `multiprocessing` (tests/foundation/isolation/test_python.py).
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

PIPE, DEVNULL = subprocess.PIPE, subprocess.DEVNULL
Process = subprocess.Popen
TimeoutExpired = subprocess.TimeoutExpired


@dataclass(frozen=True)
class Ended:
    """A process that has ended.

    Args:
        status: 0 for success; below 0, the number of the signal that ended it.
        out: what it wrote to standard output.
        err: to standard error, as text.
    """

    status: int
    out: bytes
    err: str

    @property
    def last_line(self) -> str:
        """The last line of standard error, which says why it failed; its status where there is none."""
        return (self.err.strip().splitlines() or [f"status {self.status}"])[-1]


def start_python(
    arguments: Sequence[str], variables: Mapping[str, str] | None = None, stderr: int = DEVNULL, stdin: int = PIPE
) -> Process[bytes]:
    """Start a Python with pipes for its input and output.

    Args:
        arguments: of the interpreter: ``-m MODULE``, ``-c CODE`` or a file, then the program's own.
        variables: of the environment, beside this process's.
        stderr, stdin: where they go to and come from.
    """
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(module_path()), **(variables or {})}
    command = [sys.executable, "-P", *arguments]
    return Process(command, stdin=stdin, stdout=PIPE, stderr=stderr, env=environment)


def run_python(
    arguments: Sequence[str], variables: Mapping[str, str] | None = None, given: bytes | None = None, limit: float | None = None
) -> Ended:
    """Run a Python to its end.

    Args:
        arguments, variables: as those of `start_python`.
        given: its standard input; None: none.
        limit: seconds that it may take, None: any.

    Raises:
        TimeoutExpired: it took longer, and was ended.
        OSError: it cannot be started.
    """
    with start_python(arguments, variables, stderr=PIPE, stdin=DEVNULL if given is None else PIPE) as process:
        try:
            out, err = process.communicate(given, limit)
        except BaseException:
            process.kill()
            raise
    return Ended(process.returncode, out, err.decode(errors="replace"))


def run_program(words: Sequence[str], folder: str | os.PathLike[str], limit: float) -> Ended:
    """Run a program that the user names, to its end, in a folder; what it prints comes back as ``err``.

    Output goes through a file, so that children that outlive the program keep nobody waiting.

    Raises:
        TimeoutExpired: it took more than ``limit`` seconds, and was ended.
        OSError: it cannot be started.
    """
    with tempfile.TemporaryFile() as printed:
        with Process(list(words), stdin=DEVNULL, stdout=printed, stderr=subprocess.STDOUT, cwd=folder) as process:
            try:
                process.wait(limit)
            except BaseException:
                process.kill()
                raise
        printed.seek(0)
        return Ended(process.returncode, b"", printed.read().decode(errors="replace"))


def module_path() -> list[str]:
    """Where a new process finds modules: the absolute folders of this one's path, but for the current one."""
    main = getattr(sys.modules.get("__main__"), "__file__", None)
    kept = [Path(__file__).parents[3], *([Path(main).parent] if main else [])]
    current = os.path.realpath(os.curdir)  # a folder that is gone has no modules
    is_trusted = any(os.path.realpath(folder) == current for folder in kept)
    absolute = [entry for entry in sys.path if os.path.isabs(entry) and os.pathsep not in entry]
    return [entry for entry in absolute if is_trusted or os.path.realpath(entry) != current]
