"""The command line: results on standard output, one clear line for everything that is wrong, and no file damaged."""

from __future__ import annotations

import dataclasses
import errno
import io
import json
import os
import struct
import subprocess
import sys
from collections.abc import Callable, Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import cv2
import numpy as np
import pytest
from file_server import serving

import gvpipe
from gvpipe.coding.registry import codec_class, codec_ids
from gvpipe.foundation.errors import CorruptFile, FormatError, NotGeometryVideo, StrippedFile, TruncatedFile
from gvpipe.model.sequence import MeshSequence

FAST = ("--set", "preset=ultrafast", "--set", "clusters=3", "--set", "gop=4")
HEAVY = ("numpy", "scipy", "cv2", "av", "numba", "trimesh", "xatlas", "DracoPy", "PIL")
ENCODE_KEYS = {"codec", "settings", "vertices", "triangles", "frames", "fps", "bytes", "bpvf", "seconds"}
COMPARE_KEYS = {"rmse", "rmse_diag", "max", "max_diag", "kg", "da", "sted", "hausdorff", "frames"}
OLD = b"an older file"

Run = Callable[..., Any]


def contents(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def one_object(text: str) -> dict[str, Any]:
    """The one JSON object that a text is, to its last byte; NaN and Infinity are not JSON."""
    found = json.loads(text, parse_constant=lambda name: pytest.fail(f"{name} in JSON"))
    assert isinstance(found, dict) and text == json.dumps(found) + "\n"
    return found


def assert_refused(run: Run, folder: Path, arguments: tuple[object, ...], words: tuple[str, ...]) -> None:
    """One line on standard error that holds ``words``, exit 1, and every file in ``folder`` as it was."""
    before = contents(folder)
    ended = run(*arguments)
    assert ended.status == 1 and ended.out == "", ended
    assert ended.err.startswith("Error: ") and ended.err.count("\n") == 1 and "Traceback" not in ended.err, ended.err
    assert [word for word in words if word not in ended.err] == [], ended.err
    assert contents(folder) == before


def obj_text(positions: np.ndarray, faces: np.ndarray) -> str:
    lines = ["v {:.9g} {:.9g} {:.9g}".format(*p) for p in positions.tolist()]
    return "\n".join(lines + ["f {} {} {}".format(*f) for f in (faces + 1).tolist()]) + "\n"


def write_frames(sequence: MeshSequence, folder: Path) -> list[Path]:
    folder.mkdir()
    paths = [folder / f"walk_{i:03d}.obj" for i in range(len(sequence))]
    for i, path in enumerate(paths):
        path.write_text(obj_text(sequence.read(i, i + 1)[0], sequence.faces))
    return paths


@pytest.fixture
def npz(sequence: MeshSequence, tmp_path: Path) -> Path:
    gvpipe.write(sequence, tmp_path / "tube.npz")
    return tmp_path / "tube.npz"


# commands


def test_encode_json(run: Run, npz: Path, sequence: MeshSequence, tmp_path: Path) -> None:
    """All pinned keys, figures that agree with the file and the input, nothing else on either stream."""
    target = tmp_path / "out.mp4"
    ended = run("encode", npz, target, *FAST, "--json")
    report = one_object(ended.out)
    assert (ended.status, ended.err) == (0, "") and set(report) >= ENCODE_KEYS
    shape = (len(sequence), sequence.n_vertices, len(sequence.faces), sequence.fps)
    assert (report["frames"], report["vertices"], report["triangles"], report["fps"]) == shape
    assert report["codec"] == "mcgv" and report["bytes"] == target.stat().st_size
    assert report["bpvf"] == 8 * report["bytes"] / (report["frames"] * report["vertices"])
    chosen = codec_class("mcgv")(preset="ultrafast", clusters=3, gop=4)
    assert report["settings"] == dataclasses.asdict(chosen)
    seconds = report["seconds"]
    stages = sum(value for name, value in seconds.items() if name != "encode")
    assert len(seconds) > 3 and min(seconds.values()) >= 0 and stages <= seconds["encode"]


def test_encode_sources_and_settings(run: Run, npz: Path, sequence: MeshSequence, tmp_path: Path) -> None:
    """An archive, a folder, a glob, a pattern and Python give the same bytes; every way to set a setting is the same."""
    folder = tmp_path / "frames"
    write_frames(sequence, folder)
    gvpipe.encode(sequence, tmp_path / "api.mp4", preset="ultrafast", clusters=3, gop=4, quality=60.0, segment=7)
    wanted = (tmp_path / "api.mp4").read_bytes()
    ways = [
        ("--quality", 60, "--segment", 7),
        ("--set", "quality=60", "--set", " segment = 7 "),
        ("--quality=60.0", "--set=segment=7"),
    ]
    for i, source in enumerate([npz, folder, f"{folder}/*.obj", folder / "walk_%03d.obj"]):
        ended = run("encode", source, tmp_path / "o.mp4", *FAST, *ways[i % 3], "--fps", 25)
        assert ended.status == 0 and (tmp_path / "o.mp4").read_bytes() == wanted, (source, ended)
        assert ended.out.startswith(f"{source} (11 frames, 72 vertices) -> {tmp_path / 'o.mp4'} (")


def test_compare_json(run: Run, npz: Path, video: Path, sequence: MeshSequence) -> None:
    """Pinned keys; totals follow from the frames; a sequence or a video on either side."""
    values = one_object(run("compare", npz, video, "--json").out)
    assert set(values) >= COMPARE_KEYS and len(values["frames"]) == len(sequence)
    assert values["rmse"] == pytest.approx(np.mean([frame["rmse"] for frame in values["frames"]]), rel=1e-12)
    assert values["max"] == max(frame["max"] for frame in values["frames"]) > 0
    distance = np.linalg.norm(sequence.read(0, 11).astype(float) - gvpipe.decode(video).read(0, 11), axis=2)
    assert values["max"] == pytest.approx(distance.max(), rel=1e-9)
    same = one_object(run("compare", video, video, "--json").out)
    assert [same[key] for key in sorted(COMPARE_KEYS - {"frames", "hausdorff"})] == [0] * 7
    lines = run("compare", npz, video).out.splitlines()
    listed = ("frames", "attributes", "fields", "metrics", "volume", "surface", "unpaired", "textures")
    assert [line.split()[0] for line in lines] == [key for key in values if key not in listed]


def test_info(run: Run, video: Path, sequence: MeshSequence) -> None:
    """The parts add up to the file, each is what the file really holds, and the text tells it; the box is the source's."""
    values = one_object(run("info", video, "--json").out)
    assert sum(values["sections"].values()) == values["bytes"] == video.stat().st_size
    with av.open(str(video)) as container:
        assert values["sections"]["video"] == sum(packet.size for packet in container.demux(video=0))
    held = gvpipe.open(video).bitstream.sections
    assert {name: values["sections"][name] for name in held} == {name: len(data) for name, data in held.items()}
    assert 0 < values["sections"]["container"] < 4000
    shape = (values["frames"], values["vertices"], values["triangles"], values["fps"], values["codec"], values["version"])
    assert shape == (11, 72, 128, 25.0, "mcgv", 1)
    box, first = values["bounding_box"], sequence[0]
    assert np.array_equal(np.array([box["min"], box["max"]], np.float32), [first.min(0), first.max(0)])
    text = run("info", video).out
    told = {line.split()[0]: int(line.split()[1]) for line in text.splitlines() if " bytes " in line}
    assert told == values["sections"]


@pytest.mark.parametrize("window", [(), ("--start", 3), ("--stop", 4), ("--start", 5, "--stop", 6), ("--start=4", "--stop=11")])
def test_decode_window(run: Run, video: Path, tmp_path: Path, window: tuple[object, ...]) -> None:
    """Files are numbered as the frames are, and hold exactly what the player gives."""
    given = dict(zip(*[iter(str(part) for word in window for part in str(word).split("="))] * 2, strict=True))
    start, stop = int(given.get("--start", 0)), int(given.get("--stop", 11))
    ended = run("decode", video, tmp_path / "out" / "f_%03d.obj", *window)
    assert ended.status == 0 and ended.err == ""
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == [f"f_{i:03d}.obj" for i in range(start, stop)]
    player = gvpipe.open(video)
    back = gvpipe.read(tmp_path / "out")
    assert np.array_equal(back.read(0, stop - start), player[start:stop]) and np.array_equal(back.faces, player.faces)
    assert run("decode", video, tmp_path / "out.npz", *window).status == 0
    with np.load(tmp_path / "out.npz") as archive:
        assert np.array_equal(archive["vertices"], player[start:stop]) and archive["fps"] == 25


@pytest.mark.parametrize(
    "window", [("--start", 11), ("--start", -1), ("--stop", 12), ("--start", 4, "--stop", 4), ("--stop", -2)]
)
def test_decode_window_outside(run: Run, video: Path, tmp_path: Path, window: tuple[object, ...]) -> None:
    assert_refused(run, tmp_path, ("decode", video, tmp_path / "x.npz", *window), (str(video), "11", str(window[-1])))


def test_reorder(run: Run, npz: Path, sequence: MeshSequence, tmp_path: Path) -> None:
    """By default order and winding come back exactly; with the option no byte is spent on order, the surface is the same."""
    for name, options in (("kept", ()), ("free", ("--reorder",))):
        assert run("encode", npz, tmp_path / f"{name}.mp4", *FAST, *options).status == 0
    kept, free = (gvpipe.open(tmp_path / f"{name}.mp4") for name in ("kept", "free"))
    turned = [np.roll(f, -int(f.argmin())).tolist() for f in sequence.faces]
    assert sorted(turned) == sorted(np.roll(f, -int(f.argmin())).tolist() for f in kept.faces)
    assert len(free.bitstream.sections["order"]) == 0 < len(kept.bitstream.sections["order"])
    reference = sequence.read(0, 1)[0].astype(float)
    assert np.abs(kept[0] - reference).max() < 0.1 * np.linalg.norm(reference[1] - reference[0])
    nearest = np.linalg.norm(free[0][:, None] - reference, axis=2).argmin(axis=1)
    assert sorted(nearest.tolist()) == list(range(72))
    mapped = nearest[free.faces]
    assert sorted(turned) == sorted(np.roll(f, -int(f.argmin())).tolist() for f in mapped)


def test_codecs(run: Run) -> None:
    """One line per codec: its id, and every setting with its default; below, indented, what competes beside the defaults."""
    printed = run("codecs").out.splitlines()
    lines = [line for line in printed if not line.startswith(" ")]
    assert printed[printed.index(next(line for line in lines if line.startswith("mcgv"))) + 1].endswith(": transform=klt")
    assert [line.split(":")[0] for line in lines] == codec_ids() and "mcgv" in codec_ids()
    for line, name in zip(lines, codec_ids(), strict=True):
        told = dict(word.split("=", 1) for word in line.split("; ")[-1].split())
        assert told == {field.name: str(field.default) for field in dataclasses.fields(codec_class(name))}


@pytest.mark.parametrize("arguments", ["", "--help", "--version", "encode --help", "compare -h"])
def test_light_start(arguments: str) -> None:
    """Importing gvpipe and asking for help load no heavy library."""
    start = f"sys.argv[1:] = {arguments.split()!r}; from gvpipe.cli import main; main()" if arguments else "import gvpipe"
    program = f"import sys\ntry:\n    {start}\nfinally:\n    print([m for m in {HEAVY!r} if m in sys.modules], file=sys.stderr)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stderr == "[]\n" and bool(done.stdout) == bool(arguments)


def test_python_m() -> None:
    """The real process: status and streams, for good, bad and wrong calls, and for a reader that leaves."""
    program = [sys.executable, "-m", "gvpipe"]
    done = [
        subprocess.run([*program, *args], capture_output=True, text=True) for args in (["codecs"], ["info", "no.mp4"], ["inf"])
    ]
    assert [d.returncode for d in done] == [0, 1, 2]
    assert [bool(d.stdout) for d in done] == [True, False, False] and [bool(d.stderr) for d in done] == [False, True, True]
    reading, writing = os.pipe()
    os.close(reading)
    left = subprocess.run([*program, "codecs"], stdout=writing, stderr=subprocess.PIPE, text=True)
    os.close(writing)
    assert left.returncode == 1 and left.stderr == ""


# wrong usage and settings


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["inf"],
        ["encode"],
        ["encode", "in.npz"],
        ["encode", "in.npz", "out.mp4", "more"],
        ["encode", "in.npz", "out.mp4", "--quality", "high"],
        ["encode", "in.npz", "out.mp4", "--set", "clusters"],
        ["encode", "in.npz", "out.mp4", "--set"],
        ["encode", "in.npz", "out.mp4", "--colour"],
        ["decode", "in.mp4", "out", "--stop", "1.5"],
        ["info", "--jsn", "in.mp4"],
        ["compare", "in.mp4"],
        ["render", "in.mp4", "out.png", "--error-max", "1"],
    ],
)
def test_usage(run: Run, arguments: list[str]) -> None:
    ended = run(*arguments)
    assert (
        ended.status == 2
        and ended.out == ""
        and ("Usage: " in ended.err or "--set" in ended.err)
        and "Traceback" not in ended.err
    )


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--quality", "101"], ["quality", "101", "0..100"]),
        (["--quality", "-1"], ["quality", "-1", "0..100"]),
        (["--quality", "nan"], ["quality", "nan", "0..100"]),
        (["--set", "colour=red"], ["colour", "clusters", "quality"]),
        (["--set", "image=foo"], ["image", "foo", "h264, jpeg"]),
        (["--set", "profile=precise", "--set", "image=jpeg"], ["precise", "h264"]),
        (["--set", "size=100x100"], ["size", "100x100", "16"]),
        (["--set", "size=16x"], ["size", "16x", "WIDTHxHEIGHT"]),
        (["--set", "prediction=affine", "--set", "size=16x16"], ["16x16", "larger"]),
        (["--set", "clusters=-1"], ["clusters", "-1", "0..1024"]),
        (["--set", "clusters=2.5"], ["clusters", "2.5", "integer"]),
        (["--set", "clusters=99999999999999999999"], ["clusters", "0..1024"]),
        (["--set", "gop="], ["gop", "integer"]),
        (["--set", "reorder=maybe"], ["reorder", "maybe", "true or false"]),
        (["--set", "density=inf"], ["density", "inf", "1..16"]),
        (["--set", "preset=warp"], ["preset", "warp", "ultrafast"]),
        (["--segment", "0"], ["segment", "0", "1..100000"]),
        (["--fps", "0"], ["fps", "0"]),
        (["--fps", "nan"], ["fps", "nan"]),
        (["--codec", "h266"], ["h266", "mcgv"]),
    ],
)
def test_bad_settings(run: Run, npz: Path, tmp_path: Path, options: list[str], words: list[str]) -> None:
    """Key, value and what is allowed are named; an older file of that name stays."""
    (tmp_path / "out.mp4").write_bytes(OLD)
    assert_refused(run, tmp_path, ("encode", npz, tmp_path / "out.mp4", *options), tuple(words))


