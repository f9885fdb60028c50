"""USD: what is met and not taken is named, and what is hidden in a prototype is not shown."""

from __future__ import annotations

from pathlib import Path

import pytest

import gvpipe

pytest.importorskip("pxr")
TRIANGLE = """def Mesh "{name}" {{
    int[] faceVertexCounts = [3]
    int[] faceVertexIndices = [0, 1, 2]
    point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
    {more}
}}
"""
INSTANCER = """def PointInstancer "many" {{
    point3f[] positions = [(0, 0, 0), (2, 0, 0)]
    int[] protoIndices = [0, 0]
    rel prototypes = </many/a>
    {own}
    def Xform "a" {{
{inside}    }}
}}
"""


def _read(folder: Path, text: str) -> gvpipe.MeshSequence:
    path = folder / "a.usda"
    path.write_text("#usda 1.0\n" + text)
    return gvpipe.read(path)


def test_what_lies_in_prototypes(tmp_path: Path) -> None:
    inside = TRIANGLE.format(name="x", more="") + TRIANGLE.format(name="y", more='token visibility = "invisible"')
    own = "color3f[] primvars:displayColor = [(1, 0, 0), (0, 1, 0)]"
    found = _read(tmp_path, INSTANCER.format(own=own, inside=inside + 'def Sphere "s" {}\n'))
    assert found.n_vertices == 6  # x, twice
    assert any(note.startswith("2 of 4 meshes are invisible") for note in found.notes)
    assert found.not_carried == ("Sphere prims", "primvar displayColor of an instancer")


def test_variants(tmp_path: Path) -> None:
    text = """def Xform "w" (
    variants = { string look = "red" }
    prepend variantSets = "look"
)
{
    variantSet "look" = {
        "red" { }
        "blue" { }
    }
%s}
"""
    assert _read(tmp_path, text % TRIANGLE.format(name="m", more="")).not_carried == ("other variants of set look",)


def test_materials_that_change(tmp_path: Path) -> None:
    material = """def Material "mat" {
    token outputs:surface.connect = </mat/s.outputs:surface>
    def Shader "s" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor.timeSamples = { 0: (1, 0, 0), 1: (0, 0, 1) }
        token outputs:surface
    }
}
"""
    found = _read(tmp_path, material + TRIANGLE.format(name="m", more="rel material:binding = </mat>"))
    assert found.not_carried == ("animation of diffuseColor",)


def test_numbers_that_change_on_a_mesh_that_stands_still(tmp_path: Path) -> None:
    more = "float[] primvars:displayOpacity.timeSamples = { 0: [1], 1: [0.5] }"
    assert _read(tmp_path, TRIANGLE.format(name="m", more=more)).not_carried == ("animation of primvar displayOpacity",)
    moving = """point3f[] points.timeSamples = { 0: [(0, 0, 0), (1, 0, 0), (0, 1, 0)], 1: [(0, 0, 1), (1, 0, 1), (0, 1, 1)] }
    float[] primvars:heat (interpolation = "vertex")
    float[] primvars:heat.timeSamples = { 0: [1, 2, 3], 1: [2, 3, 4] }"""
    found = _read(
        tmp_path, TRIANGLE.format(name="m", more=moving).replace("point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]\n", "")
    )
    assert set(found.fields) == {"heat"} and found.not_carried == ()


def test_numbers_that_have_no_place(tmp_path: Path) -> None:
    more = """vector3f[] velocities = [(0, 0, 1), (0, 0, 1), (0, 0, 1)]
    custom float mass = 3
    string[] primvars:tag = ["a", "b", "c"] (interpolation = "vertex")
    float primvars:smoothness = 2 (interpolation = "constant")
    float[] primvars:heat = [1, 2] (interpolation = "vertex")
    def GeomSubset "clothes" {
        uniform token elementType = "face"
        uniform token familyName = "outfit"
        int[] indices = [0]
    }"""
    assert _read(tmp_path, TRIANGLE.format(name="m", more=more)).not_carried == (
        "attribute mass",
        "primvar heat, which does not fit its mesh",
        "primvar smoothness",
        "primvar tag",
        "subsets of family 'outfit'",
        "velocities",
    )


READER = """def Material "mat" {
    token outputs:surface.connect = </mat/s.outputs:surface>
    color3f inputs:tint.timeSamples = { 0: (1, 0, 0), 1: (0, 0, 1) }
    def Shader "s" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor.connect = </mat/r.outputs:result>
        float inputs:displacement = 0.5
        float inputs:roughness.connect = </mat/n.outputs:out>
        token outputs:surface
    }
    def Shader "r" {
        uniform token info:id = "UsdPrimvarReader_float3"
        string inputs:varname = "displayColor"
        float3 outputs:result
    }
    def Shader "n" {
        uniform token info:id = "ND_noise2d_float"
        float outputs:out
    }
}
"""


def test_what_shaders_say(tmp_path: Path) -> None:
    more = "rel material:binding = </mat>\n color3f[] primvars:displayColor = [(1, 0, 0)]\n int[] holeIndices = [0]"
    found = _read(tmp_path, READER + TRIANGLE.format(name="m", more=more))
    assert found.materials[0].base_color[:3] == (1, 1, 1)  # the mesh's colours are its own
    assert set(found.not_carried) == {
        "animation of tint", "displacement of a material", "ND_noise2d_float of roughness", "holeIndices",
    }  # fmt: skip


def test_opacities_without_a_place(tmp_path: Path) -> None:
    opacity = 'float[] primvars:displayOpacity = [0.5, 0.25, 1] (interpolation = "vertex")'
    assert _read(tmp_path, TRIANGLE.format(name="m", more=opacity)).not_carried == ("primvar displayOpacity",)
    color = 'color3f[] primvars:displayColor = [(1, 0, 0), (0, 1, 0), (0, 0, 1)] (interpolation = "vertex")\n'
    assert _read(tmp_path, TRIANGLE.format(name="m", more=color + opacity)).not_carried == ()


def test_one_variant_and_names_written_again(tmp_path: Path) -> None:
    text = """def Xform "w" (
    variants = { string look = "red" }
    prepend variantSets = "look"
)
{
    variantSet "look" = { "red" { } }
%s}
"""
    more = 'custom string userProperties:blender:object_name = "m"'
    assert _read(tmp_path, text % TRIANGLE.format(name="m", more=more)).not_carried == ()
