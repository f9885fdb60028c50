"""Frame files are found whatever their naming, and nothing but one clear series is accepted."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from gvpipe.foundation.errors import InputError
from gvpipe.io.frames.discovery import find_frames, order_list


def make(folder: Path, *names: str) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    for name in names:
        (folder / name).touch()
    return folder


def names(path: object) -> list[str]:
    return [file.name for file in find_frames(str(path))]


ORDERS = {
    "padded": ["walk_0001.obj", "walk_0002.obj", "walk_0003.obj"],
    "not padded": [f"frame{i}.ply" for i in range(1, 13)],
    "half padded": ["f08.obj", "f09.obj", "f10.obj"],
    "from zero": ["0.stl", "1.stl", "2.stl"],
    "from anywhere": [f"{i}.off" for i in range(98, 103)],
    "number inside": [f"cloth.{i:03d}.cache.obj" for i in range(4)],
    "several numbers, one varies": [f"take2_v03_{i}.glb" for i in range(8, 12)],
    "number first, constant one last": [f"{i:04d}_lod0.obj" for i in range(9, 12)],
    "no numbers": ["a.obj", "b.obj", "c.obj"],
    "every second": ["f0.obj", "f2.obj", "f4.obj"],
    "dates": ["s_1200_59.obj", "s_1201_00.obj"],
    "upper case": ["A1.OBJ", "A2.OBJ"],
    "one": ["only.obj"],
}


@pytest.mark.parametrize("expected", ORDERS.values(), ids=ORDERS.keys())
def test_folder_order(tmp_path: Path, expected: list[str]) -> None:
    make(tmp_path, *reversed(expected), ".DS_Store", "._walk_0001.obj", "walk.mtl", "skin.png", "notes.txt")
    (tmp_path / "old.obj").mkdir()
    assert names(tmp_path) == expected


def test_glob_pattern_and_single_file(tmp_path: Path) -> None:
    make(tmp_path, *(f"a{i}.obj" for i in range(9, 12)), *(f"b{i:04d}.ply" for i in range(3)), "a10.mtl")
    assert names(tmp_path / "a*.obj") == ["a9.obj", "a10.obj", "a11.obj"]
    assert names(tmp_path / "a*") == ["a9.obj", "a10.obj", "a11.obj"]
    assert names(tmp_path / "a%d.obj") == ["a9.obj", "a10.obj", "a11.obj"]
    assert names(tmp_path / "b%04d.ply") == ["b0000.ply", "b0001.ply", "b0002.ply"]
    assert names(tmp_path / "b0002.ply") == ["b0002.ply"]


def test_existing_names_win_over_globs(tmp_path: Path) -> None:
    folder = make(tmp_path / "walk[1] 100%d", "f1.obj", "f2.obj")
    assert names(folder) == ["f1.obj", "f2.obj"]
    assert names(folder / "f%d.obj") == ["f1.obj", "f2.obj"]


def test_pattern_numbers_of_any_length(tmp_path: Path) -> None:
    make(tmp_path, "f9998.obj", "f9999.obj", "f10000.obj", "f00001.obj")
    assert names(tmp_path / "f%04d.obj") == ["f9998.obj", "f9999.obj", "f10000.obj"]


ERRORS = {
    "gap": (["walk_0012.obj", "walk_0014.obj"], "", "frame 0013 missing between walk_0012.obj and walk_0014.obj; "),
    "gap of three": (["f1.obj", "f2.obj", "f6.obj"], "", "frames 3 to 5 missing between f2.obj and f6.obj; "),
    "two gaps": (
        ["1.obj", "3.obj", "4.obj", "6.obj"],
        "",
        "frame 2 missing between 1.obj and 3.obj, frame 5 missing",
    ),
    "many gaps": ([f"{i * i}.obj" for i in range(2, 9)], "", ", and 36 more; "),
    "gap in a pattern": (["f0008.obj", "f0010.obj"], "f%04d.obj", "frame 0009 missing between"),
    "gap in a glob": (["f1.obj", "f3.obj"], "f*.obj", "frame 2 missing between"),
    "formats": (["a1.obj", "a2.obj", "a1.ply"], "", "2 .obj and 1 .ply files; keep one format or choose"),
    "series": (["a1.obj", "a2.obj", "b1.obj"], "", "2 series of files, a#.obj (2), b#.obj (1); choose one, such as"),
    "a stray": (["a1.obj", "a2.obj", "rest.obj"], "", "a#.obj (2), rest.obj (1)"),
    "two numbers": (["t1_1.obj", "t1_2.obj", "t2_1.obj", "t2_2.obj"], "", "t1_#.obj (2), t2_#.obj (2); choose one"),
    "same number": (["f1.obj", "f01.obj"], "", "have the same number; remove one"),
    "same number again": (["f1.obj", "f01.obj", "f2.obj"], "", "have the same number; remove one"),
    "empty": ([], "", "the folder is empty; frames may be .obj, .ply, .stl, .off, .glb, .gltf"),
    "no meshes": (["a.txt", "b.png"], "", "none of its 2 files is a mesh"),
    "one file, no mesh": (["a.txt"], "", "a.txt is not a mesh"),
    "not a mesh": (["a.txt"], "a.txt", "it is not a mesh; frames may be"),
    "no glob match": (["a1.obj"], "b*.obj", "no file matches; check the path"),
    "no pattern match": (
        ["a1.obj"],
        "a%04d.obj",
        "no file such as a0001.obj; check the path and the number of digits",
    ),
    "no folder of a pattern": ([], "no/%d.obj", "no folder "),
    "no path": ([], "nowhere", "no such file or folder; check the path"),
    "two percents": ([], "%d_%d.obj", "2 numbers in the pattern; keep one"),
    "percent in a folder": ([], "%d/a.obj", "only the file's name can be numbered"),
}


@pytest.mark.parametrize(("files", "path", "message"), ERRORS.values(), ids=ERRORS.keys())
def test_errors(tmp_path: Path, files: list[str], path: str, message: str) -> None:
    make(tmp_path, *files)
    with pytest.raises(InputError) as error:
        find_frames(os.path.join(tmp_path, path) if path else str(tmp_path))
    assert message in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("chosen", "others"),
    [
        (["t2_1.obj", "t2_2.obj", "t2_3.obj"], ["t1_1.obj", "t1_2.obj"]),
        (["w_0001.obj", "w_0002.obj", "w_0003.obj"], ["w_b_0001.obj", "rest.obj"]),
        (["w_08.obj", "w_09.obj", "w_10.obj"], ["w_10_lod.obj"]),
    ],
)
def test_the_suggested_choice_works(tmp_path: Path, chosen: list[str], others: list[str]) -> None:
    folder = make(tmp_path / "run 7", *chosen, *others)
    with pytest.raises(InputError) as error:
        find_frames(str(folder))
    assert names(str(error.value).split("such as ")[1].strip("'")) == chosen


@pytest.mark.parametrize(
    ("given", "expected", "is_kept"),
    [
        (["f1", "f10", "f2", "f3", "f4", "f5", "f6", "f7", "f8", "f9"], [f"f{i}" for i in range(1, 11)], False),
        (["f3", "f2", "f1"], ["f1", "f2", "f3"], False),
        (["b", "a"], ["b", "a"], True),
        (["rest", "f2", "f1"], ["rest", "f2", "f1"], True),
        (["f1", "f2", "f3", "f2", "f1"], ["f1", "f2", "f3", "f2", "f1"], True),
        (["t2_f1", "t2_f2", "t1_f1", "t1_f2"], ["t2_f1", "t2_f2", "t1_f1", "t1_f2"], True),
        (["f1", "f01"], ["f1", "f01"], True),
        (["f7"], ["f7"], False),
    ],
)
def test_order_of_a_list(given: list[str], expected: list[str], is_kept: bool, tmp_path: Path) -> None:
    for name in given:
        (tmp_path / f"{name}.obj").touch()
    files, kept = order_list([tmp_path / f"{name}.obj" for name in given])
    assert ([file.stem for file in files], kept) == (expected, is_kept)


@pytest.mark.parametrize(
    "expected",
    [
        ["f_-2.obj", "f_-1.obj", "f_0.obj", "f_1.obj"],
        ["f_-0010.obj", "f_-0009.obj", "f_-0008.obj"],
        ["w.-1.obj", "w.0.obj", "w.1.obj"],
        ["-2.obj", "-1.obj", "0.obj"],
        ["frame-2.obj", "frame-1.obj", "frame0.obj", "frame1.obj", "frame2.obj"],
        ["frame-1.obj", "frame-2.obj", "frame-3.obj"],
        ["2024-05-01.obj", "2024-05-02.obj"],
        ["s-1_f-1.obj", "s-1_f-2.obj"],
    ],
)
def test_negative_numbers(expected: list[str], tmp_path: Path) -> None:
    for name in expected:
        (tmp_path / name).touch()
    assert [file.name for file in find_frames(str(tmp_path))] == expected
    assert [file.name for file in order_list([tmp_path / name for name in reversed(expected)])[0]] == expected


def test_negative_numbers_of_a_pattern(tmp_path: Path) -> None:
    for name in ("f-002.obj", "f-001.obj", "f0000.obj", "f0001.obj", "g-0001.obj", "g0000.obj", "f-3.obj"):
        (tmp_path / name).touch()
    assert [file.name for file in find_frames(str(tmp_path / "f%04d.obj"))] == [
        "f-002.obj", "f-001.obj", "f0000.obj", "f0001.obj",
    ]  # fmt: skip
    assert [file.name for file in find_frames(str(tmp_path / "g####.obj"))] == ["g-0001.obj", "g0000.obj"]


def test_gaps_among_negative_numbers(tmp_path: Path) -> None:
    for name in ("f_-0003.obj", "f_-0001.obj", "f_0000.obj"):
        (tmp_path / name).touch()
    with pytest.raises(InputError, match="frame -0002 missing between f_-0003.obj and f_-0001.obj"):
        find_frames(str(tmp_path))