# inputs that cannot be used


def bad_sources(folder: Path, sequence: MeshSequence) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Each wrong input, made under ``folder``, and what the message must name."""
    yield "missing.npz", ("missing.npz", "no such file")
    yield "missing", ("missing", "no such file")
    yield "missing/%04d.obj", ("no folder",)
    yield "missing/*.obj", ("no file matches",)
    (folder / "empty").mkdir()
    yield "empty", ("empty", ".obj")
    yield "empty/%04d.obj", ("0001.obj",)
    (folder / "notes").mkdir()
    (folder / "notes" / "readme.txt").write_text("hello")
    yield "notes", ("readme.txt", ".obj")
    yield "notes/readme.txt", ("readme.txt", ".obj")
    (folder / "text").mkdir()
    for i in range(3):
        (folder / "text" / f"{i}.obj").write_text("Dear diary,\ntoday I renamed a text file.\n")
    yield "text", ("0.obj", "OBJ")
    for name, change, words in (
        ("gap", lambda p: p[4].unlink(), ("004", "walk_003.obj", "walk_005.obj")),
        ("nan", lambda p: p[4].write_text(p[4].read_text().replace("v ", "v nan ", 3)), ("walk_004.obj",)),
        ("empty_frame", lambda p: p[4].write_text(""), ("walk_004.obj",)),
        ("cut_frame", lambda p: p[4].write_bytes(p[4].read_bytes()[:1500]), ("walk_004.obj",)),
        ("mixed", lambda p: p[4].rename(p[4].with_suffix(".ply")), (".obj", ".ply")),
        ("folder_frame", lambda p: (p[4].unlink(), p[4].mkdir()), ("004",)),
    ):
        change(write_frames(sequence, folder / name))
        yield name, words
    positions = sequence.read(0, 11).copy()
    for value in (np.nan, np.inf):
        positions[6, 17, 1] = value
        np.savez(folder / f"{value}.npz", vertices=positions, faces=sequence.faces)
        yield f"{value}.npz", (f"{value}.npz", "frame 6", "vertex 17")
    nan_frames = write_frames(sequence, folder / "nan_vertex")
    nan_frames[6].write_text(obj_text(positions[6], sequence.faces).replace("inf", "nan"))
    yield "nan_vertex", ("walk_006.obj", "frame 6", "vertex 17")
    (folder / "text.npz").write_text("not an archive")
    yield "text.npz", ("text.npz", "numpy.savez")
    np.savez(folder / "no_faces.npz", vertices=sequence.read(0, 1))
    yield "no_faces.npz", ("faces",)
    np.savez(folder / "index.npz", vertices=sequence.read(0, 1), faces=sequence.faces + 1)
    yield "index.npz", ("index.npz", "0..71")
    np.savez(folder / "none.npz", vertices=sequence.read(0, 0), faces=sequence.faces)
    yield "none.npz", ("none.npz", "(0, 72, 3)")
    (folder / "sheet.xlsx").write_bytes(b"PK")
    yield "sheet.xlsx", ("sheet.xlsx", ".obj")


def test_bad_inputs(run: Run, sequence: MeshSequence, tmp_path: Path) -> None:
    """A new user's mistakes: each one clear line, no output, no damage."""
    (tmp_path / "out.mp4").write_bytes(OLD)
    for name, words in bad_sources(tmp_path, sequence):
        assert_refused(run, tmp_path, ("encode", tmp_path / name, tmp_path / "out.mp4", *FAST), words)
        assert_refused(run, tmp_path, ("compare", tmp_path / name, tmp_path / name), words)


