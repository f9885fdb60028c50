"""What one process compiles, others wait for; a process that ends lets go of what it has claimed."""

from __future__ import annotations

import os
import sys
import threading
import time
from pathlib import Path
from typing import Any

import pytest

from gvpipe.foundation.isolation.python import start_python
from gvpipe.runtime.claims import Claims, claims_in

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="there every claim is granted")
HOLD = """
import sys
from pathlib import Path
from gvpipe.runtime.claims import Claims
claims = Claims(Path(sys.argv[1]))
print(claims.take("kernel", 0), flush=True)
if sys.stdin.readline() == "release\\n":
    claims.release("kernel")
    print("released", flush=True)
    sys.stdin.readline()
"""


@pytest.fixture
def other(tmp_path: Path) -> Any:
    """A process that has claimed ``kernel``."""
    process = start_python(["-c", HOLD, str(tmp_path)])
    assert process.stdout is not None and process.stdout.readline().strip() == b"True"
    yield process
    process.kill()
    process.communicate()


def test_one_process_has_it(other: Any, tmp_path: Path) -> None:
    claims = Claims(tmp_path)
    assert not claims.take("kernel", 0) and claims.take("another", 0)
    other.stdin.write(b"release\n")
    other.stdin.flush()
    assert other.stdout.readline().strip() == b"released"
    assert claims.take("kernel", 0) and claims.take("kernel", 0)  # of one's own


def test_who_waits_gets_what_a_killed_process_had(other: Any, tmp_path: Path) -> None:
    threading.Timer(0.2, other.kill).start()
    start = time.monotonic()
    assert Claims(tmp_path).take("kernel", 30) and time.monotonic() - start < 25


def test_patience_ends(other: Any, tmp_path: Path) -> None:
    start = time.monotonic()
    assert not Claims(tmp_path).take("kernel", 0.2) and time.monotonic() - start >= 0.2


def test_folders_without_locks_grant_everything(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    import fcntl

    def fail(*_: object) -> None:
        raise OSError("no locks")

    monkeypatch.setattr(fcntl, "lockf", fail)
    assert Claims(tmp_path).take("kernel", 0)
    assert Claims(tmp_path / "missing").take("kernel", 0)
    assert claims_in(tmp_path) is claims_in(tmp_path) and os.stat(tmp_path / "claims").st_mode & 0o777 == 0o600
