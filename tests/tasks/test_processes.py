"""Processes that do tasks: results, errors, deaths, and none that outlive the pool."""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import Any

import pytest
import task_functions

from gvpipe.foundation.errors import InputError, SettingError
from gvpipe.tasks.choice import open_executor
from gvpipe.tasks.executor import WorkerDied
from gvpipe.tasks.processes import Processes


@pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGKILL")
def test_tasks_errors_and_deaths(tmp_path: Path) -> None:
    tasks = [("a", 0), ("raise", "b"), ("die once", str(tmp_path / "mark")), ("c", 0), ("die", 0), ("threads", 0)]
    with Processes(2) as processes:
        outcomes = {each.index: each for each in processes.run(task_functions.prepare, b"did", tasks)}
        again = [each.value for each in processes.run(task_functions.prepare, b"then", [("d", 0)])]
    assert {index: each.value for index, each in outcomes.items() if each.error is None} == {
        0: "did a",
        2: "did die once",
        3: "did c",
        5: "1",
    }
    assert isinstance(outcomes[1].error, InputError) and str(outcomes[1].error) == "no b"
    assert isinstance(outcomes[4].error, WorkerDied) and "SIGKILL" in (said := str(outcomes[4].error)) and "3 times" in said
    assert again == ["then d"]


def test_what_cannot_be_prepared_fails_each_task() -> None:
    with Processes(1) as processes:
        errors = [each.error for each in processes.run(task_functions.prepare, b"refuse", [("a", 0), ("b", 0)])]
    assert [str(error) for error in errors] == ["it is refused"] * 2


@pytest.mark.skipif(not Path("/proc").exists(), reason="this system lists no processes")
def test_no_process_outlives_its_pool() -> None:
    with Processes(1) as processes:
        run: Any = processes.run(task_functions.prepare, b"", [("pid", 0), ("sleep", 60)])
        pid = next(run).value
        begun = time.monotonic()
        run.close()
    assert time.monotonic() - begun < 30 and not Path(f"/proc/{pid}").exists()


@pytest.mark.parametrize(
    ("scheduler", "workers", "words"),
    [("tcp://here:1", 2, "give one of the two"), (None, 0, "1..1024"), (None, True, "1..1024"), (None, 2000, "1..1024")],
)
def test_refused_choices(scheduler: str | None, workers: int, words: str) -> None:
    with pytest.raises(SettingError, match=words), open_executor(scheduler, workers):
        pass