def test_one_file_is_one_frame(run: Run, sequence: MeshSequence, tmp_path: Path) -> None:
    """A single frame file is a sequence of one frame: it encodes, and comes back within the bound of its quality."""
    path = write_frames(sequence, tmp_path / "frames")[0]
    assert run("encode", path, tmp_path / "one.mp4").status == 0
    back = gvpipe.open(tmp_path / "one.mp4")
    assert back.shape == (1, 72, 3)
    assert np.abs(back[0] - sequence.read(0, 1)[0]).max() < 0.01  # 0.14 % of its spread, root mean square; extent 8


# outputs that cannot be written


def bad_targets(folder: Path) -> Iterator[tuple[str, tuple[str, ...]]]:
    yield "out", ("out", ".mp4")
    yield "out.avi", ("out.avi", ".mp4")
    yield "none/out.mp4", ("none", "create")
    (folder / "taken.mp4").mkdir()
    yield "taken.mp4", ("taken.mp4", "folder")
    (folder / "file").write_bytes(OLD)
    yield "file/out.mp4", ("file",)
    yield "n" * 300 + ".mp4", ("shorter",)


def test_bad_targets(run: Run, npz: Path, video: Path, tmp_path: Path) -> None:
    for name, words in bad_targets(tmp_path):
        assert_refused(run, tmp_path, ("encode", npz, tmp_path / name, *FAST), words)
    for name, words in (
        ("out", ("%04d",)),
        ("out.mp4", (".mp4", "%04d")),
        ("one.obj", ("11", "%04d")),
        ("none/out.npz", ("none", "create")),
        ("file/%04d.obj", ("file",)),
        ("a%d_%d.obj", ("%04d",)),
        ("n" * 300 + ".npz", ("shorter",)),
    ):
        assert_refused(run, tmp_path, ("decode", video, tmp_path / name), words)


