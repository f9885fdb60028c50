"""Which sequences globs, folders and files name, and which file each becomes."""

from __future__ import annotations

from pathlib import Path

import pytest

from gvpipe.batch.inputs import find_jobs
from gvpipe.foundation.errors import InputError

FILES = (
    "captures/a/run.glb",
    "captures/a/walk.usdc",
    "captures/b/run.glb",
    "captures/b/frames/f_01.obj",
    "captures/b/frames/f_02.obj",
    "captures/b/frames/f.mtl",
    "captures/b/done.mp4",
    "captures/.hidden/run.glb",
    "captures/[odd]/f_01.ply",
    "captures/out/b/done.mp4",
)


@pytest.fixture(autouse=True)
def tree(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in FILES:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    monkeypatch.chdir(tmp_path)


def outputs(*sources: str, folder: str = "captures/out") -> list[str]:
    return [job.output for job in find_jobs(sources, folder).jobs]


def test_globs_folders_and_files_keep_folders() -> None:
    everything = ["[odd].mp4", "a/run.mp4", "a/walk.mp4", "b/frames.mp4", "b/run.mp4"]
    assert outputs("captures/**/*.glb") == ["a/run.mp4", "b/run.mp4"]
    assert outputs("captures") == outputs("captures/") == outputs("captures/*") == everything
    assert outputs("captures/**/*") == sorted([*everything, "b/done.mp4"])
    assert outputs("captures/*/run.glb", "captures/a") == ["a/run.mp4", "b/run.mp4", "run.mp4", "walk.mp4"]
    assert outputs("captures", folder="captures") == everything
    assert outputs("captures/a/run.glb", "captures/a/walk.usdc") == ["run.mp4", "walk.mp4"]
    assert outputs("captures/b/frames") == outputs("captures/b/frames/*.obj") == ["frames.mp4"]


def test_frames_of_a_folder_are_one_sequence_whatever_its_name() -> None:
    jobs = find_jobs(["captures"], "out").jobs
    assert [job.source for job in jobs if job.output in ("[odd].mp4", "b/frames.mp4")] == [
        "captures/[[]odd]/*.ply",
        "captures/b/frames/*.obj",
    ]


def test_files_that_a_list_of_steps_names_are_its_own(tmp_path: Path) -> None:
    (tmp_path / "runs" / "crash").mkdir(parents=True)
    entries = ""
    for k in range(3):
        (tmp_path / "runs" / "crash" / f"{k}.vtp").touch()
        entries += f'<DataSet timestep="{k}" file="crash/{k}.vtp"/>' if k < 2 else ""
    text = f'<VTKFile type="Collection"><Collection>{entries}</Collection></VTKFile>'
    (tmp_path / "runs" / "crash.pvd").write_text(text)
    with pytest.raises(InputError, match="would both become"):  # a third file that the list does not name
        find_jobs(["runs"], "out")
    (tmp_path / "runs" / "crash" / "2.vtp").unlink()
    assert [job.source for job in find_jobs(["runs"], "out").jobs] == ["runs/crash.pvd"]
    (tmp_path / "runs" / "crash.pvd").write_text("damaged")
    with pytest.raises(InputError, match="would both become"):
        find_jobs(["runs"], "out")


def test_what_is_no_mesh_is_left_out() -> None:
    assert find_jobs(["captures"], "captures/out").left_out == ["captures/b/frames/f.mtl"]
    with pytest.raises(InputError, match="no sequence among 1 files, such as captures/b/frames/f.mtl"):
        find_jobs(["captures/b/frames/*.mtl"], "out")


@pytest.mark.parametrize(
    ("sources", "folder", "words"),
    [
        (["captures/*/run.glb", "captures/a/run.glb"], "out", None),
        (["captures/a/run.glb", "captures/b/run.glb"], "out", "a/run.glb and captures/b/run.glb would both become .*run.mp4"),
        (["captures/**/*.mp4"], "captures", "no sequence among 0 files"),
        (["missing"], "out", "missing: no such file or folder"),
        (["captures/*.usd"], "out", "no file matches.*quotes"),
        (["https://example.org/a.mp4"], "out", "is an address"),
        ([""], "out", "empty"),
    ],
)
def test_refused_before_anything_runs(sources: list[str], folder: str, words: str | None) -> None:
    if words is None:
        assert len(find_jobs(sources, folder).jobs) == 3
        return
    with pytest.raises(InputError, match=words):
        find_jobs(sources, folder)


def test_what_an_earlier_run_wrote_is_no_input(tmp_path: Path) -> None:
    own, out = tmp_path / "own", tmp_path / "own" / "out"
    out.mkdir(parents=True)
    (own / "a.npz").write_text("")
    for name in ("a.mp4", "manifest.jsonl"):
        (out / name).write_text("")
    found = find_jobs([str(own)], out)
    assert len(found.jobs) == 1 and found.left_out == []
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match="empty: no file is in it; give a folder with sequences"):
        find_jobs([str(tmp_path / "empty")], out)
