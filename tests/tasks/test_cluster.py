"""A Dask cluster: the same bytes while workers are killed, and one clear line for clusters that cannot be used."""

from __future__ import annotations

import os
import signal
import sys
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import pytest
from sequences import waving

import gvpipe
from gvpipe.batch.runs import encode_all
from gvpipe.foundation.errors import InputError
from gvpipe.tasks import cluster

pytestmark = pytest.mark.filterwarnings("ignore")  # Dask's own


def test_without_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match=r"pip install 'gvpipe\[cluster\]'"), cluster.connect("tcp://here:1"):
        pass


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:1", "127.0.0.1", "foo://127.0.0.1:1", ""])
def test_no_scheduler(address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr(cluster, "TIMEOUT", 0.2)
    with pytest.raises(InputError, match=f"scheduler {address}: .*check the address"), cluster.connect(address):
        pass


class FakeClient:
    """A client whose workers answer so."""

    def __init__(self, answers: dict[str, Any]) -> None:
        self.answers = answers

    def wait_for_workers(self, n_workers: int, timeout: float) -> None:
        if not self.answers:
            raise TimeoutError

    def run(self, function: Any, *arguments: Any, on_error: str) -> dict[str, Any]:
        return self.answers


@pytest.mark.parametrize(
    ("answers", "words"),
    [
        ({}, "it has no workers; start some with `dask worker tcp://s:1`"),
        ({"tcp://w:1": PackageNotFoundError("gvpipe")}, "worker tcp://w:1 has no gvpipe"),
        ({"tcp://w:1": version("gvpipe"), "tcp://w:2": "0.0.9"}, "worker tcp://w:2 has gvpipe 0.0.9, this is"),
    ],
)
def test_workers_that_cannot_work(answers: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        cluster._check_workers(FakeClient(answers), "tcp://s:1")


def test_tasks_refuse_another_version() -> None:
    with pytest.raises(InputError, match="the client 0.0.9"):
        cluster._do("0.0.9", lambda data: lambda task: task, b"", 1)


class FakeFuture:
    """A task that ended so."""

    def __init__(self, status: str, error: Exception | None = None) -> None:
        self.status, self._error = status, error

    def exception(self) -> Exception | None:
        return self._error


def test_clusters_that_break() -> None:
    """The scheduler goes away; a worker that came late has no gvpipe; a task fails."""
    pytest.importorskip("distributed")
    broken = cluster.Cluster(None, "tcp://s:1")
    with pytest.raises(InputError, match="the scheduler at tcp://s:1 has gone"):
        broken._outcome(0, FakeFuture("cancelled"))
    with pytest.raises(InputError, match="a worker of tcp://s:1 lacks gvpipe"):
        broken._outcome(0, FakeFuture("error", ModuleNotFoundError("No module named 'gvpipe'", name="gvpipe")))
    error = InputError("no such file")
    assert broken._outcome(3, FakeFuture("error", error)).error is error


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGKILL")
def test_same_bytes_while_workers_are_killed(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    distributed = pytest.importorskip("distributed")
    gvpipe.write(waving(10, 120), tmp_path / "in.npz")
    gvpipe.encode(tmp_path / "in.npz", tmp_path / "here.mp4", codec="pdct", segment=4)
    killed: list[int] = []
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as local:

        def kill(stage: str, done: float) -> None:
            """One worker when a tenth is coded, the other at half."""
            if stage == "clips" and len(killed) < 2 and done > (0.1, 0.5)[len(killed)]:
                pid = list(local.workers.values())[len(killed)].pid
                killed.append(pid)
                os.kill(pid, signal.SIGKILL)

        target, address = tmp_path / "there.mp4", local.scheduler_address
        gvpipe.encode(tmp_path / "in.npz", target, "pdct", kill, segment=4, scheduler=address)
        assert len(killed) == 2 and target.read_bytes() == (tmp_path / "here.mp4").read_bytes()

        (tmp_path / "bad.npz").write_text("no archive")
        report = encode_all([tmp_path / "in.npz", tmp_path / "bad.npz"], tmp_path / "out", "pdct", segment=4, scheduler=address)
        assert (report.encoded, len(report.failed)) == (1, 1) and "bad.npz" in report.failed[0]["error"]
        assert (tmp_path / "out" / "in.mp4").read_bytes() == target.read_bytes()
    assert "Traceback" not in capfd.readouterr().out
