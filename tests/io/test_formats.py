"""Sequences come back from files exactly as they went in, and what is wrong with a file is said in one line."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
import tempfile
import zipfile
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from mesh_files import FACES, FRAME_SUFFIXES, POSITIONS, fast, grid, same_bits

from gvpipe import io
from gvpipe.foundation.errors import InputError, OutputError
from gvpipe.io.formats import FRAME_FORMATS
from gvpipe.io.normals.turned import TurnedNormals
from gvpipe.model.sequence import MeshSequence

# frame files, both ways


@pytest.mark.parametrize("suffix", FRAME_SUFFIXES)
def test_frames_round_trip(tmp_path: Path, suffix: str) -> None:
    sequence = grid()
    io.write(sequence, tmp_path / "out" / f"w%03d.{suffix}", start=8)
    assert sorted(os.listdir(tmp_path / "out")) == [f"w{i:03d}.{suffix}" for i in range(8, 12)]
    read = io.read(tmp_path / "out", fps=24)
    assert read.fps == 24
    assert read.positions.shape == sequence.positions.shape
    assert same_bits(read.faces, sequence.faces)
    assert same_bits(read.read(2, 4), sequence.read(2, 4))  # out of order, then from the spool
    assert same_bits(read.read(0, 4), sequence.read(0, 4))
    assert read.attributes == {}


@fast
@given(POSITIONS)
def test_text_is_exact(tmp_path: Path, positions: Any) -> None:
    sequence = MeshSequence(positions, FACES)
    for suffix in ("obj", "off"):
        with tempfile.TemporaryDirectory(dir=tmp_path) as folder:
            io.write(sequence, f"{folder}/%d.{suffix}")
            read = io.read(folder)
            assert same_bits(read.read(0, len(positions)), positions)
            assert same_bits(read.faces, FACES)


UV_VERTEX = np.linspace(0, 1, 74, dtype=np.float32).reshape(37, 2)
COLORS = np.random.default_rng(1).integers(0, 256, (37, 4), np.uint8) | np.array([0, 0, 0, 255], np.uint8)


@pytest.mark.parametrize("suffix", ["obj", "ply", "off", "glb"])
@pytest.mark.parametrize("kept", [{"uv"}, {"color"}, {"uv", "color"}], ids=lambda kept: "+".join(sorted(kept)))
def test_vertex_attributes(tmp_path: Path, suffix: str, kept: set[str]) -> None:
    attributes = {name: values for name, values in (("uv", UV_VERTEX), ("color", COLORS)) if name in kept}
    sequence = grid(attributes=attributes)
    assert sequence.n_vertices == 37
    io.write(sequence, tmp_path / f"%d.{suffix}")
    read = io.read(tmp_path)
    assert same_bits(read.read(0, 4), sequence.read(0, 4))
    assert set(read.attributes) == kept
    used = np.unique(sequence.faces)
    for name, values in read.attributes.items():
        np.testing.assert_allclose(np.asarray(values)[used], attributes[name][used], atol=1e-7)


@pytest.mark.parametrize("suffix", ["obj", "ply"])
def test_corner_texture_coordinates(tmp_path: Path, suffix: str) -> None:
    uv = np.random.default_rng(2).random((150, 2), np.float32)
    io.write(grid(attributes={"uv": uv}), tmp_path / f"%d.{suffix}")
    read = io.read(tmp_path)
    assert read.n_vertices == 37
    assert same_bits(read.attributes["uv"], uv)


GARBAGE = [("ply", b"hello"), ("stl", b"hello"), ("off", b"hello"), ("glb", b"hello"), ("gltf", b"hello")]


@pytest.mark.parametrize(("suffix", "data"), GARBAGE)
def test_garbage(tmp_path: Path, suffix: str, data: bytes) -> None:
    (tmp_path / f"a.{suffix}").write_bytes(data)
    with pytest.raises(InputError) as error:
        io.read(tmp_path / f"a.{suffix}")
    assert f"a.{suffix} cannot be read as {suffix.upper()}: " in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("suffix", ["ply", "stl", "off", "glb"])
def test_every_truncation_is_refused(tmp_path: Path, suffix: str) -> None:
    io.write(grid(1, 2), tmp_path / f"a.{suffix}")
    whole = (tmp_path / f"a.{suffix}").read_bytes()
    for stop in range(0, len(whole) - 2, 13):  # a text without its last line end is whole
        (tmp_path / f"b.{suffix}").write_bytes(whole[:stop])
        with pytest.raises(InputError, match=f"b.{suffix} "):
            io.read(tmp_path / f"b.{suffix}")


# writing


def test_write_targets(tmp_path: Path) -> None:
    sequence = grid(2)
    io.write(sequence, f"{tmp_path}/new/")
    assert sorted(os.listdir(tmp_path / "new")) == ["0000.obj", "0001.obj"]
    io.write(sequence, tmp_path / "new", start=1)
    assert sorted(os.listdir(tmp_path / "new")) == ["0000.obj", "0001.obj", "0002.obj"]
    io.write(grid(1), tmp_path / "one.ply")
    assert io.read(tmp_path / "one.ply").n_frames == 1


BAD_TARGETS = {
    "bare": ("out", "cannot be written as a file without extension; give a folder that ends in '/'"),
    "unknown": ("out_%d.xyz", "cannot be written as .xyz"),
    "read only": ("out_%d.gltf", "cannot be written as .gltf"),
    "no pattern": ("out.obj", "would hold one frame of 2; give a pattern such as"),
    "two numbers": ("%d_%d.obj", "2 numbers in the pattern"),
}


@pytest.mark.parametrize(("target", "message"), BAD_TARGETS.values(), ids=BAD_TARGETS.keys())
def test_write_errors(tmp_path: Path, target: str, message: str) -> None:
    with pytest.raises(InputError) as error:
        io.write(grid(2), tmp_path / target)
    assert message in str(error.value)
    assert os.listdir(tmp_path) == []


def test_a_later_frame_that_fails_leaves_whole_files_only(tmp_path: Path) -> None:
    io.write(grid(3), tmp_path / "in" / "%d.obj")
    (tmp_path / "in" / "1.obj").write_text("v")
    read = io.read(tmp_path / "in")
    (tmp_path / "a.npz").write_bytes(b"old")
    with pytest.raises(InputError, match=r"1.obj cannot be read"):
        io.write(read, tmp_path / "a.npz")
    assert (tmp_path / "a.npz").read_bytes() == b"old"
    assert sorted(os.listdir(tmp_path)) == ["a.npz", "in"]


def test_output_errors(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(OutputError, match="No such file or directory; create its folder first"):
        io.write(grid(2), tmp_path / "no" / "a.npz")
    (tmp_path / "file").touch()
    with pytest.raises(OutputError, match="choose another folder"):
        io.write(grid(2), tmp_path / "file" / "%d.obj")

    def full(*args: Any, **options: Any) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(zipfile.ZipFile, "open", full)
    with pytest.raises(OutputError) as error:
        io.write(grid(2), tmp_path / "a.npz")
    assert str(error.value) == (
        f"cannot write {tmp_path / 'a.npz'}: No space left on device; free some space or choose another disk"
    )
    assert os.listdir(tmp_path) == ["file"]


def test_formats_load_only_when_needed() -> None:
    """A process that runs a library starts fast: other formats, SciPy and compiled loops stay out."""
    heavy = {"numba", "scipy", "trimesh", "gvpipe.io.gltf", "gvpipe.io.obj.reader", "urllib.request"}
    workers = ", ".join(f"gvpipe.io.{name}.worker" for name in ("alembic", "fbx", "usd"))
    code = f"import sys, {workers}; sys.exit(str({heavy} & set(sys.modules) or ''))"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False).stderr.strip() == ""


def test_processes_start_before_numpy_loads() -> None:
    processes = ", ".join(f"gvpipe.io.{name}.process" for name in ("alembic", "fbx", "usd"))
    code = f"import sys, gvpipe, gvpipe.io.reading, {processes}; gvpipe.read, gvpipe.write; sys.exit('numpy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_names_that_load_late_exist() -> None:
    frames = [each for entry in FRAME_FORMATS.values() for each in (entry.loader, entry.encoder)]
    late = [each for each in (*io.READERS.values(), *io.WRITERS.values(), *frames) if isinstance(each, partial)]
    assert len(late) > 30
    for each in late:
        module, name = each.args
        assert callable(getattr(import_module(module), name))


@pytest.mark.parametrize("suffix", ["obj", "ply", "off", "glb"])
def test_normals_of_an_artist_turn_with_the_surface(tmp_path: Path, suffix: str) -> None:
    normals = np.random.default_rng(3).normal(size=(37, 3)).astype(np.float32)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    given = grid(attributes={"normal": normals})
    notes = io.write(given, tmp_path / "moving" / f"%d.{suffix}")
    name = suffix.upper() if suffix != "glb" else "glTF"
    assert notes == (f"normals follow from no rule; in {name} those of later frames are turned with the surface",)
    read = io.read(tmp_path / "moving").fields["normal"]
    used = np.unique(given.faces)
    turned = TurnedNormals(given.attributes["normal"], given[0], given.faces)
    assert same_bits(read[0:1][0, used], normals[used])
    for frame in range(given.n_frames):
        np.testing.assert_allclose(read[frame : frame + 1][0, used], turned.of(given[frame])[used], atol=2e-6)
    assert io.write(grid(1, attributes={"normal": normals}), tmp_path / f"still.{suffix}") == ()
    assert same_bits(np.asarray(io.read(tmp_path / f"still.{suffix}").attributes["normal"])[used], normals[used])
