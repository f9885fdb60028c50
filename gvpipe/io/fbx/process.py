"""The other process, seen from here: requests go to `gvpipe.io.fbx.worker`, and answers come back."""

from __future__ import annotations

import contextlib
import importlib.util
import os
import pickle
import subprocess
import sys
import threading
import weakref
from pathlib import Path
from typing import Any

from gvpipe.errors import InputError
from gvpipe.io.damage import unreadable


class FbxProcess:
    """A process that has loaded one FBX file.

    Args:
        path: of the file.

    Raises:
        InputError: ufbx is missing, or refuses the file; or the process dies.
    """

    def __init__(self, path: Path) -> None:
        if importlib.util.find_spec("ufbx") is None:
            raise InputError(f"{path} needs ufbx; install it with: pip install 'gvpipe[fbx]'")
        self._path = path
        self._lock = threading.Lock()
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
        self._process = subprocess.Popen(
            [sys.executable, "-m", "gvpipe.io.fbx.worker", os.fspath(path.absolute())],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env=environment,
        )
        self._finalizer = weakref.finalize(self, _end, self._process)
        self._receive()

    def ask(self, name: str, *arguments: Any) -> Any:
        """What a method of `gvpipe.io.fbx.evaluator.FbxScene` returns; raises `InputError`."""
        with self._lock:
            if self._process.stdin is not None and self._process.poll() is None:
                with contextlib.suppress(OSError):  # it has died, which the answer says
                    pickle.dump((name, arguments), self._process.stdin, protocol=5)
                    self._process.stdin.flush()
            return self._receive()

    def _receive(self) -> Any:
        assert self._process.stdout is not None  # it is a pipe
        try:
            state, result = pickle.load(self._process.stdout)
        except (EOFError, OSError, pickle.UnpicklingError) as exc:
            raise unreadable(self._path, "FBX", "ufbx, which is experimental, died") from exc
        if state == "refused":
            raise unreadable(self._path, "FBX", str(result).removeprefix(f"{self._path}: "))
        return result


def _end(process: subprocess.Popen[bytes]) -> None:
    process.kill()
    for pipe in (process.stdin, process.stdout):
        if pipe is not None:
            with contextlib.suppress(OSError):
                pipe.close()
    process.wait()
