"""Mesh sequences in a store that fsspec knows: here its own in memory, and a folder seen as one by other processes."""

from __future__ import annotations

import gc
import io
import json
import multiprocessing
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import PIL.Image
import pytest
import trimesh
from click.testing import CliRunner
from sequences import waving

import gvpipe
from gvpipe.cli.commands import cli
from gvpipe.foundation.errors import InputError, OutputError, TopologyChange
from gvpipe.io.fetching import fetch

fsspec = pytest.importorskip("fsspec")
WAVES = waving(5, 12)


held: dict[str, gvpipe.MeshSequence] = {}


def frame(number: int) -> Any:
    """A frame of what is held, in a forked child."""
    return held["walk"][number]


@pytest.fixture
def store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    (tmp_path / "tmp").mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "tmp"))
    found = fsspec.filesystem("memory")
    yield found
    found.rm("/films", recursive=True)


def put(store: Any, folder: Path) -> None:
    for file in folder.rglob("*"):
        if file.is_file():
            store.pipe(f"/films/{file.relative_to(folder).as_posix()}", file.read_bytes())


@pytest.mark.parametrize("suffix", [".npz", ".glb", ".usdc", ".abc", ".pc2"])
def test_a_file(store: Any, tmp_path: Path, suffix: str) -> None:
    (tmp_path / "in").mkdir()
    gvpipe.write(WAVES, tmp_path / "in" / f"a{suffix}")
    gvpipe.write(WAVES.part(0, 1), tmp_path / "in" / "mesh.obj")
    put(store, tmp_path / "in")
    is_cache = suffix == ".pc2"
    found = gvpipe.read(f"memory://films/a{suffix}", mesh="memory://films/mesh.obj" if is_cache else None)
    own = gvpipe.read(tmp_path / "in" / f"a{suffix}", mesh=tmp_path / "in" / "mesh.obj" if is_cache else None)
    assert np.array_equal(found[:], own[:])
    assert found.name == f"memory://films/a{suffix}" and found.fps == own.fps


