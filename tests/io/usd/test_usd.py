"""USD: scenes come back as they were; skinning, transforms, time codes and subsets by hand-made stages; bad files refused."""

from __future__ import annotations

import struct
import subprocess
import sys
import zipfile
from dataclasses import replace
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from PIL import Image as Pillow
from scenes import FACES, assert_same, scene

from gvpipe import io
from gvpipe.asset.metadata import Metadata
from gvpipe.foundation.errors import InputError, OutputError
from gvpipe.io.library import process as library_process
from gvpipe.model.sequence import MeshSequence

pytest.importorskip("pxr")

HEAD = '#usda 1.0\n(\nupAxis = "Z"\nmetersPerUnit = 0.01\nstartTimeCode = 1\nendTimeCode = 3\ntimeCodesPerSecond = 24\n)\n'
TRIANGLE = """
int[] faceVertexCounts = [3]
int[] faceVertexIndices = [0, 1, 2]
point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
uniform token subdivisionScheme = "none"
"""
MOVING = TRIANGLE.replace(
    "point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]",
    "point3f[] points.timeSamples = { 1: [(0, 0, 0), (1, 0, 0), (0, 1, 0)], 3: [(0, 0, 4), (1, 0, 4), (0, 1, 4)] }",
)


def stage(folder: Path, body: str) -> Path:
    (folder / "a.usda").write_text(HEAD + body)
    return folder / "a.usda"


@pytest.mark.parametrize("suffix", [".usda", ".usdc", ".usd", ".usdz"])
def test_everything_comes_back(tmp_path: Path, suffix: str) -> None:
    given = scene()
    io.write(given, tmp_path / f"a{suffix}")
    read = io.read(tmp_path / f"a{suffix}")
    assert_same(read, given)
    assert read.materials == tuple(replace(m, base_color_texture=t) for m, t in zip(
        given.materials, (m.base_color_texture for m in read.materials), strict=True))  # fmt: skip
    found, texture = read.materials[1].base_color_texture, given.materials[1].base_color_texture
    assert found is not None
    assert texture is not None
    assert (found.uv, found.wrap, found.image) == (texture.uv, texture.wrap, texture.image)
    numbers = [(*each.offset, each.rotation, *each.tiling) for each in (found, texture)]
    assert numbers[0] == pytest.approx(numbers[1], abs=1e-5)
    assert [image.data for image in read.images] == [image.data for image in given.images]
    assert (read.metadata.up_axis, read.metadata.metres_per_unit) == ("z", 0.01)


def test_a_repeated_frame_is_not_interpolated_away(tmp_path: Path) -> None:
    given = scene()
    io.write(given, tmp_path / "a.usda")
    from pxr import Usd

    stage = Usd.Stage.Open(str(tmp_path / "a.usda"))
    points = stage.GetPrimAtPath("/world/piece").GetAttribute("points")
    assert len(points.GetTimeSamples()) == 1
    assert np.array_equal(io.read(tmp_path / "a.usda")[2], given[2])


def test_package_is_not_compressed_and_begins_with_the_stage(tmp_path: Path) -> None:
    io.write(scene(), tmp_path / "a.usdz")
    with zipfile.ZipFile(tmp_path / "a.usdz") as archive:
        assert archive.namelist() == ["a.usdc", "textures/check.png"]
        assert {item.compress_type for item in archive.infolist()} == {zipfile.ZIP_STORED}


def test_points_are_sampled_at_each_time_code(tmp_path: Path) -> None:
    read = io.read(stage(tmp_path, f'def Mesh "m" {{ {MOVING} }}'))
    assert read.shape == (3, 3, 3)
    assert read.fps == 24
    assert read[:][:, 0, 2].tolist() == [0, 2, 4]
    assert read.metadata.start_time == 1 / 24
    assert (read.parts[0].name, read.parts[0].parent) == ("m", "")


