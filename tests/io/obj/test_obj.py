"""OBJ as programs write it: faces, indices, colours, and errors that name the line."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from assets import assert_same_attribute, assert_same_static, asset, picture
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mesh_files import SQUARE, grid, obj_file, same_bits

from gvpipe import io
from gvpipe.asset.field import Field
from gvpipe.asset.material import Material, Texture
from gvpipe.asset.metadata import Metadata
from gvpipe.asset.part import Part
from gvpipe.attributes.surface_normals import surface_normals
from gvpipe.foundation.errors import InputError
from gvpipe.model.sequence import MeshSequence


def test_obj_keeps_order_where_texture_indices_differ(tmp_path: Path) -> None:
    text = (
        SQUARE + "v 9 9 9\n" + "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvt .5 .5\nvn 0 0 1\nf 1/5/1 2/2/1 3/3/1\nf 1/1/1 3/3/1 4/4/1\n"
    )
    read = io.read(obj_file(tmp_path, text))
    assert read.read(0, 1)[0].tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [9, 9, 9]]
    assert read.faces.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert read.attributes["uv"].tolist() == [[0.5, 0.5], [1, 0], [1, 1], [0, 0], [1, 1], [0, 1]]
    assert np.asarray(read.attributes["normal"]).tolist() == [[0, 0, 1]] * 4 + [[0, 0, 0]]


OBJ_FACES = {
    "quad": ("f 1 2 3 4\n", [[0, 1, 2], [0, 2, 3]]),
    "mixed polygons": ("f 1 2 3\nf 4 3 2 1\nf 1 2 4\n", [[0, 1, 2], [3, 2, 1], [3, 1, 0], [0, 1, 3]]),
    "relative": ("f -4 -3 -2\n", [[0, 1, 2]]),
    "relative before the end": ("f -4 -3 -2\nv 5 5 5\nf -5 -1 2\n", [[0, 1, 2], [0, 4, 1]]),
    "groups": ("o a\ng b\nusemtl c\ns 1\nf 1 2 3\no d\nf 1 3 4\nl 1 2\np 1\n", [[0, 1, 2], [0, 2, 3]]),
    "materials sort": (
        "usemtl a\nf 1 2 3\nusemtl b\nf 1 3 4\nusemtl a\nf 4 3 2\n",
        [[0, 1, 2], [3, 2, 1], [0, 2, 3]],
    ),
    "mixed corners": (
        "vt 0 0\nvn 0 0 1\nf 1 2 3\nf 1/1 3/1 4/1\nf 1//1 2//1 4//1\n",
        [[0, 1, 2], [0, 2, 3], [0, 1, 3]],
    ),
    "empty corner part": ("vt 0 0\nf 1/ 2/ 3/\n", [[0, 1, 2]]),
    "windows": ("f 1 2 3\r\nf 1 3 4\r\n", [[0, 1, 2], [0, 2, 3]]),
    "no last line end": ("f 1 2 3", [[0, 1, 2]]),
    "comments": ("# f 4 4 4\nf 1 2 3 # f 3 3 3\n", [[0, 1, 2]]),
    "indented, tabs, blanks": ("  f\t1  2\t3  \n\n\n\tf 1 3 4 \n", [[0, 1, 2], [0, 2, 3]]),
    "continued": ("f 1 2 \\\n3\n", [[0, 1, 2]]),
    "other keywords": ("vp 1 2\nfoo 1\nfo 9 9 9\nf 1 2 3\n", [[0, 1, 2]]),
}


@pytest.mark.parametrize(("text", "faces"), OBJ_FACES.values(), ids=OBJ_FACES.keys())
@pytest.mark.parametrize("line_end", ["\n", "\r\n"])
def test_obj_faces(tmp_path: Path, text: str, faces: Any, line_end: str) -> None:
    whole = (SQUARE + text).replace("\r\n", "\n").replace("\n", line_end)
    read = io.read(obj_file(tmp_path, "\ufeff" + whole))
    assert read.faces.tolist() == faces
    assert read.read(0, 1)[0][:4].tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]


def test_obj_colours_and_weights(tmp_path: Path) -> None:
    read = io.read(obj_file(tmp_path, "v 0 0 0 1 0 0\nv 1 0 0 0 0.2 0\nv 1 1 0 0 0 .5\nf 1 2 3\n"))
    assert read.attributes["color"].tolist() == [[255, 0, 0, 255], [0, 51, 0, 255], [0, 0, 128, 255]]
    read = io.read(obj_file(tmp_path, "v 0 0 0 1\nv 1 0 0\nv 1e0 1 -.5E1 1 0 0\nf 1 2 3\n"))
    assert read.read(0, 1)[0].tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, -5]]
    assert read.attributes["color"].tolist() == [[255, 255, 255, 255], [255, 255, 255, 255], [255, 0, 0, 255]]
    read = io.read(obj_file(tmp_path, "v 0 0 0 1 0 0 1\nv 1 0 0 0 1 0 1\nv 1 1 0 0 0 1 1\nf 1 2 3\n"))  # r g b a
    assert read.attributes["color"].tolist() == [[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255]]
    read = io.read(obj_file(tmp_path, "v 0 0 0 1 0 0 1\nv 1 0 0 1 1 0 1\nv 1 1 0 1 0 1 1\nf 1 2 3\n"))  # w r g b
    assert read.attributes["color"].tolist() == [[0, 0, 255, 255], [255, 0, 255, 255], [0, 255, 255, 255]]


def test_texture_coordinates_of_one_number(tmp_path: Path) -> None:
    read = io.read(obj_file(tmp_path, f"{SQUARE}vt 0.5\nvt 1 0.25\nvt 0.75\nf 1/1 2/2 3/3\n"))
    assert np.asarray(read.attributes["uv"].values)[:3].tolist() == [[0.5, 0], [1, 0.25], [0.75, 0]]


def test_obj_relative_indices_are_never_taken_from_the_first_frame(tmp_path: Path) -> None:
    obj_file(tmp_path, "v 0 0 0\nv 1 0 0\nv 1 1 0\nf -3 -2 -1\nv 0 1 0\n", "1.obj")
    obj_file(tmp_path, "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf -3 -2 -1\n", "2.obj")
    with pytest.raises(InputError, match=r"triangle 0 is \[1, 2, 3\] in 2.obj, but \[0, 1, 2\] in 1.obj"):
        io.read(tmp_path).read(0, 2)


BAD_OBJ = {
    "empty": ("", "is empty"),
    "prose": ("this is a text\nfor people\n", "it has no vertices"),
    "no faces": (SQUARE, "it has no faces"),
    "letters": ("v a b c\nf 1 1 1\n", "cannot be read as OBJ"),
    "comma": ("v 1,0 2,0 3,0\nf 1 1 1\n", "cannot be read as OBJ"),
    "short vertex": ("v 1 2\nv 1 2 3 4\nf 1 1 1\n", "entry 1 has 2 numbers"),
    "out of range": (SQUARE + "f 1 2 5\n", "triangle 0 is [0, 1, 4], but vertices are 0..3"),
    "before the start": (SQUARE + "f 1 2 -5\n", "but vertices are 0..3"),
    "zero": (SQUARE + "f 0 1 2\n", "OBJ counts from 1"),
    "two corners": (SQUARE + "f 1 2 3\nf 1 2\n", "face 2 has 2 corners"),
    "bad corner": (SQUARE + "f 1 2 x\n", "cannot be read as OBJ"),
    "four parts": (SQUARE + "f 1/1/1/1 2 3\n", "not a corner"),
    "texture index": (SQUARE + "vt 0 0\nf 1/1 2/2 3/1\n", "'vt' entry outside 1..1"),
    "texture nan": (SQUARE + "vt 0 nan\nf 1/1 2/1 3/1\n", "uv: value 0 is [0.0, nan]; finite numbers are needed"),
    "nan": ("v 0 0 0\nv 1 nan 0\nv 1 1 0\nf 1 2 3\n", "frame 0, vertex 1 is [1.0, nan, 0.0]"),
    "too large": ("v 0 0 0\nv 1 1e39 0\nv 1 1 0\nf 1 2 3\n", "float32 can hold"),
    "nul": ("v 0 0 0\0\0\nf 1 1 1\n", "cannot be read as OBJ"),
}


@pytest.mark.parametrize(("text", "message"), BAD_OBJ.values(), ids=BAD_OBJ.keys())
def test_obj_errors(tmp_path: Path, text: str, message: str) -> None:
    path = obj_file(tmp_path, text)
    with pytest.raises(InputError) as error:
        io.read(path)
    assert message in str(error.value)
    assert str(path) in str(error.value)
    assert "\n" not in str(error.value)


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.lists(
        st.sampled_from(
            ["v", "f", "vt", "vn", " ", "\n", "1", "2", "3", "-1", "/", "//", ".", "e", "#", "\\", "\r", "\t", "é"]
        ),
        max_size=40,
    )
)
def test_obj_never_fails_otherwise(tmp_path: Path, pieces: list[str]) -> None:
    path = obj_file(tmp_path, "v 0 0 0\nv 1 0 0\nf 1 2 1\n" + "".join(pieces))
    with contextlib.suppress(InputError):
        io.read(path)


def test_an_asset_as_obj(tmp_path: Path) -> None:
    normals = np.random.default_rng(0).normal(size=(9, 3)).astype(np.float32)
    kept = {name: asset().attributes[name] for name in ("uv", "color")}
    opaque = np.asarray(kept["color"]) | np.array([0, 0, 0, 255], np.uint8)
    given = asset(1, attributes={"uv": kept["uv"], "color": opaque, "normal": normals}, fields={}, metadata=Metadata())
    assert io.write(given, tmp_path / "a.obj") == ()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.mtl", "a.obj", "bumps.jpg", "cloth.png"]
    read = io.read(tmp_path / "a.obj")
    assert_same_static(read, given)
    assert same_bits(read.read(0, 1), given.read(0, 1))
    for name in ("uv", "color", "normal"):
        assert_same_attribute(read.attributes[name], given.attributes[name], given.faces)
    assert read.notes == ()


def test_what_obj_cannot_hold_is_said(tmp_path: Path) -> None:
    material = Material("a", occlusion_texture=Texture(0), double_sided=True)
    given = asset(materials=(material, material))
    notes = io.write(given, tmp_path / "a_%d.obj")
    assert notes == (
        "OBJ has no place for weight, id, stress, flow, metadata, alpha of colours; left out (.npz holds everything)",
        "MTL has no place for double-sided or unlit materials, occlusion textures; left out (.npz holds everything)",
    )
    assert "newmtl a\n" in (tmp_path / "a.mtl").read_text() and "newmtl a_1\n" in (tmp_path / "a.mtl").read_text()


def test_parts_of_an_obj(tmp_path: Path) -> None:
    text = "o a\nusemtl x #1\nf 1 2 3\ng left\nf 1 3 4\no b c\nf 4 3 2\nusemtl\nf 2 3 4\no a\nusemtl x #1\nf 2 1 3\n"
    read = io.read(obj_file(tmp_path, SQUARE + text))
    assert [(part.name, part.parent, part.triangles, part.material) for part in read.parts] == [
        ("a", "", (0, 2), 0),
        ("left", "a", (2, 3), 0),
        ("b c", "", (3, 4), 0),
        ("b c", "", (4, 5), None),
    ]
    assert read.faces.tolist() == [[0, 1, 2], [1, 0, 2], [0, 2, 3], [3, 2, 1], [1, 2, 3]]
    assert read.materials == (Material("x #1"),)
    assert read.notes == (
        "its faces were sorted by object, group and material",
        "f.obj uses material 'x #1', which no .mtl file beside it describes; it looks plain",
    )
    io.write(read, tmp_path / "g.obj")
    again = io.read(tmp_path / "g.obj")
    assert_same_static(again, read)


MTL = """# made by hand
newmtl shiny
Kd 1 0.5 .25
Ns 250
d 0.5
map_Ke -s 2 4 -o 0.5 0.25 -clamp on glow map.png
norm -bm 0.5 bumps.png
map_Pr -imfchan g packed.png
map_Pm -imfchan b packed.png

