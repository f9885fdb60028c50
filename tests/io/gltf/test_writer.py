"""What is written comes back: frames and animations, with all that lies beside the positions."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gltf_files import take_apart
from mesh_files import grid, same_bits
from PIL import Image as Pillow

import gvpipe
from gvpipe.asset.attribute import Attribute
from gvpipe.asset.field import Field
from gvpipe.asset.material import Image, Material, Texture
from gvpipe.asset.metadata import Metadata
from gvpipe.asset.part import Part
from gvpipe.model.sequence import MeshSequence


def picture(folder: Path, kind: str, color: tuple[int, int, int]) -> bytes:
    Pillow.new("RGB", (4, 4), color).save(folder / f"p.{kind}")
    return (folder / f"p.{kind}").read_bytes()


@pytest.fixture
def asset(tmp_path: Path) -> MeshSequence:
    """A waving sheet with two parts that share vertices, a still one, seams, textures and numbers of its own."""
    bare = grid(5)
    n_vertices, faces = bare.n_vertices - 1, bare.faces  # without the unused vertex
    moving = bare.read(0, 5)[:, :-1]
    positions = np.concatenate([moving, np.repeat(moving[:1, :3] - 5, 5, axis=0)], axis=1)
    faces = np.concatenate([faces, [[n_vertices, n_vertices + 1, n_vertices + 2]]]).astype(np.int32)
    corners = faces.reshape(-1)
    uv = np.stack([corners % 6, corners // 6], axis=1) / 8
    uv[:3] += 0.5  # a seam around the first triangle
    images = (
        Image("paint", "image/png", picture(tmp_path, "png", (255, 0, 0))),
        Image("glow", "image/webp", picture(tmp_path, "webp", (0, 255, 0))),
    )
    paint = Texture(0, wrap=("clamp", "mirror"), filter="nearest", offset=(0.25, 0.5), rotation=0.5, tiling=(2.0, 3.0))
    materials = (
        Material("paint", (0.5, 0.25, 0.125, 0.75), paint, 0.25, 0.5, normal_texture=Texture(0, scale=0.5), double_sided=True),
        Material(
            "glow", emissive=(4.0, 2.0, 1.0), emissive_texture=Texture(1), alpha_mode="mask", alpha_cutoff=0.25, unlit=True
        ),
    )
    rows = n_vertices + 3
    return MeshSequence(
        positions,
        faces,
        12.5,
        {
            "uv": Attribute(uv.astype(np.float32), "corner", "uv"),
            "color": Attribute(np.arange(4 * rows).reshape(rows, 4).astype(np.uint8), "vertex", "color"),
            "mass": Attribute(np.linspace(0, 1, rows, dtype=np.float32), "vertex", "scalar"),
            "label": Attribute(np.arange(rows, dtype=np.int32), "vertex", "label"),
        },
        parts=(
            Part("sheet", (0, n_vertices), (0, 20), 0, "root"),
            Part("sheet", (0, n_vertices), (20, 50), 1, "root"),
            Part("flag", (n_vertices, n_vertices + 3), (50, 51), None, ""),
        ),
        materials=materials,
        images=images,
        metadata=Metadata("y", 1.0),
    )


def split_sources(read: MeshSequence, asset: MeshSequence) -> Any:
    """The vertex of the asset that each one read stands for: its labels say so."""
    return np.asarray(read.attributes["label"])[:, 0].astype(np.int64)


@pytest.mark.parametrize("name", ["one.glb", "f%02d.glb"])
def test_an_asset_comes_back(asset: MeshSequence, tmp_path: Path, name: str) -> None:
    notes = gvpipe.write(asset, tmp_path / "out" / name if "%" in name else tmp_path / name)
    assert notes == []
    read = gvpipe.read(tmp_path / "out" if "%" in name else tmp_path / name)
    sources = split_sources(read, asset)
    assert len(read) == 5 and (np.diff(sources) >= 0).all() and len(sources) == asset.n_vertices + 3
    np.testing.assert_allclose(read.read(0, 5), asset.read(0, 5)[:, sources], atol=1e-6)
    assert sources[read.faces].tolist() == asset.faces.tolist()
    np.testing.assert_allclose(np.asarray(read.attributes["uv"])[read.faces.reshape(-1)], asset.attributes["uv"][:], atol=1e-6)
    assert same_bits(read.attributes["color"][:], asset.attributes["color"][sources])
    assert same_bits(read.attributes["mass"][:], asset.attributes["mass"][sources])
    assert read.materials == asset.materials and read.images == asset.images
    assert [(p.name, p.parent, p.material, p.triangles) for p in read.parts] == [
        (p.name, p.parent, p.material, p.triangles) for p in asset.parts
    ]
    assert read.fps == (30 if "%" in name else 12.5)


def test_an_animation_stores_what_moves_once(asset: MeshSequence, tmp_path: Path) -> None:
    order = [0, 1, 0, 1, 2, 0]
    repeating = MeshSequence(
        asset.read(0, 5)[order], asset.faces, 24, parts=asset.parts, materials=asset.materials, images=asset.images
    )
    assert gvpipe.write(repeating, tmp_path / "a.glb") == []
    tree, _ = take_apart((tmp_path / "a.glb").read_bytes())
    sheet, flag = tree["meshes"]
    assert [len(primitive["targets"]) for primitive in sheet["primitives"]] == [2, 2] and "targets" not in flag["primitives"][0]
    assert sheet["primitives"][0]["attributes"] == sheet["primitives"][1]["attributes"]
    read = gvpipe.read(tmp_path / "a.glb")
    assert read.fps == 24 and read.notes == ()
    np.testing.assert_allclose(read.read(0, 6), repeating.read(0, 6), atol=1e-6)
    assert same_bits(read[0], read[2]) and same_bits(read[0], repeating[0])


def test_a_still_sequence_keeps_its_length(tmp_path: Path) -> None:
    still = MeshSequence(np.repeat(grid(1).read(0, 1), 7, axis=0), grid(1).faces, 10)
    gvpipe.write(still, tmp_path / "a.glb")
    read = gvpipe.read(tmp_path / "a.glb")
    assert len(read) == 7 and read.fps == 10 and same_bits(read.read(0, 7), still.read(0, 7))


def test_one_frame_is_a_still_file(tmp_path: Path) -> None:
    gvpipe.write(grid(1), tmp_path / "a.glb")
    assert "animations" not in take_apart((tmp_path / "a.glb").read_bytes())[0]
    assert same_bits(gvpipe.read(tmp_path / "a.glb")[0], grid(1)[0])


@pytest.mark.parametrize(("axis", "up"), [("z", [0, 0, 1]), ("x", [1, 0, 0]), ("y", [0, 1, 0])])
def test_scenes_become_metres_with_y_up(tmp_path: Path, axis: str, up: list[int]) -> None:
    base = grid(2)
    normals = Attribute(np.tile(np.array(up, np.float32), (base.n_vertices, 1)), "vertex", "normal")
    scene = MeshSequence(
        base.read(0, 2).astype(np.float64) + np.multiply(up, 1e7),
        base.faces,
        attributes={"normal": normals},
        metadata=Metadata(axis, 0.01),
    )
    assert scene.origin.any()
    turned = f"turned from {axis.upper()} up and " if axis != "y" else ""
    for name in ("f%d.glb", "a.glb"):
        notes = gvpipe.write(scene, tmp_path / axis / name if "%" in name else tmp_path / name)
        assert notes[0] == f"glTF is in metres with Y up; the scene's nodes are {turned}scaled by 0.01"
        read = gvpipe.read(tmp_path / axis if "%" in name else tmp_path / name)
        heights = scene.read_absolute(0, 2) @ np.array(up) * 0.01
        np.testing.assert_allclose(read.read_absolute(0, 2)[:, :, 1], heights, atol=1e-6)
        np.testing.assert_allclose(read.attributes["normal"][0], [0, 1, 0], atol=1e-6)
        # turned, not mirrored: the first triangle faces the same side
        before, after = side(scene, up), side(read, [0, 1, 0])
        np.testing.assert_allclose(after, before * 1e-4, atol=1e-9)


def side(one: MeshSequence, up: list[int]) -> Any:
    """Twice the area of the first triangle, seen along an axis; negative from behind."""
    a, b, c = one[0][one.faces[0]].astype(np.float64)
    return np.cross(b - a, c - a) @ np.array(up)


def test_what_is_lost_is_said(tmp_path: Path) -> None:
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
    faces = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    scene = MeshSequence(
        np.stack([square, square + 1]),
        faces,
        attributes={"area": Attribute(np.ones(2, np.float32), "triangle"), "big": Attribute(np.array([[2**30]] * 4), "vertex")},
        fields={"heat": Field(np.arange(8, dtype=np.float32).reshape(2, 4))},
        polygons=np.array([4], np.int32),
    )
    assert gvpipe.write(scene, tmp_path / "a.glb") == [
        "glTF has triangles alone; 1 polygons became fans",
        "glTF has no place for area, big, heat; left out (.npz holds everything)",
    ]
    notes = gvpipe.write(scene, tmp_path / "s" / "%d.glb")
    assert notes[1] == "glTF has no place for area, big; left out (.npz holds everything)"
    assert gvpipe.read(tmp_path / "s").fields["heat"].read(0, 2)[:, :, 0].tolist() == [[0, 1, 2, 3], [4, 5, 6, 7]]


def test_vectors_get_length_one_and_tangents_their_side(tmp_path: Path) -> None:
    base = grid(1)
    n = base.n_vertices
    scene = MeshSequence(
        base.read(0, 1),
        base.faces,
        attributes={
            "normal": Attribute(np.full((n, 3), 2, np.float32), "vertex", "normal"),
            "tangent": Attribute(np.tile(np.array([0, 3, 0, -0.5], np.float32), (n, 1)), "vertex", "tangent"),
        },
    )
    gvpipe.write(scene, tmp_path / "a.glb")
    read = gvpipe.read(tmp_path / "a.glb").attributes
    np.testing.assert_allclose(read["normal"][0], [3**-0.5] * 3, atol=1e-6)
    assert read["tangent"][0].tolist() == [0, 1, 0, -1]


def test_other_pictures_become_png(tmp_path: Path) -> None:
    base = grid(1, attributes={"uv": Attribute(np.zeros((37, 2), np.float32), "vertex", "uv")})
    image = Image("old", "image/bmp", picture(tmp_path, "bmp", (1, 2, 3)))
    part = Part("m", (0, 37), (0, 50), 0)
    scene = MeshSequence(
        base.read(0, 1), base.faces, attributes=base.attributes, parts=(part,), images=(image,),
        materials=(Material(base_color_texture=Texture(0)),),
    )  # fmt: skip
    gvpipe.write(scene, tmp_path / "a.glb")
    (read,) = gvpipe.read(tmp_path / "a.glb").images
    assert read.media_type == "image/png" and read.name == "old" and read.data.startswith(b"\x89PNG")


def corner_normals(sequence: MeshSequence) -> Attribute:
    """A normal of length 1 for each corner, equal for no two."""
    rows = np.random.default_rng(5).normal(size=(3 * len(sequence.faces), 3))
    return Attribute((rows / np.linalg.norm(rows, axis=1, keepdims=True)).astype(np.float32), "corner", "normal")


def morphed(path: Path, name: str, target: int) -> Any:
    """An attribute of the first primitive, with one morph target of weight 1."""
    tree, binary = take_apart(path.read_bytes())
    primitive = tree["meshes"][0]["primitives"][0]
    total = 0
    for number in (primitive["attributes"][name], primitive["targets"][target][name]):
        total = total + dense(tree, binary, tree["accessors"][number])
    return total


def dense(tree: Any, binary: bytes, accessor: Any) -> Any:
    """The floats of an accessor of vectors."""
    values = np.zeros((accessor["count"], 3), np.float32)

    def view(number: int, kind: str, count: int) -> Any:
        return np.frombuffer(binary, kind, count, tree["bufferViews"][number].get("byteOffset", 0))

    if "bufferView" in accessor:
        values = view(accessor["bufferView"], "<f4", values.size).reshape(-1, 3).copy()
    if "sparse" in accessor:
        sparse = accessor["sparse"]
        rows = view(sparse["indices"]["bufferView"], "<u2", sparse["count"])
        values[rows] = view(sparse["values"]["bufferView"], "<f4", 3 * sparse["count"]).reshape(-1, 3)
    return values


def test_normals_of_corners_turn_in_an_animation(tmp_path: Path) -> None:
    base = grid(1)
    angle = 0.7
    turn = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
    moved = (base[0] @ turn.T).astype(np.float32)
    scene = MeshSequence(np.stack([base[0], moved]), base.faces, attributes={"normal": corner_normals(base)})
    notes = gvpipe.write(scene, tmp_path / "a.glb")
    assert notes == ["normals follow from no rule; in glTF those of later frames are turned with the surface"]
    first = np.asarray(gvpipe.read(tmp_path / "a.glb").attributes["normal"])
    faces = gvpipe.read(tmp_path / "a.glb").faces.reshape(-1)
    assert same_bits(first[faces], np.asarray(scene.attributes["normal"]))
    np.testing.assert_allclose(morphed(tmp_path / "a.glb", "POSITION", 0)[faces], moved[base.faces.reshape(-1)], atol=1e-6)
    expected = np.asarray(scene.attributes["normal"]) @ turn.T
    np.testing.assert_allclose(morphed(tmp_path / "a.glb", "NORMAL", 0)[faces], expected, atol=3e-6)


def test_normals_that_stay_are_left_out_of_targets(tmp_path: Path) -> None:
    base = grid(1)
    bent = base[0].copy()
    bent[base.faces[0, 0], 2] += 0.5
    scene = MeshSequence(np.stack([base[0], bent]), base.faces, attributes={"normal": corner_normals(base)})
    gvpipe.write(scene, tmp_path / "a.glb")
    tree, _ = take_apart((tmp_path / "a.glb").read_bytes())
    target = tree["accessors"][tree["meshes"][0]["primitives"][0]["targets"][0]["NORMAL"]]
    touched = (base.faces == base.faces[0, 0]).any(axis=1).sum()
    assert 0 < target["sparse"]["count"] <= 3 * touched


def test_a_field_of_normals_moves_in_an_animation(tmp_path: Path) -> None:
    base = grid(2)
    values = np.zeros((2, base.n_vertices, 3), np.float32)
    values[0, :, 2], values[1, :, 0] = 1, 1
    scene = MeshSequence(base.read(0, 2), base.faces, fields={"normal": Field(values, kind="normal")})
    assert gvpipe.write(scene, tmp_path / "a.glb") == []
    assert same_bits(morphed(tmp_path / "a.glb", "NORMAL", 0), values[1])
    gvpipe.write(scene, tmp_path / "s" / "%d.glb")
    assert same_bits(gvpipe.read(tmp_path / "s").fields["normal"][0:2], values)