@pytest.mark.parametrize("name", ["*.obj", "f_%02d.obj", "f_##.obj", ""])
def test_frames_load_when_they_are_read(store: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    gvpipe.write(WAVES, tmp_path / "in" / "f_%02d.obj")
    put(store, tmp_path / "in")
    asked: list[str] = []
    get = type(store).get_file

    def counted(self: Any, one: str, local: str, **options: Any) -> None:
        asked.append(one)
        get(self, one, local, **options)

    monkeypatch.setattr(type(store), "get_file", counted)
    found = gvpipe.read(f"memory://films/{name}", frames=(2, 9))
    assert asked == ["/films/f_02.obj"]
    assert np.allclose(found[3:5], WAVES[5:7], atol=1e-6)
    assert asked == ["/films/f_02.obj", "/films/f_05.obj", "/films/f_06.obj"]
    _ = found[3:5], gvpipe.read("memory://films/f_03.obj")
    assert asked[3:] == ["/films/f_03.obj"]
    assert found.name == f"memory://films/{name}".rstrip("/")


def test_copies_go(store: Any, tmp_path: Path) -> None:
    gvpipe.write(WAVES, tmp_path / "in" / "f_%02d.ply")
    put(store, tmp_path / "in")
    found = gvpipe.read("memory://films/*.ply")
    kept = found.part(3, 7)
    del found
    gc.collect()
    (folder,) = (tmp_path / "tmp").glob("gvpipe-store-*")
    assert np.allclose(kept[:], WAVES[3:7], atol=1e-6)
    assert sum(file.stat().st_size for file in folder.iterdir()) == 0  # frames are kept as positions alone
    del kept
    gc.collect()
    assert not folder.exists()


def test_files_that_others_name(store: Any, tmp_path: Path) -> None:
    picture = io.BytesIO()
    PIL.Image.new("RGB", (2, 2), (255, 0, 0)).save(picture, "PNG")
    store.pipe("/films/walk/looks/red.png", picture.getvalue())
    store.pipe("/films/walk/walk.mtl", b"newmtl red\nmap_Kd looks/red.png\n")
    for number in range(3):
        text = f"mtllib walk.mtl\nusemtl red\nv 0 0 {number}\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n"
        store.pipe(f"/films/walk/f_{number}.obj", text.encode())
    found = gvpipe.read("memory://films/walk/f_*.obj")
    assert [image.data for image in found.images] == [picture.getvalue()]
    assert found[2][0, 2] == 2 and [material.name for material in found.materials] == ["red"]
    mesh = trimesh.Trimesh(WAVES[0], WAVES.faces, process=False)
    exported: Any = trimesh.exchange.gltf
    for name, data in exported.export_gltf(trimesh.Scene(mesh)).items():
        store.pipe(f"/films/scene/{name}", data)
    assert gvpipe.read("memory://films/scene/model.gltf").n_vertices == WAVES.n_vertices
    store.rm("/films/walk/looks/red.png")
    notes = "".join(gvpipe.read("memory://films/walk/f_0.obj").notes)
    assert "there is no 'looks/red.png' beside the mesh, in memory://films/walk" in notes


def test_fields_and_lists(store: Any, tmp_path: Path) -> None:
    speed = np.random.default_rng(1).random((12, WAVES.n_vertices)).astype(np.float32)
    sequence = gvpipe.MeshSequence(WAVES[:], WAVES.faces, WAVES.fps, fields={"speed": speed})
    (tmp_path / "in").mkdir()
    gvpipe.write(sequence, tmp_path / "in" / "a.pvd")
    put(store, tmp_path / "in")
    found = gvpipe.read("memory://films/a.pvd")
    assert np.allclose(found[:], WAVES[:], atol=1e-6)
    assert np.array_equal(found.fields["speed"][4:9], speed[4:9])
    store.pipe("/films/b.pvd", store.cat("/films/a.pvd").replace(b"0001.vtp", b"none.vtp"))
    with pytest.raises(InputError, match=r"^memory://films/.*none.vtp: no such file"):
        gvpipe.read("memory://films/b.pvd")[1]


def test_errors_name_addresses(store: Any, tmp_path: Path) -> None:
    gvpipe.write(WAVES, tmp_path / "in" / "f_%02d.obj")
    put(store, tmp_path / "in")
    store.pipe("/films/f_07.obj", b"v 0 0\n")
    found = gvpipe.read("memory://films/*.obj")
    with pytest.raises(InputError, match="^memory://films/f_07.obj"):
        found[7]
    store.pipe("/films/f_03.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    with pytest.raises(TopologyChange, match=r"f_03.obj has 3 vertices"):
        found[3]
    store.rm("/films/f_05.obj")
    with pytest.raises(InputError, match="^memory://films/f_05.obj: no such file"):
        found[5]
    with pytest.raises(InputError, match="^memory://films/f_%d_%d.obj"):
        gvpipe.read("memory://films/f_%d_%d.obj")
    with pytest.raises(InputError, match=r"frame 05 missing"):
        gvpipe.read("memory://films/*.obj")
    for name in ("none.npz", "none.usdc", "*.stl", "g_%04d.obj"):
        with pytest.raises(InputError, match=r"memory://films/.*; "):
            gvpipe.read(f"memory://films/{name}")
    store.pipe("/films/a.npz", b"PK nothing")
    with pytest.raises(InputError, match="^memory://films/a.npz"):
        gvpipe.read("memory://films/a.npz")


def test_odd_names(store: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What the disk cannot hold is left out, a folder is no texture, letters may differ, the temporary folder's may be odd."""
    triangle = b"mtllib W.mtl\nusemtl r\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
    picture = io.BytesIO()
    PIL.Image.new("RGB", (2, 2)).save(picture, "PNG")
    store.pipe("/films/w.mtl", b"newmtl r\nmap_Kd looks\nnewmtl s\nmap_Kd RED.png\n")
    store.pipe("/films/looks/a.png", b"x")
    store.pipe("/films/red.PNG", picture.getvalue())
    store.pipe("/films/" + "x" * 300, b"a")
    for number in range(3):
        store.pipe(f"/films/w_{number}.obj", triangle)
    found = gvpipe.read("memory://films/w_%d.obj")
    assert found.shape == (3, 3, 3) and [one.name for one in found.materials] == ["r"]
    assert "there is no 'looks' beside the mesh" in "".join(found.notes)
    store.pipe("/films/w_0.obj", triangle.replace(b"usemtl r", b"usemtl s"))
    assert [one.data for one in gvpipe.read("memory://films/w_%d.obj").images] == [picture.getvalue()]
    (tmp_path / "t[x]").mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "t[x]"))
    assert len(gvpipe.read("memory://films/w_*.obj")) == 3
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "none"))
    with pytest.raises(OutputError, match="none: No such file"):
        gvpipe.read("memory://films/w_*.obj")