@pytest.mark.parametrize(("start", "code"), [(0.04166661947965622, "1"), (0.5, "12"), (0.51, "12.24")])
def test_first_time_code(tmp_path: Path, start: float, code: str) -> None:
    """A start that float32 rounded is a whole time code again."""
    io.write(replace(scene(), metadata=Metadata(start_time=start)), tmp_path / "a.usda")
    assert f"startTimeCode = {code}\n" in (tmp_path / "a.usda").read_text()


def test_other_rate(tmp_path: Path) -> None:
    path = stage(tmp_path, f'def Mesh "m" {{ {MOVING} }}')
    read = io.read(path, fps=48)
    assert read.fps == 48
    assert read[:][:, 0, 2].tolist() == [0, 1, 2, 3, 4]


def test_frames_per_second_beside_time_codes(tmp_path: Path) -> None:
    body = MOVING.replace("1: [", "0: [").replace("3: [", "1000: [")
    path = tmp_path / "a.usda"
    head = "startTimeCode = 0\nendTimeCode = 1000\ntimeCodesPerSecond = 1000\nframesPerSecond = 25\n"
    path.write_text(f'#usda 1.0\n(\n{head})\ndef Mesh "m" {{ {body} }}')
    read = io.read(path)
    assert (read.fps, len(read)) == (25, 26)


def test_samples_between_time_codes_are_said(tmp_path: Path) -> None:
    body = MOVING.replace("3: [", "1.5: [(9, 9, 9), (1, 0, 4), (0, 1, 4)], 3: [")
    read = io.read(stage(tmp_path, f'def Mesh "m" {{ {body} }}'))
    assert any("1 of 3 samples lie between the frames" in note for note in read.notes)


def test_transforms_and_instances(tmp_path: Path) -> None:
    body = f"""
    class Xform "proto"
    {{
        def Mesh "m" {{ {TRIANGLE} }}
    }}
    def Xform "a" (instanceable = true; inherits = </proto>)
    {{
        double3 xformOp:translate.timeSamples = {{ 1: (0, 0, 0), 3: (0, 0, 8) }}
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }}
    def Xform "b" (instanceable = true; inherits = </proto>)
    {{
        double3 xformOp:scale = (-2, 2, 2)
        uniform token[] xformOpOrder = ["xformOp:scale"]
    }}
    """
    read = io.read(stage(tmp_path, body))
    assert [(part.parent, part.vertices) for part in read.parts] == [("a", (0, 3)), ("b", (3, 6))]
    assert read[:][:, 0, 2].tolist() == [0, 4, 8]
    assert read[2][4].tolist() == [-2, 0, 0]
    assert read.faces.tolist() == [[0, 1, 2], [3, 5, 4]]  # a mirror turns the winding round


def test_left_handed_polygons_are_turned_round(tmp_path: Path) -> None:
    quad = """
    uniform token orientation = "leftHanded"
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(0, 0, 0), (0, 1, 0), (1, 1, 0), (1, 0, 0)]
    texCoord2f[] primvars:st = [(0, 0), (0, 1), (1, 1), (1, 0)] ( interpolation = "faceVarying" )
    """
    read = io.read(stage(tmp_path, f'def Mesh "m" {{ {quad} }}'))
    assert read.faces.tolist() == [[0, 3, 2], [0, 2, 1]]
    corners = read[0][read.faces.reshape(-1)]
    assert np.array_equal(np.asarray(read.attributes["uv"]), corners[:, :2])