def test_output_is_the_input(run: Run, video: Path, npz: Path, tmp_path: Path) -> None:
    """A video is never encoded onto itself, by whatever name: each time would lose more of it."""
    (tmp_path / "link.mp4").symlink_to(video)
    for source, target in ((video, video), (video, tmp_path / "link.mp4"), (tmp_path / "link.mp4", video)):
        assert_refused(run, tmp_path, ("encode", source, target, *FAST), (str(target), "another name"))
    assert_refused(run, tmp_path, ("encode", npz, npz), (".mp4",))
    assert run("encode", video, tmp_path / "again.mp4", *FAST).status == 0


@pytest.mark.skipif(os.name != "posix" or os.geteuid() == 0, reason="root may write anywhere")
def test_read_only_folder(run: Run, npz: Path, video: Path, tmp_path: Path) -> None:
    (tmp_path / "shut").mkdir()
    (tmp_path / "shut").chmod(0o555)
    assert_refused(run, tmp_path, ("encode", npz, tmp_path / "shut" / "o.mp4", *FAST), ("shut",))
    assert_refused(run, tmp_path, ("decode", video, tmp_path / "shut" / "o.npz"), ("shut",))


def test_full_disk_from_python(run: Run, npz: Path, video: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The disk reports that it is full at the last moment: nothing of the new file stays, the old one does."""

    def full(descriptor: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    words = ("No space left", "free some space")
    for name, old in (("new", None), ("old", OLD)):
        for suffix, call in ((".mp4", ("encode", npz)), (".npz", ("decode", video))):
            target = tmp_path / (name + suffix)
            if old:
                target.write_bytes(old)
            assert_refused(run, tmp_path, (*call, target), (str(target), *words))


LIMITED = """
import os, resource, sys
from gvpipe.container.bitstream import Bitstream
from gvpipe.container.mp4 import write_file
from gvpipe.foundation.errors import OutputError
from gvpipe.media.video import PROFILES, VideoWriter
import numpy as np
planes = np.random.default_rng(0).integers(0, 256, (12, 96, 96), dtype=np.uint8)
with VideoWriter(PROFILES["jpeg"], 96, 96, 25, 4) as writer:
    for plane in planes:
        writer.add(plane)
    video = writer.finish()
stream = Bitstream("mcgv", 1, 12, 1, 0, 25.0, {}, {"mesh": bytes(9000)}, video)
size = write_file(stream, "whole.mp4")
whole = open("whole.mp4", "rb").read()
assert size == len(whole) > 100_000
open("old.mp4", "wb").write(b"old")
told = set()
for limit in [*range(0, size, 1499), size - 1]:
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, resource.RLIM_INFINITY))
    for name in ("old.mp4", "new.mp4"):
        try:
            write_file(stream, name)
        except OutputError as exc:
            told.add(str(exc))
        else:
            raise SystemExit(f"limit {limit} of {size} went unnoticed")
