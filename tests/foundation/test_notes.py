"""What was done in silence is told: a line on standard error, in JSON and on the library's objects, which print nothing."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from conftest import FAST
from folders import DOCS
from sequences import grid

import gvpipe
from gvpipe.cli.commands import cli
from gvpipe.foundation.arrays import Array
from gvpipe.foundation.errors import InputError, OutputError
from gvpipe.foundation.notes import ASSUMED_FPS
from gvpipe.io.frames.discovery import find_frames
from gvpipe.model.sequence import MeshSequence

OPTIONS = ("--set", "preset=ultrafast", "--set", "clusters=3", "--set", "gop=4")
Run = Callable[..., Any]
QUADS = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 2 0\n"
QUAD_FILES = {
    "q.obj": QUADS + "f 1 2 3 4\nf 1 3 5\n",
    "q.off": "OFF\n5 2 0\n" + QUADS.replace("v ", "") + "4 0 1 2 3\n3 0 2 4\n",
    "q.ply": "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\nelement face 2\n"
    "property list uchar int vertex_indices\nend_header\n" + QUADS.replace("v ", "") + "4 0 1 2 3\n3 0 2 4\n",
}


@pytest.fixture
def walk(sequence: MeshSequence, tmp_path: Path) -> Path:
    """Eleven frames, numbered without zeros, so that their names sort otherwise as text."""
    gvpipe.write(sequence, tmp_path / "walk" / "f%d.obj", start=1)
    return tmp_path / "walk"


def notes_of(run: Run, *arguments: object) -> list[str]:
    """The notes that a command prints, checked to be those of its JSON."""
    ended = run(*arguments, "--json")
    assert ended.status == 0, ended.err
    lines = ended.err.splitlines()
    assert all(line.startswith("Note: ") for line in lines)
    assert [line.removeprefix("Note: ") for line in lines] == json.loads(ended.out)["notes"]
    return [line.removeprefix("Note: ") for line in lines]


# notes


def test_one_frame_of_many(run: Run, walk: Path, tmp_path: Path) -> None:
    (note,) = notes_of(run, "encode", walk / "f1.obj", tmp_path / "o.mp4", *OPTIONS)
    assert note == f"f1.obj is 1 of 11 numbered files and was read alone; all of them are '{walk / 'f%d.obj'}'"
    choice = note.split("'")[1]
    assert len(gvpipe.read(choice)) == 11
    for file in walk.iterdir():
        file.unlink() if file.name != "f1.obj" else None
    assert notes_of(run, "encode", walk / "f1.obj", tmp_path / "o.mp4", *OPTIONS) == []


@pytest.mark.parametrize(
    ("names", "one", "choice"),
    [
        (["w_0001_lod0.obj", "w_0002_lod0.obj"], "w_0002_lod0.obj", "w_%04d_lod0.obj"),
        (["t1_f1.obj", "t1_f2.obj", "t2_f1.obj"], "t1_f2.obj", "t1_f%d.obj"),
        (["f1.obj", "f2.ply"], "f1.obj", None),
        (["a.obj", "b.obj"], "a.obj", None),
    ],
)
def test_which_files_are_siblings(names: list[str], one: str, choice: str | None, tmp_path: Path) -> None:
    for name in names:
        (tmp_path / name).write_text(QUAD_FILES["q.obj"])
    told = [note for note in gvpipe.read(tmp_path / one).notes if "numbered files" in note]
    assert [note.split("'")[1] for note in told] == ([str(tmp_path / choice)] if choice else [])


@pytest.mark.parametrize("name", QUAD_FILES)
def test_polygons_are_kept(name: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text(QUAD_FILES[name])
    read = gvpipe.read(tmp_path / name)
    assert read.polygons is not None and sorted(read.polygons.tolist()) == [3, 4]
    assert read.notes == () and len(read.faces) == 3


def test_binary_quads(tmp_path: Path) -> None:
    points, _ = grid(3)
    header = QUAD_FILES["q.ply"].split("end_header")[0].replace("ascii", "binary_little_endian").replace("vertex 5", "vertex 9")
    faces = np.zeros(2, [("n", "u1"), ("i", "<i4", 4)])
    faces["n"], faces["i"] = 4, [[0, 1, 4, 3], [1, 2, 5, 4]]
    (tmp_path / "q.ply").write_bytes(f"{header}end_header\n".encode() + points.astype("<f4").tobytes() + faces.tobytes())
    polygons = gvpipe.read(tmp_path / "q.ply").polygons
    assert polygons is not None and polygons.tolist() == [4, 4]


def test_a_frame_rate_that_was_assumed(run: Run, walk: Path, sequence: MeshSequence, tmp_path: Path) -> None:
    out = tmp_path / "o.mp4"
    np.savez(tmp_path / "no_fps.npz", vertices=sequence.positions[:], faces=sequence.faces)
    gvpipe.write(sequence, tmp_path / "fps.npz")
    for source in (walk, tmp_path / "no_fps.npz"):
        assert notes_of(run, "encode", source, out, *OPTIONS) == [ASSUMED_FPS]
        assert notes_of(run, "encode", source, out, *OPTIONS, "--fps", 30) == []
    assert notes_of(run, "encode", tmp_path / "fps.npz", out, *OPTIONS) == []
    assert gvpipe.encode(gvpipe.read(walk), out, fps=24.0, **FAST).notes == []


def test_a_bound_larger_than_the_object(run: Run, tmp_path: Path, sequence: MeshSequence) -> None:
    gvpipe.write(sequence, tmp_path / "tube.npz")
    (note,) = notes_of(run, "encode", tmp_path / "tube.npz", tmp_path / "o.mp4", *OPTIONS, "--max-error", "200%")
    diagonal = np.linalg.norm(np.ptp(sequence.read(0, 1)[0], axis=0))
    assert note == f"the largest error allowed, {2 * diagonal:g}, is larger than the object, whose diagonal is {diagonal:g}"
    assert notes_of(run, "encode", tmp_path / "tube.npz", tmp_path / "o.mp4", *OPTIONS, "--max-error", "90%") == []


def test_attributes_that_the_file_does_not_carry(run: Run, sequence: MeshSequence, tmp_path: Path) -> None:
    attributes: dict[str, Array] = {"uv": np.zeros((72, 2), np.float32), "color": np.zeros((72, 4), np.uint8)}
    gvpipe.write(MeshSequence(sequence.positions, sequence.faces, 25.0, attributes), tmp_path / "a.npz")
    assert notes_of(run, "encode", tmp_path / "a.npz", tmp_path / "o.mp4", *OPTIONS) == []
    left_out = ("--attribute", "uv=none", "--attribute", "color=none")
    noticed = notes_of(run, "encode", tmp_path / "a.npz", tmp_path / "o.mp4", *left_out, *OPTIONS)
    assert noticed == ["the file does not carry color, uv"]


def test_the_library_prints_nothing(walk: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    report = gvpipe.encode(walk / "f1.obj", tmp_path / "o.mp4", max_error=1e3, **FAST)
    assert len(report.notes) == 2 and report.to_json()["notes"] == report.notes
    assert capfd.readouterr() == ("", "")


# lists of frames


def test_an_unquoted_glob(run: Run, walk: Path, tmp_path: Path) -> None:
    """As the shell gives it, sorted as text: the same bytes as the quoted glob, in the order of the numbers."""
    listed = sorted(str(file) for file in walk.iterdir())
    assert listed != [str(file) for file in find_frames(str(walk))]
    (walk / "f.mtl").touch()
    assert run("encode", *listed, walk / "f.mtl", tmp_path / "list.mp4", *OPTIONS).status == 0
    assert run("encode", f"{walk}/*.obj", tmp_path / "glob.mp4", *OPTIONS).status == 0
    assert (tmp_path / "list.mp4").read_bytes() == (tmp_path / "glob.mp4").read_bytes()
    assert len(gvpipe.read(listed)) == 11


def test_an_order_that_is_kept_is_told(run: Run, walk: Path, tmp_path: Path) -> None:
    given = [walk / name for name in ("f1.obj", "f2.obj", "f1.obj")]
    told = notes_of(run, "encode", *given, tmp_path / "o.mp4", *OPTIONS, "--fps", 25)
    assert told == ["the names of the 3 files are not one numbered series; they are frames in the order given"]
    frames = gvpipe.read([str(file) for file in given]).read(0, 3)
    assert np.array_equal(frames[0], frames[2]) and not np.array_equal(frames[0], frames[1])


def test_lists_that_cannot_be_used(run: Run, walk: Path, tmp_path: Path) -> None:
    f1, f2, f4 = (walk / f"f{i}.obj" for i in (1, 2, 4))
    for given, words in (
        ((f1, f2, f4), "frame 3 missing between f2.obj and f4.obj"),
        ((f1, walk / "f99.obj"), "f99.obj: no such file"),
        ((f1, walk), "is a folder among 2 inputs"),
    ):
        ended = run("encode", *given, tmp_path / "o.mp4")
        assert ended.status == 1 and words in ended.err and ended.err.count("\n") == 1
    for arguments in ((f1, f2), (f1, f2, f4, tmp_path / "out.npz"), (f1, "-", tmp_path / "o.mp4")):
        ended = run("encode", *arguments)
        assert ended.status == (1 if len(arguments) == 2 else 2) and not (tmp_path / "o.mp4").exists()
    with pytest.raises(InputError, match="list of frame files is empty"):
        gvpipe.read([])
    (tmp_path / "o.mp4").write_bytes(b"old")
    assert "input too" in run("encode", f1, tmp_path / "o.mp4", tmp_path / "o.mp4").err


# names


@pytest.mark.parametrize("pattern", ["f_####.obj", "f_$F4.obj", "f_%04d.obj"])
def test_patterns_of_other_programs(pattern: str, run: Run, sequence: MeshSequence, tmp_path: Path) -> None:
    gvpipe.write(sequence, tmp_path / pattern)
    assert sorted(file.name for file in tmp_path.iterdir()) == [f"f_{i:04d}.obj" for i in range(11)]
    assert np.array_equal(gvpipe.read(tmp_path / pattern).read(0, 11), sequence.read(0, 11))
    assert run("encode", tmp_path / pattern, tmp_path / "o.mp4", *OPTIONS).status == 0


def test_a_folder_with_the_name_of_an_archive(run: Run, video: Path, tmp_path: Path, sequence: MeshSequence) -> None:
    (tmp_path / "dir.npz").mkdir()
    ended = run("decode", video, tmp_path / "dir.npz")
    assert ended.status == 1 and "dir.npz" in ended.err and "not an ordinary file" in ended.err
    assert list((tmp_path / "dir.npz").iterdir()) == []
    with pytest.raises(OutputError):
        gvpipe.write(sequence, tmp_path / "dir.npz")
    assert run("decode", video, f"{tmp_path}/dir.npz/").status == 0  # a name that ends in / is a folder
    assert len(gvpipe.read(tmp_path / "dir.npz")) == 11


# what every command takes


def test_every_command_has_the_three_options() -> None:
    for name in cli.commands:
        text = CliRunner().invoke(cli, [name, "--help"]).output
        assert all(option in text for option in ("--json", "--quiet", "--verbose")), name


def test_quiet(run: Run, walk: Path, video: Path, tmp_path: Path) -> None:
    for arguments in (
        ("encode", walk / "f1.obj", tmp_path / "o.mp4", *OPTIONS),
        ("decode", video, tmp_path / "o.npz"),
        ("info", video),
        ("compare", video, video),
        ("codecs",),
        ("render", video, tmp_path / "o.png", "--size", "64"),
        ("export-html", video, tmp_path / "o.html"),
    ):
        ended = run(*arguments, "--quiet")
        assert (ended.status, ended.out, ended.err) == (0, "", ""), arguments
        ended = run(*arguments, "-q", "--json")
        assert ended.err == "" and isinstance(json.loads(ended.out), dict)
    assert run("info", tmp_path / "none.mp4", "-q").err.startswith("Error: ")


def test_json_of_the_other_commands(run: Run, video: Path, tmp_path: Path) -> None:
    decoded = json.loads(run("decode", video, tmp_path / "o.npz", "--start", 2, "--stop", 5, "--json").out)
    assert decoded == {
        "output": str(tmp_path / "o.npz"), "frames": 3, "start": 2, "stop": 5, "fps": 25.0, "vertices": 72,
        "triangles": 128, "lod": 0, "origin": [0, 0, 0], "notes": [],
    }  # fmt: skip
    rendered = json.loads(run("render", video, tmp_path / "o.png", "--size", "64x48", "--json").out)
    assert (rendered["width"], rendered["height"]) == (64, 48)
    assert rendered["bytes"] == (tmp_path / "o.png").stat().st_size
    listed = json.loads(run("codecs", "--json").out)["codecs"]
    assert {"laplacian", "mcgv", "pca", "pdct"} <= {codec["id"] for codec in listed}
    assert all(codec["settings"]["quality"] == 75 for codec in listed)


def test_verbose(run: Run, video: Path, walk: Path, tmp_path: Path) -> None:
    plain, told = (run("encode", walk, tmp_path / "o.mp4", *OPTIONS, *more, "--json") for more in ((), ("-v",)))
    lines = [line.split(": ") for line in told.err.splitlines() if not line.startswith("Note: ")]
    stages = [name for name in json.loads(plain.out)["seconds"] if name != "encode"]
    assert [name for name, _ in lines if name in stages] and lines[-1][0] == "total"
    assert all(seconds.endswith(" s") and float(seconds[:-2]) >= 0 for _, seconds in lines)
    assert "total: " in run("info", video, "--verbose").err


def test_unexpected_errors(run: Run, video: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(path: str, **_: object) -> None:
        raise ZeroDivisionError("of\nall")

    monkeypatch.setattr("gvpipe.playback.video_info.info", fail)
    ended = run("info", video)
    assert ended.status == 1 and ended.err == "Error: unexpected ZeroDivisionError: of all; report what --verbose prints\n"
    told = run("info", video, "--verbose")
    assert told.status == 1 and "Traceback" in told.err and told.err.endswith(ended.err)


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_shell_completion(shell: str, run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    """The lines that docs/cli.md shows give a script, which asks for words that are commands and options."""
    assert f"_GVPIPE_COMPLETE={shell}_source gvpipe" in (DOCS / "cli.md").read_text()
    monkeypatch.setenv("_GVPIPE_COMPLETE", f"{shell}_source")
    assert f"_GVPIPE_COMPLETE={shell}_complete" in run().out
    monkeypatch.setenv("_GVPIPE_COMPLETE", f"{shell}_complete")
    for words, expected in (("gvpipe enc", "encode"), ("gvpipe decode --lo", "--local")):
        monkeypatch.setenv("COMP_WORDS", words)
        monkeypatch.setenv("COMP_CWORD", words.split()[-1] if shell == "fish" else str(len(words.split()) - 1))
        assert expected in run().out