def test_skinning_with_blend_shapes(tmp_path: Path) -> None:
    body = f"""
    def SkelRoot "root" {{
        def Skeleton "skel" (prepend apiSchemas = ["SkelBindingAPI"]) {{
            uniform token[] joints = ["j"]
            uniform matrix4d[] bindTransforms = [((1,0,0,0), (0,1,0,0), (0,0,1,0), (0,0,0,1))]
            uniform matrix4d[] restTransforms = [((1,0,0,0), (0,1,0,0), (0,0,1,0), (0,0,0,1))]
            rel skel:animationSource = </root/skel/anim>
            def SkelAnimation "anim" {{
                uniform token[] joints = ["j"]
                uniform token[] blendShapes = ["up"]
                float[] blendShapeWeights.timeSamples = {{ 1: [0], 3: [1] }}
                float3[] translations.timeSamples = {{ 1: [(0, 0, 0)], 3: [(10, 0, 0)] }}
                quatf[] rotations = [(1, 0, 0, 0)]
                half3[] scales = [(1, 1, 1)]
            }}
        }}
        def Mesh "m" (prepend apiSchemas = ["SkelBindingAPI"]) {{ {TRIANGLE}
            normal3f[] normals = [(0, 0, 1), (0, 0, 1), (0, 0, 1)]
            rel skel:skeleton = </root/skel>
            int[] primvars:skel:jointIndices = [0, 0, 0] ( elementSize = 1; interpolation = "vertex" )
            float[] primvars:skel:jointWeights = [1, 1, 1] ( elementSize = 1; interpolation = "vertex" )
            uniform token[] skel:blendShapes = ["up"]
            rel skel:blendShapeTargets = </root/m/up>
            def BlendShape "up"
            {{
                uniform vector3f[] offsets = [(0, 0, 6)]
                uniform int[] pointIndices = [2]
            }}
        }}
    }}
    """
    read = io.read(stage(tmp_path, body))
    assert read[1].tolist() == [[5, 0, 0], [6, 0, 0], [5, 1, 3]]
    assert np.asarray(read.attributes["normal"]).tolist() == [[0, 0, 1]] * 3


def test_subsets_become_parts_of_one_name(tmp_path: Path) -> None:
    body = """
    def Mesh "m" (prepend apiSchemas = ["MaterialBindingAPI"]) {
        int[] faceVertexCounts = [3, 3, 3]
        int[] faceVertexIndices = [0, 1, 2, 0, 2, 1, 1, 2, 0]
        point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
        float[] primvars:heat = [1, 2, 3] ( interpolation = "uniform" )
        rel material:binding = </red>
        def GeomSubset "s" (prepend apiSchemas = ["MaterialBindingAPI"]) {
            uniform token elementType = "face"
            uniform token familyName = "materialBind"
            int[] indices = [1]
            rel material:binding = </blue>
        }
    }
    def Material "red" {
        token outputs:surface.connect = </red/s.outputs:surface>
        def Shader "s" {
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor = (1, 0, 0)
            float inputs:roughness = 0.25
            token outputs:surface
        }
    }
    def Material "blue" {}
    """
    read = io.read(stage(tmp_path, body))
    assert [(part.name, part.triangles, part.vertices) for part in read.parts] == [("m", (0, 2), (0, 3)), ("m", (2, 3), (0, 3))]
    assert np.asarray(read.attributes["heat"])[:, 0].tolist() == [1, 3, 2]
    first, second = (read.materials[part.material] for part in read.parts if part.material is not None)
    assert (first.name, first.base_color, first.roughness, second.name) == ("red", (1, 0, 0, 1), 0.25, "blue")
    assert any("materials without a UsdPreviewSurface have their names alone: blue" in note for note in read.notes)


def test_meshes_that_are_not_shown_are_left_out(tmp_path: Path) -> None:
    body = f"""
    def Mesh "seen" {{ {TRIANGLE} }}
    def Xform "off"
    {{
        token visibility = "invisible"
        def Mesh "m" {{ {TRIANGLE} }}
    }}
    def Sphere "ball" {{}}
    def Mesh "helper" {{ {TRIANGLE} uniform token purpose = "guide"
    }}
    """
    read = io.read(stage(tmp_path, body))
    assert [part.name for part in read.parts] == ["seen"]
    assert read.not_carried == ("Sphere prims",)
    assert any("not carried: Sphere prims" in note for note in read.notes)
    assert any("2 of 3 meshes are invisible, guides or proxies" in note for note in read.notes)