resource.setrlimit(resource.RLIMIT_FSIZE, (size, resource.RLIM_INFINITY))
write_file(stream, "new.mp4")
assert open("new.mp4", "rb").read() == whole and open("old.mp4", "rb").read() == b"old"
assert sorted(os.listdir(".")) == ["new.mp4", "old.mp4", "whole.mp4"], os.listdir(".")
links = [f"/proc/self/fd/{n}" for n in os.listdir("/proc/self/fd")]
held = [os.readlink(link) for link in links if os.path.lexists(link)]
assert not [name for name in held if ".mp4" in name], held
assert all(text.startswith("cannot write ") and "\\n" not in text and "; " in text for text in told), told
print(len(told))
"""


@pytest.mark.skipif(not os.path.isdir("/proc/self/fd"), reason="needs file size limits and a list of open files")
def test_write_that_fails_anywhere(tmp_path: Path) -> None:
    """The system refuses to grow the file beyond any size below its own: also FFmpeg's own writes, its index moved to the
    front, the trailer, and the payload box; always an OutputError, never half a file, and none left open."""
    done = subprocess.run([sys.executable, "-c", LIMITED], cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (0, "2\n", "")


def test_full_disk_for_real(run: Run, npz: Path, video: Path, tmp_path: Path) -> None:
    """A tiny file system without a free page."""
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", str(disk)]
    try:
        mounted = subprocess.run(mount, capture_output=True).returncode == 0
    except OSError:
        mounted = False
    if not mounted:
        pytest.skip("mounting is not permitted here")
    try:
        (disk / "o.mp4").write_bytes(OLD)
        (disk / "o.npz").write_bytes(OLD)
        (disk / "fill").write_bytes(bytes(4096 * 14))  # of 16 pages; the older files have the other two
        words = ("No space left", "free some space")
        assert_refused(run, disk, ("encode", npz, disk / "o.mp4", *FAST), (str(disk / "o.mp4"), *words))
        assert_refused(run, disk, ("decode", video, disk / "o.npz"), (str(disk / "o.npz"), *words))
        (disk / "fill").unlink()
        assert run("encode", npz, disk / "o.mp4", *FAST).status == 0
    finally:
        subprocess.run(["umount", str(disk)], check=True)


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs /dev/full")
@pytest.mark.parametrize("command", [["info"], ["info", "--json"]])
def test_full_standard_output(video: Path, command: list[str]) -> None:
    """Results that cannot be printed are an error of one line too."""
    with open("/dev/full", "w") as full:
        program = [sys.executable, "-m", "gvpipe", *command, str(video)]
        done = subprocess.run(program, stdout=full, stderr=subprocess.PIPE, text=True)
    assert done.returncode == 1 and done.stderr.startswith("Error: ") and done.stderr.count("\n") == 1, done.stderr


# videos that cannot be read


def boxes(data: bytes) -> list[tuple[bytes, int, int]]:
    """Top-level boxes: kind, start, end."""
    found, position = [], 0
    while position < len(data):
        size, kind = struct.unpack_from(">I4s", data, position)
        found.append((kind, position, position + size))
        position += size
    return found


def refuse(path: Path, data: bytes, kinds: type[FormatError] | tuple[type[FormatError], ...] = FormatError) -> FormatError:
    path.write_bytes(data)
    with pytest.raises(kinds, match=r"^[^\n]+$") as caught:
        gvpipe.decode(path)
    assert str(caught.value).startswith(f"{path}: ")
    return caught.value


def test_truncated(run: Run, video: Path, tmp_path: Path) -> None:
    """Cut anywhere: in and at the ends of every box, at each byte of the first and last 64, and at every 41st byte."""
    data = video.read_bytes()
    found = boxes(data)
    assert [kind for kind, _, _ in found][-1] == b"uuid" and {b"ftyp", b"moov", b"mdat"} < {kind for kind, _, _ in found}
    edges = {start + d for _, start, _ in found for d in range(-9, 25)}
    cuts = {*range(64), *range(len(data) - 64, len(data)), *range(0, len(data), 41), *edges}
    cut_file = tmp_path / "cut.mp4"
    for cut in sorted(c for c in cuts if 0 <= c < len(data)):
        error = refuse(cut_file, data[:cut], (TruncatedFile, StrippedFile, CorruptFile))
        inside = any(start < cut < end for _, start, end in found)
        assert isinstance(error, TruncatedFile) or not inside, (cut, error)
    for _, start, end in found:
        for cut in (start, start + 5, (start + end) // 2, end - 1):
            cut_file.write_bytes(data[:cut])
            for arguments in (("info", cut_file), ("decode", cut_file, tmp_path / "o.npz"), ("compare", cut_file, video)):
                assert_refused(run, tmp_path, arguments, (str(cut_file),))


@pytest.mark.slow
def test_flipped_bytes(video: Path, tmp_path: Path, sequence: MeshSequence) -> None:
    """One damaged byte anywhere is noticed, or changes no vertex."""
    data = video.read_bytes()
    wanted = gvpipe.decode(video)
    noticed = total = 0
    for i in range(0, len(data), 11):
        for mask in (1, 0x80, 0xFF):
            damaged = bytearray(data)
            damaged[i] ^= mask
            (tmp_path / "bad.mp4").write_bytes(damaged)
            total += 1
            try:
                found = gvpipe.decode(tmp_path / "bad.mp4")
            except FormatError as exc:
                assert "\n" not in str(exc) and str(exc).startswith(str(tmp_path / "bad.mp4"))
                noticed += 1
            else:
                assert np.array_equal(found.positions[:], wanted.positions[:]) and np.array_equal(found.faces, wanted.faces), (
                    i,
                    mask,
                )
    assert noticed > total / 2


def test_bytes_after_the_end(video: Path, tmp_path: Path) -> None:
    data = video.read_bytes()
    for extra in (b"\0", b"\0" * 7, b"\0" * 8, b"\xff" * 8, b"more text after the end"):
        refuse(tmp_path / "long.mp4", data + extra)
    refuse(tmp_path / "twice.mp4", data + data[boxes(data)[-1][1] :], CorruptFile)


def remux(source: Path, target: Path, options: dict[str, str]) -> None:
    """Copy the video track into a new file, as FFmpeg's ``-c copy`` does: unknown boxes are lost."""
    with av.open(str(source)) as reading, av.open(str(target), "w", format="mp4", options=options) as writing:
        writing.metadata.update(reading.metadata)
        track = reading.streams.video[0]
        copy = writing.add_stream_from_template(track)
        for packet in reading.demux(track):
            if packet.size:
                packet.stream = copy
                writing.mux(packet)