newmtl cut
map_Kd sub\\Leaf.PNG
map_d sub/leaf.png
map_Ks other.png
"""


def test_mtl(tmp_path: Path) -> None:
    (tmp_path / "sub").mkdir()
    for name in ("glow map.png", "bumps.png", "packed.png", "sub/leaf.png"):
        (tmp_path / name).write_bytes(picture())
    (tmp_path / "my materials.mtl").write_text(MTL)
    read = io.read(obj_file(tmp_path, SQUARE + "mtllib my materials.mtl\nusemtl cut\nf 1 2 3\nusemtl shiny\nf 1 3 4\n"))
    shiny, cut = read.materials
    assert (shiny.base_color, shiny.roughness, shiny.alpha_mode, shiny.emissive) == (
        (1, 0.5, 0.25, 0.5),
        0.5,
        "blend",
        (1, 1, 1),
    )
    by_name = {image.name: number for number, image in enumerate(read.images)}
    assert shiny.emissive_texture == Texture(
        by_name["glow map"], wrap=("clamp", "clamp"), offset=(0.5, -3.25), tiling=(2.0, 4.0)
    )
    assert shiny.normal_texture == Texture(by_name["bumps"], scale=0.5)
    assert shiny.metallic_roughness_texture == Texture(by_name["packed"])
    assert cut.base_color_texture == Texture(by_name["leaf"]) and cut.alpha_mode == "blend"
    assert [part.material for part in read.parts] == [1, 0]
    assert read.not_carried == ("material statement map_ks",)
    (tmp_path / "out").mkdir()
    io.write(read, tmp_path / "out" / "a.obj")
    again = io.read(tmp_path / "out" / "a.obj")
    assert_same_static(again, read)


PICTURES = {
    "absolute": ("/etc/hostname", "lies outside of the folder"),
    "windows": ("C:\\textures\\a.png", "lies outside of the folder"),
    "above": ("../secret.png", "lies outside of the folder"),
    "hidden above": ("sub\\..\\..\\secret.png", "lies outside of the folder"),
    "link": ("link.png", "is a link to outside of the folder"),
    "missing": ("none.png", "there is no 'none.png' beside the mesh"),
    "folder": ("sub", "there is no 'sub' beside the mesh"),
    "broken": ("broken.png", "is not a picture; export it as PNG or JPEG"),
}


@pytest.mark.parametrize(("name", "message"), PICTURES.values(), ids=PICTURES.keys())
def test_pictures_that_cannot_be_used(tmp_path: Path, name: str, message: str) -> None:
    (tmp_path / "secret.png").write_bytes(picture())
    folder = tmp_path / "asset"
    (folder / "sub").mkdir(parents=True)
    (folder / "link.png").symlink_to(tmp_path / "secret.png")
    (folder / "broken.png").write_bytes(b"not a picture")
    (folder / "a.mtl").write_text(f"newmtl a\nKd 0.5 0.5 0.5\nmap_Kd {name}\n")
    read = io.read(obj_file(folder, SQUARE + "mtllib a.mtl\nusemtl a\nf 1 2 3\n"))
    assert read.images == () and read.materials == (Material("a", (0.5, 0.5, 0.5, 1.0)),)
    assert len(read.notes) == 1 and message in read.notes[0] and "\n" not in read.notes[0]


def test_normals_of_a_series(tmp_path: Path) -> None:
    moving = grid(6)
    smooth = surface_normals(moving[0:1], moving.faces, moving.faces.reshape(-1), "angle")[0]
    own = MeshSequence(moving[0:6], moving.faces, attributes={"normal": np.concatenate([smooth, np.zeros((1, 3), "f4")])})
    assert io.write(own, tmp_path / "own" / "%d.obj") == ()
    read = io.read(tmp_path / "own")
    assert set(read.attributes) == {"normal"} and read.fields == {} and read.notes[1:] == ()
    last = io.read(tmp_path / "own" / "5.obj")
    expected = surface_normals(moving[5:6], moving.faces, moving.faces.reshape(-1), "angle")[0]
    np.testing.assert_allclose(last.attributes["normal"][:36], expected, atol=1e-6)

    turning = np.random.default_rng(4).normal(size=(6, 37, 3)).astype(np.float32)
    turning[:, 36] = 0  # no corner shows it
    io.write(
        MeshSequence(moving[0:6], moving.faces, fields={"normal": Field(turning, kind="normal")}), tmp_path / "t" / "%d.obj"
    )
    read = io.read(tmp_path / "t")
    assert read.attributes == {} and read.fields["normal"].kind == "normal"
    assert same_bits(read.fields["normal"][3:6], turning[3:6]) and same_bits(read.fields["normal"][:], turning)


def test_colours_of_a_series(tmp_path: Path) -> None:
    colors = np.random.default_rng(4).integers(0, 256, (6, 37, 4), np.uint8) | np.array([0, 0, 0, 255], np.uint8)
    moving = grid(6)
    io.write(MeshSequence(moving[0:6], moving.faces, fields={"color": Field(colors, kind="color")}), tmp_path / "%d.obj")
    read = io.read(tmp_path)
    assert same_bits(read.fields["color"][:], colors) and read.fields["color"].kind == "color"
    lines = (tmp_path / "3.obj").read_text().splitlines()
    (tmp_path / "3.obj").write_text("\n".join(" ".join(line.split()[:4]) if line[:2] == "v " else line for line in lines))
    with pytest.raises(InputError, match=r"3.obj has no 'color', 0.obj has it \(37, 4\)"):
        io.read(tmp_path).fields["color"].read(0, 6)


def test_many_parts(tmp_path: Path) -> None:
    text = "".join(f"g part {i}\nusemtl m{i % 7}\nf {i % 4 + 1} 2 3\n" for i in range(10_000))
    read = io.read(obj_file(tmp_path, SQUARE + text))
    assert len(read.parts) == 10_000 and read.parts[-1].name == "part 9999" and len(read.materials) == 7


WORDS = ["newmtl a", "newmtl", "map_Kd", "-s", "-o 1 2", "-bm", "x.png", "norm", "Kd", "1", "nan", "d", "-halo"]
WORDS += ["Tr", "\n", " ", "é", "\\"]


@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(st.sampled_from(WORDS), max_size=30))
def test_any_material_file_is_read(tmp_path: Path, words: list[str]) -> None:
    (tmp_path / "a.mtl").write_text("newmtl a\n" + " ".join(words))
    read = io.read(obj_file(tmp_path, SQUARE + "mtllib a.mtl\nusemtl a\nf 1 2 3\n"))
    assert len(read.materials) == 1


def test_parts_of_one_name_stay_apart(tmp_path: Path) -> None:
    faces = np.arange(18, dtype=np.int32).reshape(-1, 3)
    parts = tuple(
        Part(name, (3 * i, 3 * i + 3), (i, i + 1), material)
        for i, (name, material) in enumerate([("a", 0), ("a", 1), ("a %d", None), ("a", 0), ("a", 0), ("", 1)])
    )
    given_parts = MeshSequence(np.zeros((1, 18, 3)), faces, parts=parts, materials=(Material("m"), Material("n")))
    io.write(given_parts, tmp_path / "a.obj")
    read = io.read(tmp_path / "a.obj")
    assert [part.name for part in read.parts] == ["a", "a", "a %d", "a_1", "a_2", ""]
    assert [(part.vertices, part.triangles, part.material) for part in read.parts] == [
        (part.vertices, part.triangles, part.material) for part in parts
    ]
    assert np.array_equal(read.faces, faces) and read.notes == ()


def test_parts_that_share_vertices_have_one_range(tmp_path: Path) -> None:
    read = io.read(obj_file(tmp_path, SQUARE + "o a\nusemtl x\nf 1 2 3\nusemtl y\nf 2 3 4\n"))
    assert [part.vertices for part in read.parts] == [(0, 4), (0, 4)]