def test_layers_of_some_meshes_get_a_stand_in(tmp_path: Path) -> None:
    body = f"""
    def Mesh "a" {{ {TRIANGLE}
        int[] primvars:group = [7] ( interpolation = "uniform" )
        texCoord2f[] primvars:st = [(1, 1), (1, 0), (0, 1)] ( interpolation = "vertex" )
        normal3f[] normals = [(0, 0, 1), (0, 0, 1), (0, 0, 1)]
        color3f[] primvars:displayColor = [(0.5, 0, 0)]
    }}
    def Mesh "b" {{ {TRIANGLE} }}
    """
    read = io.read(stage(tmp_path, body))
    rows = {name: np.asarray(each).tolist() for name, each in read.attributes.items()}
    assert rows["group"] == [[7], [0]]
    assert rows["uv"][3:] == [[0, 0]] * 3
    assert rows["normal"] == [[0, 0, 1]] * 6
    assert rows["color"] == [[0.5, 0, 0]] * 3 + [[1, 1, 1]] * 3


def test_value_clips(tmp_path: Path) -> None:
    (tmp_path / "manifest.usda").write_text('#usda 1.0\nover "m" {\n point3f[] points\n}')
    for number, height in ((1, 0), (2, 5), (3, 7)):
        points = f"{{ {number}: [(0, 0, {height}), (1, 0, {height}), (0, 1, {height})] }}"
        (tmp_path / f"clip{number}.usda").write_text(f'#usda 1.0\nover "m" {{\n point3f[] points.timeSamples = {points}\n}}')
    clips = """
    clips = { dictionary default = {
        asset manifestAssetPath = @./manifest.usda@
        asset[] assetPaths = [@./clip1.usda@, @./clip2.usda@, @./clip3.usda@]
        string primPath = "/m"
        double2[] active = [(1, 0), (2, 1), (3, 2)]
        double2[] times = [(1, 1), (2, 2), (3, 3)]
    } }
    """
    mesh = TRIANGLE.replace("point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]", "")
    read = io.read(stage(tmp_path, f'def Mesh "m" ({clips}) {{ {mesh} }}'))
    assert read[:][:, 0, 2].tolist() == [0, 5, 7]


def test_textures_stay_inside_of_the_folder(tmp_path: Path) -> None:
    inside = tmp_path / "scene"
    inside.mkdir()
    io.write(scene(), inside / "a.usda")
    (inside / "a_textures" / "check.png").rename(tmp_path / "check.png")
    missing = io.read(inside / "a.usda")
    assert not missing.images
    assert any("check.png is missing; it was left out" in note for note in missing.notes)
    text = (inside / "a.usda").read_text().replace("./a_textures/check.png", "../check.png")
    (inside / "a.usda").write_text(text)
    outside = io.read(inside / "a.usda")
    assert not outside.images
    assert any("../check.png lies outside of the file's folder; it was left out" in note for note in outside.notes)


TEXTURED = """
def Mesh "m" (prepend apiSchemas = ["MaterialBindingAPI"]) { %s
    texCoord2f[] primvars:map1 = [(0, 0), (1, 0), (0, 1)] ( interpolation = "vertex" )
    rel material:binding = </look>
}
def Material "look" {
    token outputs:surface.connect = </look/s.outputs:surface>
    def Shader "s" {
        uniform token info:id = "UsdPreviewSurface"
        float inputs:metallic.connect = </look/metal.outputs:r>
        float inputs:roughness.connect = </look/rough.outputs:g>
        float inputs:opacity.connect = </look/metal.outputs:r>
        int inputs:useSpecularWorkflow = 1
        token outputs:surface
    }
    def Shader "metal" {
        uniform token info:id = "UsdUVTexture"
        asset inputs:file = @./metal.png@
        float2 inputs:st.connect = </look/uv.outputs:result>
        float outputs:r
    }
    def Shader "rough" {
        uniform token info:id = "UsdUVTexture"
        asset inputs:file = @./rough.png@
        float4 inputs:scale = (1, 0.5, 1, 1)
        float2 inputs:st.connect = </look/uv.outputs:result>
        token inputs:wrapS = "mirror"
        float outputs:g
    }
    def Shader "uv" {
        uniform token info:id = "UsdPrimvarReader_float2"
        string inputs:varname = "map1"
        float2 outputs:result
    }
}
"""