def plain_mp4(path: Path) -> None:
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", Fraction(25))
        stream.width = stream.height = 32
        for _ in range(3):
            container.mux(stream.encode(av.VideoFrame.from_ndarray(np.zeros((32, 32, 3), np.uint8), format="rgb24")))
        container.mux(stream.encode(None))


def test_other_files(run: Run, video: Path, npz: Path, tmp_path: Path) -> None:
    """Files that are not geometry videos, or no longer: each is told apart."""
    plain_mp4(tmp_path / "plain.mp4")
    remux(video, tmp_path / "remuxed.mp4", {"movflags": "use_metadata_tags"})
    remux(video, tmp_path / "copied.mp4", {})
    jpeg = cv2.imencode(".jpg", np.zeros((64, 64), np.uint8))[1].tobytes()
    samples: dict[str, tuple[bytes, type[FormatError], str]] = {
        "jpeg.mp4": (jpeg, NotGeometryVideo, "not an MP4"),
        "text.mp4": (b"hello, this is a text file", NotGeometryVideo, "not an MP4"),
        "tube.npz": (npz.read_bytes(), NotGeometryVideo, "encode the sequence first: gvpipe encode INPUT OUTPUT.mp4"),
        "short.mp4": (b"hi, you!", NotGeometryVideo, "not an MP4"),
        "zeros.mp4": (bytes(5000), NotGeometryVideo, "not an MP4"),
        "empty.mp4": (b"", TruncatedFile, "empty"),
        "plain.mp4": ((tmp_path / "plain.mp4").read_bytes(), NotGeometryVideo, "not one that gvpipe wrote"),
        "remuxed.mp4": ((tmp_path / "remuxed.mp4").read_bytes(), StrippedFile, "stripped"),
        "copied.mp4": ((tmp_path / "copied.mp4").read_bytes(), StrippedFile, "stripped"),
        "cut_off.mp4": (video.read_bytes()[: boxes(video.read_bytes())[-1][1]], StrippedFile, "stripped"),
    }
    for name, (data, kind, words) in samples.items():
        assert words in str(refuse(tmp_path / name, data, kind))
    for name, (_, _, words) in samples.items():
        if name.endswith(".mp4"):
            assert_refused(run, tmp_path, ("info", tmp_path / name), (name, words))
        if name.endswith(".mp4"):
            assert_refused(run, tmp_path, ("encode", tmp_path / name, tmp_path / "o.mp4"), (name, words))
    for arguments in (("info", tmp_path), ("info", tmp_path / "none.mp4"), ("decode", tmp_path / "n" / "x.mp4", "o.npz")):
        assert_refused(run, tmp_path, arguments, (str(arguments[1]),))