def test_files_at_the_root(store: Any) -> None:
    store.pipe("/films/a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    for number in range(2):
        store.copy("/films/a.obj", f"/top_{number}.obj")
    try:
        for name, length in (("top_*.obj", 2), ("top_%d.obj", 2), ("top_1.obj", 1)):
            found = gvpipe.read(f"memory://{name}")
            assert (len(found), found.name) == (length, f"memory://{name}")
    finally:
        store.rm(["/top_0.obj", "/top_1.obj"])
    with pytest.raises(InputError, match="is an address; give"):
        gvpipe.read("zip://a.obj::memory://films/a.zip")


def test_rounding_is_told(store: Any) -> None:
    for number in range(3):
        far = 4_000_000.123 * number
        store.pipe(f"/films/f_{number}.obj", f"v {far} 0 0\nv {far + 1} 0 0\nv 0 1 0\nf 1 2 3\n".encode())
    found = gvpipe.read("memory://films/f_%d.obj")
    assert found.rounding < 1e-6
    _ = found[2]
    assert found.rounding > 0.05


@pytest.mark.skipif("fork" not in multiprocessing.get_all_start_methods(), reason="the system does not fork")
def test_forked_readers(store: Any, tmp_path: Path) -> None:
    gvpipe.write(WAVES, tmp_path / "in" / "f_%02d.obj")
    put(store, tmp_path / "in")
    held["walk"] = gvpipe.read("memory://films/*.obj")
    with multiprocessing.get_context("fork").Pool(3) as pool:
        frames = pool.map(frame, [*range(12)] * 4)
    del held["walk"]
    assert np.allclose(frames, np.tile(WAVES[:], (4, 1, 1)), atol=1e-6)


def test_names_that_leave_the_folder(store: Any, tmp_path: Path) -> None:
    gvpipe.write(WAVES, tmp_path / "in" / "f_%02d.obj")
    put(store, tmp_path / "in")
    store.store["/films/../../f_99.obj"] = store.store["/films/f_00.obj"]
    try:
        assert len(gvpipe.read("memory://films/*.obj")) == 12
    finally:
        del store.store["/films/../../f_99.obj"]
    assert [path.name for path in (tmp_path / "tmp").iterdir()] == []
    fetch(tmp_path / "tmp" / "nothing")


def test_commands(store: Any, tmp_path: Path) -> None:
    gvpipe.write(WAVES, tmp_path / "in" / "f_%02d.obj")
    put(store, tmp_path / "in")
    for source, target in (("memory://films/*.obj", "a.mp4"), (str(tmp_path / "in" / "*.obj"), "b.mp4")):
        result = CliRunner().invoke(cli, ["encode", source, str(tmp_path / target), "--codec", "pca", "--json"])
        assert result.exit_code == 0, result.output
        assert json.loads(result.stdout)["frames"] == 12
    assert (tmp_path / "a.mp4").read_bytes() == (tmp_path / "b.mp4").read_bytes()


def test_workers_read_the_store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FSSPEC_DIR_PATH", str(tmp_path / "in"))
    monkeypatch.setenv("FSSPEC_DIR_TARGET_PROTOCOL", "file")
    fsspec.config.set_conf_env(fsspec.config.conf)
    gvpipe.write(WAVES, tmp_path / "in" / "f_%02d.obj")
    try:
        gvpipe.encode(["dir://f_%02d.obj"], tmp_path / "a.mp4", "pca", segment=4, workers=2)
    finally:
        del fsspec.config.conf["dir"]
    gvpipe.encode(tmp_path / "in" / "f_%02d.obj", tmp_path / "b.mp4", "pca", segment=4)
    assert (tmp_path / "a.mp4").read_bytes() == (tmp_path / "b.mp4").read_bytes()