def test_metallic_and_roughness_of_two_files_become_one(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    metal, rough = (rng.integers(0, 256, (4, 6, 3)).astype(np.uint8) for _ in range(2))
    Pillow.fromarray(metal).save(tmp_path / "metal.png")
    Pillow.fromarray(rough).save(tmp_path / "rough.png")
    read = io.read(stage(tmp_path, TEXTURED % TRIANGLE))
    (material,) = read.materials
    both = material.metallic_roughness_texture
    assert both is not None
    assert len(read.images) == 1
    pixels = np.asarray(Pillow.open(BytesIO(read.images[both.image].data)))
    assert np.array_equal(pixels[..., 1], rough[..., 1])
    assert np.array_equal(pixels[..., 2], metal[..., 0])
    assert (material.metallic, material.roughness, both.uv, both.wrap) == (1, 0.5, "uv", ("mirror", "repeat"))
    assert any("the texture of opacity is not the alpha of its colour" in note for note in read.notes)
    assert "specular colour of a material" in read.not_carried


CHANGING = TRIANGLE.replace(
    "int[] faceVertexIndices = [0, 1, 2]", "int[] faceVertexIndices.timeSamples = {1: [0, 1, 2], 2: [0, 2, 1]}"
)
FEWER = MOVING.replace("(0, 1, 4)] }", "(0, 1, 4), (0, 0, 0)] }")
BAD = {
    "no mesh": ('def Xform "a" {}', "has no polygon mesh"),
    "topology changes": (f'def Mesh "m" {{ {CHANGING} }}', "the topology of mesh /m changes at frame 1 (time code 2)"),
    "index": (f'def Mesh "m" {{ {TRIANGLE.replace("0, 1, 2]", "0, 1, 5]")} }}', "corner 2 is vertex 5; it has vertices 0..2"),
    "counts": (f'def Mesh "m" {{ {TRIANGLE.replace("= [3]", "= [4]")} }}', "add up to 4, but it lists 3"),
    "not finite": (
        f'def Mesh "m" {{ {TRIANGLE.replace("(1, 0, 0)", "(nan, 0, 0)")} }}',
        "frame 0, vertex 1 is [nan, 0.0, 0.0]",
    ),
    "missing file": ('def "a" (references = @gone.usda@) {}', "refers to gone.usda, which cannot be read"),
    "text": ('def Mesh "m" {', "cannot be read as USD"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_stages(tmp_path: Path, name: str) -> None:
    body, message = BAD[name]
    path = stage(tmp_path, body)
    with pytest.raises(InputError, match="a.usda") as caught:
        io.read(path)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_points_that_change_in_number(tmp_path: Path) -> None:
    read = io.read(stage(tmp_path, f'def Mesh "m" {{ {FEWER} }}'))
    with pytest.raises(InputError, match="has 4 vertices at frame 2 .time code 3., 3 at first; .*--frames 0:2 or --frames 2:"):
        read.read(0, 3)


@pytest.mark.parametrize("suffix", [".usda", ".usdc", ".usd", ".usdz"])
@pytest.mark.parametrize("data", [b"PNG and no stage", b"v 0 0 0\n"])
def test_other_files_under_the_name(tmp_path: Path, suffix: str, data: bytes) -> None:
    path = tmp_path / f"a{suffix}"
    path.write_bytes(data)
    with pytest.raises(InputError, match="is not a .usd"):
        io.read(path)


@pytest.mark.parametrize("suffix", [".usda", ".usdc", ".usdz"])
def test_cut_files(tmp_path: Path, suffix: str) -> None:
    io.write(scene(), tmp_path / f"a{suffix}")
    data = (tmp_path / f"a{suffix}").read_bytes()
    for part in range(1, 8):
        (tmp_path / f"b{suffix}").write_bytes(data[: len(data) * part // 8])
        with pytest.raises(InputError, match="b.usd") as caught:
            io.read(tmp_path / f"b{suffix}")
        assert "\n" not in str(caught.value)


def test_missing_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = stage(tmp_path, f'def Mesh "m" {{ {TRIANGLE} }}')
    monkeypatch.setitem(sys.modules, "pxr", None)
    with pytest.raises(InputError, match=r"pip install 'gvpipe\[usd\]'"):
        io.read(path)
    with pytest.raises(InputError, match=r"pip install 'gvpipe\[usd\]'"):
        io.write(scene(), tmp_path / "b.usdc")


def test_no_folder_to_write_to(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="create its folder first"):
        io.write(scene(), tmp_path / "gone" / "a.usdc")


def test_mesh_without_parts(tmp_path: Path) -> None:
    bare = MeshSequence(scene().read(0, 2), FACES, 30)
    io.write(bare, tmp_path / "walk.usdc")
    read = io.read(tmp_path / "walk.usdc")
    assert [(part.name, part.parent) for part in read.parts] == [("walk", "")]
    assert np.array_equal(read.faces, bare.faces)
    assert np.array_equal(read[:], bare[:])


@pytest.mark.parametrize("arc", ['def "a" (references = @../b.usda@) {}', 'def "a" (payload = @../b.usda@) {}', "sublayer"])
def test_stages_outside_of_the_folder(tmp_path: Path, arc: str) -> None:
    """A file shows nothing from elsewhere; a file below its folder may be shown."""
    (tmp_path / "in" / "below").mkdir(parents=True)
    text = '#usda 1.0\n(defaultPrim = "m")\ndef Mesh "m" {' + TRIANGLE + "}\n"
    for place in (tmp_path, tmp_path / "in" / "below"):
        (place / "b.usda").write_text(text)
    head = "#usda 1.0\n" + ("(subLayers = [@../b.usda@])\n" if arc == "sublayer" else arc)
    (tmp_path / "in" / "a.usda").write_text(head)
    with pytest.raises(InputError, match=r"a\.usda takes what it shows from outside of its folder: .*b\.usda; put that inside"):
        io.read(tmp_path / "in" / "a.usda")
    (tmp_path / "in" / "c.usda").write_text(head.replace("@../", "@below/"))
    assert io.read(tmp_path / "in" / "c.usda").n_vertices == 3


@pytest.mark.usefixtures("new_processes")
def test_library_that_dies(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A damaged file may end the library's process, and no other."""
    (tmp_path / "dying.py").write_text("import os\nos.abort()\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr("gvpipe.io.usd.process.WORKER", "dying")
    path = stage(tmp_path, f'def Mesh "m" {{ {TRIANGLE} }}')
    with pytest.raises(
        InputError, match=r"a\.usda cannot be read as USD: OpenUSD died of it, or of its limit of memory; export"
    ):
        io.read(path)


SLOW = """
from gvpipe.io.library import worker as library_worker
library_worker.LEAST_SECONDS = 0.0

def answer(name, arguments):
    with library_worker.limited_time(0):
        pass
    with library_worker.limited_time(0):
        while True:
            pass

library_worker.serve(answer)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="the system has no such limit")
@pytest.mark.usefixtures("new_processes")
def test_library_that_takes_too_long(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "slow.py").write_text(SLOW)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr("gvpipe.io.usd.process.WORKER", "slow")
    path = stage(tmp_path, f'def Mesh "m" {{ {TRIANGLE} }}')
    with pytest.raises(InputError, match=r"a\.usda cannot be read as USD: its library took more time .* use --unlimited"):
        io.read(path)


def many_copies(folder: Path, copies: int) -> Path:
    """A small file that asks for much memory: copies of a mesh of 4,900 vertices."""
    side = 70
    points = ", ".join(f"({k % side}, {k // side}, 0)" for k in range(side * side))
    mesh = f"""
    class Xform "proto" {{
        def Mesh "m" {{
        int[] faceVertexCounts = [3]
        int[] faceVertexIndices = [0, 1, {side}]
        point3f[] points = [{points}]
        }}
    }}
    """
    body = "".join(f'def Xform "c{k}" (instanceable = true; inherits = </proto>) {{}}\n' for k in range(copies))
    return stage(folder, mesh + body)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="other systems have no such limit")
def test_memory_follows_from_the_size(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(library_process, "start_process", start_with_little_memory)
    path = many_copies(tmp_path, 100)
    with pytest.raises(InputError, match=r"a\.usda.*(more memory|more numbers than memory|limit of memory).*; export it again"):
        io.read(path)
    assert io.read(path, unlimited=True).n_vertices == 490_000
    (tmp_path / "other.usdc").write_bytes(bytes(40 << 20))  # it might show that
    assert io.read(path).n_vertices == 490_000


def start_with_little_memory(module: str, path: Path) -> subprocess.Popen[bytes]:
    """A process whose limit is 64 times smaller, so that a test need not fill a gigabyte."""
    code = (
        "import runpy\nfrom gvpipe.io.library import worker\n"
        "worker.LEAST_MEMORY >>= 6\nworker.MEMORY_PER_BYTE = 10\n"
        f"runpy.run_module({module!r}, run_name='__main__')"
    )
    return subprocess.Popen(
        [sys.executable, "-c", code, str(path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    )


@pytest.mark.skipif(sys.platform != "linux", reason="other systems have no such limit")
@pytest.mark.parametrize("count", [1 << 28, 1 << 31])
def test_array_of_a_length_that_the_file_does_not_have(tmp_path: Path, count: int) -> None:
    """OpenUSD fills an array before it finds the end of the file: 4 GB for 2 kB, without its limit of memory."""
    corners = np.concatenate([np.arange(39).reshape(-1, 3) + k for k in range(3)]).astype(np.int32)
    io.write(MeshSequence(np.random.default_rng(3).random((1, 41, 3)).astype(np.float32), corners, 30), tmp_path / "a.usdc")
    data = (tmp_path / "a.usdc").read_bytes()
    length = struct.pack("<Q", corners.size)
    assert data.count(length) == 1
    (tmp_path / "a.usdc").write_bytes(data.replace(length, struct.pack("<Q", count)))
    with pytest.raises(InputError, match=r"a\.usdc cannot be read as USD: ") as caught:
        io.read(tmp_path / "a.usdc")
    assert "\n" not in str(caught.value) and str(count) not in str(caught.value)


@pytest.mark.slow
@pytest.mark.usefixtures("new_processes")
def test_many_files_take_turns(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of many files that are open, the last ones have a process; the others start one when they are asked."""
    monkeypatch.setattr(library_process, "MOST_RUNNING", 1)
    started: list[subprocess.Popen[bytes]] = []
    start = library_process.start_process

    def counted(module: str, path: Path) -> subprocess.Popen[bytes]:
        started.append(start(module, path))
        return started[-1]

    monkeypatch.setattr(library_process, "start_process", counted)
    sequences = [io.read(stage(tmp_path, f'def Mesh "m" {{ {MOVING} }}')) for _ in range(2)]
    assert [process.poll() is None for process in started] == [False, True]
    assert [sequence[2][0].tolist() for sequence in sequences] == [[0, 0, 4]] * 2
    assert sum(process.poll() is None for process in started) == 1
