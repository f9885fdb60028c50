"""What workers do in tests of executors: functions of a module that they can import."""

from __future__ import annotations

import os
import signal
import time
from functools import partial
from pathlib import Path
from typing import Any

from gvpipe.foundation.errors import InputError
from gvpipe.tasks.executor import Work


def prepare(data: bytes) -> Work:
    """What does tasks, ``(what, argument)``; ``data`` is joined to what it returns."""
    if data == b"refuse":
        raise InputError("it is refused")
    return partial(_do, data.decode())


def _do(prefix: str, task: tuple[str, Any]) -> Any:
    what, argument = task
    if what == "die" or (what == "die once" and _is_first(Path(argument))):
        os.kill(os.getpid(), signal.SIGKILL)
    if what == "raise":
        raise InputError(f"no {argument}")
    if what == "sleep":
        time.sleep(argument)
    if what == "threads":
        return os.environ["OPENBLAS_NUM_THREADS"]
    if what == "pid":
        return os.getpid()
    return f"{prefix} {what}"


def _is_first(mark: Path) -> bool:
    is_first = not mark.exists()
    mark.touch()
    return is_first