def test_swapped_parts(video: Path, sequence: MeshSequence, tmp_path: Path) -> None:
    """The geometry of one file does not pass with the video of another."""
    gvpipe.encode(sequence, tmp_path / "other.mp4", quality=30, clusters=2, preset="ultrafast")
    one, other = video.read_bytes(), (tmp_path / "other.mp4").read_bytes()
    refuse(tmp_path / "mixed.mp4", one[: boxes(one)[-1][1]] + other[boxes(other)[-1][1] :], CorruptFile)


def test_opens_as_an_ordinary_video(video_bytes: bytes) -> None:
    """What ffprobe would tell: one H.264 High track, limited range, frames and rate as the sequence's."""
    with av.open(io.BytesIO(video_bytes), "r") as container:
        assert len(container.streams) == 1
        stream = container.streams.video[0]
        context = stream.codec_context
        assert (context.name, context.profile, context.pix_fmt) == ("h264", "High", "yuv420p")
        assert (stream.frames, stream.average_rate, int(context.color_range)) == (11, Fraction(25), 1)
        assert container.duration == 11 * 1_000_000 // 25
        assert sum(1 for _ in container.decode(video=0)) == 11


def test_restream_goes_both_ways(run: Run, video: Path, tmp_path: Path) -> None:
    stream, back = tmp_path / "stream.mp4", tmp_path / "back.mp4"
    ended = run("restream", video, stream)
    assert ended.status == 0 and "stream layout" in ended.out and ended.out.count("\n") == 1
    values = one_object(run("restream", stream, back, "--json").out)
    size, before = video.stat().st_size, stream.stat().st_size
    assert values == {"output": str(back), "layout": "plain", "bytes_before": before, "bytes": size, "notes": []}
    assert back.read_bytes() == video.read_bytes()
    assert one_object(run("info", stream, "--json").out)["layout"] == "stream"
    assert run("info", stream).out.splitlines()[0].endswith(", stream layout")
    assert run("restream", stream, tmp_path / "again.mp4", "--layout", "stream").status == 0
    assert (tmp_path / "again.mp4").read_bytes() == stream.read_bytes()
    assert_refused(run, tmp_path, ("restream", tmp_path / "no.mp4", back), ("no such file",))
    assert_refused(run, tmp_path, ("restream", video, tmp_path / "x.npz"), ("end its name in .mp4",))


def test_encode_stream_and_read_from_a_server(run: Run, npz: Path, tmp_path: Path) -> None:
    target = tmp_path / "stream.mp4"
    assert run("encode", npz, target, *FAST, "--stream").status == 0
    with serving(target.read_bytes()) as (url, served):
        assert one_object(run("info", url, "--json").out)["layout"] == "stream"
        assert run("decode", url, tmp_path / "a.npz").status == 0
        assert run("decode", target, tmp_path / "b.npz").status == 0
        a, b = gvpipe.read(tmp_path / "a.npz"), gvpipe.read(tmp_path / "b.npz")
        assert np.array_equal(a[:], b[:])
        served.status = 404
        assert_refused(run, tmp_path, ("info", url), (url, "404"))
    assert_refused(run, tmp_path, ("encode", npz, tmp_path / "x.mp4", "--stream", "--target-bpvf", "9"), ("restream",))
