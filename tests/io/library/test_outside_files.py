"""Scenes show nothing from outside of their folder, whichever way they name it."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from PIL import Image

import gvpipe
from gvpipe.foundation.errors import InputError
from gvpipe.foundation.isolation.python import run_python
from gvpipe.io.library import process as library_process

pytest.importorskip("pxr")
MESH = """def Mesh "m" {{
 int[] faceVertexCounts = [3]
 int[] faceVertexIndices = [0, 1, 2]
 point3f[] points = [({x}, 0, 0), (1, 0, 0), (0, 1, 0)]
}}
"""
HEAD = '#usda 1.0\n(defaultPrim="r"\n startTimeCode=0\n endTimeCode=2\n timeCodesPerSecond=24\n)\n'
CLIP = (
    HEAD + 'def Xform "r" {\n def Mesh "m" {\n  point3f[] points.timeSamples = {0: [(7, 0, 0), (1, 0, 0), (0, 1, 0)]}\n }\n}\n'
)
BARE = 'def Mesh "m" {\n int[] faceVertexCounts = [3]\n int[] faceVertexIndices = [0, 1, 2]\n point3f[] points\n}\n'
INCLUDES = {
    "a carriage return": "*NODE\r1,0,0,0\r2,1,0,0\r3,0,1,0\r*ELEMENT, TYPE=S3\r1,1,2,3\r*INCLUDE, INPUT={}",
    "stars inside": "*NODE\n1,0,0,0\n2,1,0,0\n3,0,1,0\n*ELEMENT, TYPE=S3\n1,1,2,3\n*INC*LUDE, INPUT={}\n",
    "no star": "*NODE\n1,0,0,0\n2,1,0,0\n3,0,1,0\n*ELEMENT, TYPE=S3\n1,1,2,3\n*FOO\ninclude, INPUT={}\n",
}


def clips(template: str) -> str:
    """A scene whose positions are a value clip."""
    if "#" in template:
        entries = (
            f'string templateAssetPath = "{template}"\n double templateStartTime = 0\n double templateEndTime = 0\n'
            ' double templateStride = 1\n string primPath = "/r"'
        )
    else:
        entries = f'asset[] assetPaths = [@{template}@]\n string primPath = "/r"\n double2[] active = [(0, 0)]\n'
        entries += " double2[] times = [(0, 0)]"
    return f'{HEAD}def Xform "r" (clips = {{dictionary default = {{{entries}\n}}}}) {{\n {BARE}}}\n'


@pytest.fixture
def inside(tmp_path: Path) -> Path:
    """A folder of a scene, with another beside it."""
    for name in ("in", "out"):
        (tmp_path / name).mkdir()
    return tmp_path / "in"


@pytest.mark.parametrize("named", ["../out/clip.usda", "../out/clip.#.usda"])
def test_value_clips_outside(named: str, inside: Path) -> None:
    for clip in (inside.parent / "out" / "clip.usda", inside.parent / "out" / "clip.0.usda"):
        clip.write_text(CLIP)
    (inside / "scene.usda").write_text(clips(named))
    with pytest.raises(InputError, match=r"outside of its folder: .*/out/clip"):
        gvpipe.read(inside / "scene.usda")


def test_value_clips_inside(inside: Path) -> None:
    (inside / "clip.usda").write_text(CLIP)
    (inside / "scene.usda").write_text(clips("./clip.usda"))
    assert gvpipe.read(inside / "scene.usda").read(0, 1)[0, 0, 0] == 7


def test_brackets_in_names_of_folders(tmp_path: Path) -> None:
    folder, sibling = tmp_path / "sc", tmp_path / "sc[x]"
    folder.mkdir()
    sibling.mkdir()
    (sibling / "s.usda").write_text(f'{HEAD}def Xform "r" {{\n{MESH.format(x=7)}}}\n')
    (folder / "a.usda").write_text(f'{HEAD}def Xform "r" (prepend references = @../sc[x]/s.usda@) {{\n}}\n')
    with pytest.raises(InputError, match="outside of its folder"):
        gvpipe.read(folder / "a.usda")
    assert gvpipe.read(sibling / "s.usda").read(0, 1)[0, 0, 0] == 7


def test_a_texture_below_a_folder_with_brackets(tmp_path: Path) -> None:
    folder = tmp_path / "scene[v2]"
    folder.mkdir()
    Image.new("RGB", (4, 4)).save(folder / "ok.png")
    material = (
        'def Material "mat" {\n token outputs:surface.connect = </r/mat/s.outputs:surface>\n def Shader "s" {\n'
        '  uniform token info:id = "UsdPreviewSurface"\n  color3f inputs:diffuseColor.connect = </r/mat/t.outputs:rgb>\n'
        '  token outputs:surface\n }\n def Shader "t" {\n  uniform token info:id = "UsdUVTexture"\n'
        "  asset inputs:file = @./ok.png@\n  float3 outputs:rgb\n }\n}\n"
    )
    mesh = MESH.format(x=0).replace(
        ' "m" {', ' "m" (prepend apiSchemas=["MaterialBindingAPI"]) {\n rel material:binding = </r/mat>'
    )
    (folder / "a.usda").write_text(f'{HEAD}def Xform "r" {{\n{mesh}{material}}}\n')
    found = gvpipe.read(folder / "a.usda")
    assert [image.name for image in found.images] == ["ok.png"] and not any("texture" in note for note in found.notes)


def test_a_layer_by_a_link_outside(inside: Path) -> None:
    (inside.parent / "out" / "s.usda").write_text(f'{HEAD}def Xform "r" {{\n{MESH.format(x=7)}}}\n')
    (inside / "s.usda").symlink_to(inside.parent / "out" / "s.usda")
    (inside / "a.usda").write_text(f'{HEAD}def Xform "r" (prepend references = @./s.usda@) {{\n}}\n')
    with pytest.raises(InputError, match="outside of its folder"):
        gvpipe.read(inside / "a.usda")


@pytest.mark.parametrize("text", INCLUDES.values(), ids=INCLUDES)
def test_includes_of_abaqus(text: str, inside: Path) -> None:
    pytest.importorskip("meshio")
    (inside.parent / "out" / "secret.inp").write_text("*NODE\n1,7,7,7\n")
    (inside / "a.inp").write_text(text.format("../out/secret.inp"), newline="")
    with pytest.raises(InputError, match="includes other files, which are not followed"):
        gvpipe.read(inside / "a.inp")


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="Landlock is Linux's")
def test_openusd_cannot_open_what_lies_outside(inside: Path) -> None:
    """Without any check of names, in the process that runs OpenUSD."""
    if run_python(
        ["-c", "from gvpipe.foundation.isolation.confinement import confine; raise SystemExit(not confine([]))"]
    ).status:
        pytest.skip("this kernel has no Landlock")
    (inside.parent / "out" / "clip.usda").write_text(CLIP)
    (inside / "scene.usda").write_text(clips("../out/clip.usda"))
    code = """
import sys
from pathlib import Path
from gvpipe.io.usd import reader, worker
from gvpipe.io.options import ReadOptions
reader.check_inside = lambda stage, path: None
try:
    print(worker.read_limited(Path(sys.argv[1]), ReadOptions())[0].read(0, 1)[0, 0, 0])
except Exception as exc:
    print(exc)
"""
    said = run_python(["-c", code, str(inside / "scene.usda")]).out.decode()
    assert "7" not in said.replace(str(inside), "") and said.strip()


def test_files_of_several_folders(inside: Path) -> None:
    """Each folder has a process of its own, as a process sees one alone."""
    pytest.importorskip("meshio")
    assert library_process.MOST_RUNNING > 1
    paths = [inside / "1.inp", inside.parent / "out" / "2.inp", inside / "3.inp"]
    for x, path in enumerate(paths):
        path.write_text(f"*NODE\n1,{x},0,0\n2,1,0,0\n3,0,1,0\n*ELEMENT, TYPE=S3\n1,1,2,3\n")
    assert gvpipe.read(paths).read(0, 3)[:, 0, 0].tolist() == [0, 1, 2]
