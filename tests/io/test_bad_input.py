"""Bad input of every kind that is read: one line that names the file, and nothing is left behind."""

from __future__ import annotations

import os
import shutil
import struct
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fbx_files import FBX
from gltf_files import square_file
from input_files import EXTRAS, KINDS, MARK, NEED_MESH, PACKAGES, TEXTS, is_installed, read_all
from PIL import Image

from gvpipe import io
from gvpipe.foundation.errors import InputError

SUFFIXES = [
    pytest.param(name, marks=pytest.mark.skipif(not is_installed(name), reason="its package is missing")) for name in KINDS
]
PREFIXES = 8  # of a file, that are tried
OTHERS = [b"\x89PNG\r\n\x1a\n" + bytes(60), b'{"a": 1}', b"hello\n" * 30, b"PK\x03\x04" + bytes(90), bytes(400)]


@pytest.fixture(scope="session")
def originals(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A folder per kind, with a file ``a.KIND`` that is as it should be."""
    made = {}
    for suffix, make in KINDS.items():
        if is_installed(suffix):
            made[suffix] = tmp_path_factory.mktemp(suffix[1:])
            make(made[suffix])
    return made


@pytest.fixture
def copied(originals: dict[str, Path], tmp_path: Path) -> Any:
    """Return what copies the files of a kind into this test's folder, and gives the path of the main one."""

    def copy(suffix: str) -> Path:
        shutil.copytree(originals[suffix], tmp_path / "in")
        return tmp_path / "in" / f"a{suffix}"

    return copy


@contextmanager
def refused(path: Path, *words: str) -> Iterator[None]:
    """One line with the file's name and all words is raised."""
    with pytest.raises(InputError) as caught:
        yield
    message = str(caught.value)
    assert "\n" not in message and len(message) < 700 and path.stem in message, message
    assert [word for word in words if word not in message] == [], message


# each reading of these starts a process
MANY_TIMES = [
    pytest.param(*each.values, marks=[*each.marks, pytest.mark.slow] if each.values[0] in (".abc", ".fbx") else each.marks)
    for each in SUFFIXES
]


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_as_it_should_be(copied: Any, suffix: str) -> None:
    sequence = read_all(copied(suffix))
    assert sequence.n_vertices == 4 and np.isclose(sequence.read_absolute(0, 1).max(), MARK)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_empty_and_pipes(copied: Any, suffix: str) -> None:
    path = copied(suffix)
    path.write_bytes(b"")
    with refused(path, "is empty"):
        read_all(path)
    if hasattr(os, "mkfifo"):
        path.unlink()
        os.mkfifo(path)
        with refused(path, "no ordinary file"):
            read_all(path)


@pytest.mark.parametrize("suffix", MANY_TIMES)
def test_cut(copied: Any, suffix: str) -> None:
    path = copied(suffix)
    if suffix == ".obj":  # any whole lines are a mesh, so its last lines are left out
        path.write_text(path.read_text().split("f ")[0])
    whole = path.read_bytes()
    for part in range(1, PREFIXES):
        path.write_bytes(whole[: len(whole) * part // PREFIXES])
        with refused(path):
            read_all(path)


@pytest.mark.parametrize("suffix", MANY_TIMES)
def test_another_format_under_the_name(copied: Any, suffix: str) -> None:
    path = copied(suffix)
    for data in OTHERS:
        path.write_bytes(data)
        with refused(path):
            read_all(path)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_not_finite(copied: Any, suffix: str) -> None:
    path = copied(suffix)
    if suffix == ".npz":
        with np.load(path) as archive:
            held = dict(archive)
        held["vertices"] = np.where(held["vertices"] == MARK, np.nan, held["vertices"])
        np.savez(path, **held)
    else:
        assert sum(spoil(file) for file in path.parent.rglob("*") if file.is_file() and file.name != "base.obj")
    with refused(path if suffix not in (".series", ".pvd") else path.with_name("s0.vtu")):
        read_all(path)


def spoil(path: Path) -> bool:
    """Put a NaN in place of every marked coordinate; whether there was one."""
    data = path.read_bytes()
    for mark, nan in [(struct.pack(form, MARK), struct.pack(form, np.nan)) for form in ("<f", ">f", "<d", ">d")]:
        if mark in data and path.suffix not in TEXTS:
            path.write_bytes(data.replace(mark, nan))
            return True
    path.write_bytes(data.replace(str(MARK).encode(), b"nan"))
    return str(MARK).encode() in data


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_names_that_do_not_exist(copied: Any, suffix: str) -> None:
    path = copied(suffix)
    there = {".fbx": "'Lift'", ".gltf": "'Lift'", ".glb": "there are: "}
    with refused(path, "clip", there.get(suffix, "has no clips")):
        read_all(path, clip="Lfit")
    for span in ((90, 95), (0, 95)):
        with refused(path, "asked for", "is needed"):
            read_all(path, frames=span)


@pytest.mark.parametrize("suffix", [suffix for suffix in PACKAGES if suffix != ".fbx"])
def test_extra_that_is_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, suffix: str) -> None:
    monkeypatch.setitem(sys.modules, PACKAGES[suffix], None)
    (tmp_path / f"a{suffix}").write_bytes(b"something")
    with refused(tmp_path / f"a{suffix}", f"pip install 'gvpipe[{EXTRAS[PACKAGES[suffix]]}]'"):
        io.read(tmp_path / f"a{suffix}")


@pytest.mark.parametrize("suffix", NEED_MESH)
def test_caches_without_their_mesh(copied: Any, suffix: str) -> None:
    path = copied(suffix)
    with refused(path, "--mesh"):
        io.read(path)
    with refused(path, "gone.obj"):
        io.read(path, mesh=path.with_name("gone.obj"))


@pytest.mark.parametrize(
    ("suffix", "side"), [(".gltf", "a.bin"), (".series", "s0.vtu"), (".case", "a.geo"), (".pvd", "s0.vtu")]
)
def test_missing_side_files(copied: Any, suffix: str, side: str) -> None:
    path = copied(suffix)
    gone = path.with_name(side)
    gone.unlink()
    with refused(path, gone.name, "missing"):
        read_all(path)


OUTSIDE = ("../out.bin", "/etc/passwd", "deep/../../out.bin")
NAMED = {  # files that name another one, and what becomes of a name outside of their folder
    "a.gltf": '{{"asset": {{"version": "2.0"}}, "buffers": [{{"uri": "{0}", "byteLength": 4}}], "meshes": [{{"primitives": '
    '[{{"attributes": {{"POSITION": 0}}}}]}}], "nodes": [{{"mesh": 0}}], "accessors": [{{"bufferView": 0, "count": 3, '
    '"componentType": 5126, "type": "VEC3"}}], "bufferViews": [{{"buffer": 0, "byteLength": 4}}]}}',
    "a.pvd": '<VTKFile type="Collection"><Collection><DataSet timestep="0" file="{0}"/></Collection></VTKFile>',
    "a.series": '{{"files": [{{"name": "{0}", "time": 0}}]}}',
    "a.pvtu": '<VTKFile type="PUnstructuredGrid"><PUnstructuredGrid><Piece Source="{0}"/></PUnstructuredGrid></VTKFile>',
    "a.case": "FORMAT\ntype: ensight gold\nGEOMETRY\nmodel: {0}\n",
    "a.xdmf": '<Xdmf><Domain><Grid Name="a"><Topology TopologyType="Triangle"><DataItem Format="Binary" Dimensions="2 3">{0}'
    "</DataItem></Topology><Geometry><DataItem/></Geometry></Grid></Domain></Xdmf>",
    "b.xdmf": '<Xdmf><Domain><Grid Name="a"><Topology TopologyType="Triangle"><DataItem Format="HDF" Dimensions="2 3">{0}:/x'
    "</DataItem></Topology><Geometry><DataItem/></Geometry></Grid></Domain></Xdmf>",
}


@pytest.mark.parametrize("name", NAMED)
def test_paths_that_leave_the_folder(tmp_path: Path, name: str) -> None:
    (tmp_path / "in" / "deep").mkdir(parents=True)
    (tmp_path / "out.bin").write_bytes(bytes(400))
    path = tmp_path / "in" / name
    for outside in OUTSIDE:
        path.write_text(NAMED[name].format(outside))
        with refused(path, "folder"):
            read_all(path)
    (path.parent / "link.bin").symlink_to(tmp_path / "out.bin")
    path.write_text(NAMED[name].format("link.bin"))
    with refused(path, "folder"):
        read_all(path)


def test_pictures_outside_of_the_folder(tmp_path: Path) -> None:
    """OBJ goes without a picture or a .mtl file that lies elsewhere, with a note."""
    (tmp_path / "in").mkdir()
    Image.new("RGB", (4, 4)).save(tmp_path / "out.png")
    mesh, looks = tmp_path / "in" / "a.obj", tmp_path / "in" / "a.mtl"
    for library, picture in (
        ("a.mtl", "../out.png"),
        ("a.mtl", "/etc/passwd"),
        ("../a.mtl", "x.png"),
        ("/etc/passwd", "x.png"),
    ):
        mesh.write_text(f"mtllib {library}\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n")
        looks.write_text(f"newmtl a\nmap_Kd {picture}\n")
        read = read_all(mesh)
        assert not read.images and any("lies outside of the folder" in note for note in read.notes)


NO_MESH: dict[str, bytes] = {
    "a.obj": b"v 0 0 0\nv 1 0 0\nv 0 1 0\n",
    "a.off": b"OFF\n0 0 0\n",
    "a.stl": bytes(84),
    "a.usda": b"#usda 1.0\n",
    "a.gltf": b'{"asset": {"version": "2.0"}}',
    "a.fbx": FBX.replace('C: "OO",1,2', "").encode(),
    "a.pvd": b'<VTKFile type="Collection"><Collection/></VTKFile>',
    "a.series": b'{"files": []}',
    "a.xdmf": b"<Xdmf><Domain/></Xdmf>",
    "a.case": b"FORMAT\ntype: ensight gold\n",
    "a.vtk": b"# vtk DataFile Version 3.0\na\nASCII\nDATASET POLYDATA\nPOINTS 1 float\n0 0 0\n",
    "a.pc2": struct.pack("<12siiffi", b"POINTCACHE2\0", 1, 4, 0.0, 1.0, 0),
    "a.mdd": struct.pack(">ii", 0, 4),
}


@pytest.mark.parametrize("name", NO_MESH)
def test_no_mesh_and_no_frames(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    if not is_installed(path.suffix):
        pytest.skip("its package is missing")
    path.write_bytes(NO_MESH[name])
    with refused(path):
        read_all(path)


def test_nested_nodes(tmp_path: Path) -> None:
    """Twenty thousand nodes, one in the other, are read without recursion, and in about a second."""
    file = square_file()
    file.tree["nodes"] = [{"children": [k + 1]} for k in range(20_000)] + [{"mesh": 0}]
    started = time.process_time()
    assert read_all(file.write(tmp_path / "a.glb")).n_vertices == 4
    assert time.process_time() - started < 10


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_command_leaves_nothing(run: Any, copied: Any, tmp_path: Path, suffix: str) -> None:
    path = copied(suffix)
    path.write_bytes(OTHERS[1])
    before = sorted(tmp_path.rglob("*"))
    ended = run("convert", path, tmp_path / "out.npz", *(("--mesh", path.parent / "base.obj") if suffix in NEED_MESH else ()))
    assert ended.status == 1 and ended.err.startswith("Error: ") and ended.err.count("\n") == 1 and not ended.out
    assert sorted(tmp_path.rglob("*")) == before
