"""What moves, shows or hides by extensions is evaluated or carried; all else is named."""

from __future__ import annotations

import dataclasses
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gltf_files import File, square_file
from PIL import Image

import gvpipe
from gvpipe.asset.material import Material, Texture
from gvpipe.foundation.errors import InputError
from gvpipe.io.gltf.looks import LAYERS, field_name
from gvpipe.model.sequence import MeshSequence

POINTER = "KHR_animation_pointer"
VISIBILITY = "KHR_node_visibility"


def pointer(file: File, path: str, times: Any, values: int, mode: str = "LINEAR") -> dict[str, Any]:
    """A channel that moves what a pointer names, and its sampler."""
    target = {"path": "pointer", "extensions": {POINTER: {"pointer": path}}}
    return {"sampler": {"input": file.floats(times), "output": values, "interpolation": mode}, "target": target}


def animate(file: File, *channels: dict[str, Any]) -> None:
    """Add an animation of channels."""
    file.add(
        "animations",
        {
            "samplers": [each["sampler"] for each in channels],
            "channels": [{"sampler": number, "target": each["target"]} for number, each in enumerate(channels)],
        },
    )


def read(file: File, tmp_path: Path) -> MeshSequence:
    return gvpipe.read(file.write(tmp_path / "a.glb"))


def frames(sequence: MeshSequence) -> np.ndarray[Any, Any]:
    return sequence.read(0, sequence.n_frames)


@pytest.mark.parametrize(
    ("path", "values", "moved"),
    [
        ("/nodes/0/translation", [[0, 0, 0], [5, 0, 0]], [5, 0, 0]),
        ("/nodes/0/scale", [[1, 1, 1], [3, 1, 1]], [0, 0, 0]),
        ("/nodes/0/rotation", [[0, 0, 0, 1], [0, 0, 1, 0]], [0, 0, 0]),
    ],
)
def test_pointers_to_nodes(path: str, values: Any, moved: list[float], tmp_path: Path) -> None:
    """As the property's own channel moves it."""
    by_pointer, plain = File(), File()
    for file in (by_pointer, plain):
        file.add("nodes", {"mesh": file.mesh(file.square())})
    animate(by_pointer, pointer(by_pointer, path, [0, 1], by_pointer.floats(values)))
    plain.clip((0, path.rpartition("/")[2], [0, 1], values, "LINEAR"))
    found = read(by_pointer, tmp_path)
    np.testing.assert_allclose(frames(found), frames(read(plain, tmp_path)), atol=1e-6)
    np.testing.assert_allclose(frames(found)[-1, 0], moved, atol=1e-6)
    assert found.not_carried == () and found.n_frames > 1


@pytest.mark.parametrize("path", ["/nodes/0/weights", "/meshes/0/weights"])
def test_pointers_to_weights(path: str, tmp_path: Path) -> None:
    file = File()
    square = {**file.square(), "targets": [{"POSITION": file.floats(np.full((4, 3), 2.0))}]}
    file.add("nodes", {"mesh": file.mesh(square)})
    animate(file, pointer(file, path, [0, 1], file.floats([[0], [1]])))
    assert frames(read(file, tmp_path))[-1, 0].tolist() == [2, 2, 2]


def test_pointers_to_other_things_are_named(tmp_path: Path) -> None:
    file = File()
    file.add("materials", {"name": "a"})
    file.add("nodes", {"mesh": file.mesh({**file.square(), "material": 0})})
    animate(
        file,
        pointer(file, "/nodes/0/translation", [0, 1], file.floats([[0, 0, 0], [1, 0, 0]])),
        pointer(file, "/materials/0/pbrMetallicRoughness/baseColorFactor", [0, 1], file.floats([[0, 0, 0, 1], [1, 0, 0, 1]])),
    )
    found = read(file, tmp_path)
    assert found.not_carried == ("animation of /materials/*/pbrMetallicRoughness/baseColorFactor",)
    assert any("not carried: animation of /materials/*" in note for note in found.notes)


@pytest.mark.parametrize("moves", [False, True])
def test_clips_that_are_not_read_lose_nothing_unsaid(moves: bool, tmp_path: Path) -> None:
    file = File()
    file.add("materials", {"name": "a"})
    file.add("nodes", {"mesh": file.mesh({**file.square(), "material": 0})})
    animate(file, pointer(file, "/materials/0/emissiveFactor", [0, 1], file.floats([[0, 0, 0], [1, 0, 0]])))
    if moves:
        animate(file, pointer(file, "/nodes/0/translation", [0, 1], file.floats([[0, 0, 0], [1, 0, 0]])))
    assert read(file, tmp_path).not_carried == ("animation of /materials/*/emissiveFactor",)


def test_a_pointer_to_no_node(tmp_path: Path) -> None:
    file = File()
    file.add("nodes", {"mesh": file.mesh(file.square())})
    animate(file, pointer(file, "/nodes/7/translation", [0, 1], file.floats([[0, 0, 0], [1, 0, 0]])))
    with pytest.raises(InputError, match="moves node 7, but there are only 1"):
        read(file, tmp_path)


def invisible(is_visible: bool = False) -> dict[str, Any]:
    return {"extensions": {VISIBILITY: {"visible": is_visible}}}


def test_invisible_nodes_hide_what_hangs_on_them(tmp_path: Path) -> None:
    file = File()
    mesh = file.mesh(file.square())
    file.tree["nodes"] = [
        {"children": [1], **invisible()},
        {"mesh": mesh, **invisible(True)},
        {"mesh": mesh, "translation": [3, 0, 0]},
    ]
    file.tree["scenes"] = [{"nodes": [0, 2]}]
    found = read(file, tmp_path)
    assert found.n_vertices == 4 and found.read(0, 1)[0, 0].tolist() == [3, 0, 0]
    assert "1 of 2 meshes are hidden; they were left out" in found.notes


def test_a_file_that_shows_nothing_shows_all(tmp_path: Path) -> None:
    file = File()
    file.add("nodes", {"mesh": file.mesh(file.square()), **invisible()})
    found = read(file, tmp_path)
    assert found.n_vertices == 4 and any("all of its meshes are hidden" in note for note in found.notes)
    assert np.ptp(frames(found), axis=1).max() == 1


@pytest.mark.parametrize("above", [False, True])
def test_visibility_that_changes(above: bool, tmp_path: Path) -> None:
    """A hidden mesh is a point, in its own middle."""
    file = File()
    mesh = file.mesh(file.square())
    file.tree["nodes"] = [{"children": [1], "translation": [4, 0, 0]}, {"mesh": mesh}, {"mesh": mesh}]
    file.tree["scenes"] = [{"nodes": [0, 2]}]
    values = file.array(np.array([1, 0, 1], np.uint8))
    animate(file, pointer(file, f"/nodes/{0 if above else 1}/extensions/{VISIBILITY}/visible", [0, 1, 2], values, "STEP"))
    found = read(file, tmp_path)
    extent = np.ptp(frames(found)[:, :4], axis=1).max(axis=1)  # of the first mesh
    seconds = np.arange(found.n_frames) / found.fps
    assert extent.tolist() == [0.0 if 1 <= second < 2 else 1.0 for second in seconds]
    assert frames(found)[found.n_frames // 2, 0].tolist() == [4.5, 0.5, 0]
    assert np.ptp(frames(found)[:, 4:], axis=1).max(axis=1).min() == 1
    assert any("1 mesh is hidden in some frames" in note for note in found.notes)
    gvpipe.encode(found, tmp_path / "a.mp4", codec="pca")
    assert np.abs(gvpipe.decode(tmp_path / "a.mp4").read(0, found.n_frames) - frames(found)).max() < 0.05


def test_instances(tmp_path: Path) -> None:
    file = File()
    attributes = {
        "TRANSLATION": file.floats([[1, 0, 0], [2, 0, 0], [3, 0, 0]]),
        "ROTATION": file.floats([[0, 0, 0, 1], [0, 0, 1, 0], [0, 0, 0, 1]]),
        "SCALE": file.floats([[1, 1, 1], [1, 1, 1], [2, 2, 2]]),
    }
    instancing = {"extensions": {"EXT_mesh_gpu_instancing": {"attributes": attributes}}}
    file.add("nodes", {"mesh": file.mesh(file.square()), "translation": [0, 0, 5], **instancing})
    file.tree["extensionsRequired"] = ["EXT_mesh_gpu_instancing"]
    found = read(file, tmp_path)
    assert found.not_carried == () and found.n_vertices == 12 and len(found.parts) == 3
    corners = found.read(0, 1)[0].reshape(3, 4, 3)
    np.testing.assert_allclose(corners[:, 0], [[1, 0, 5], [2, 0, 5], [3, 0, 5]], atol=1e-6)
    np.testing.assert_allclose(corners[:, 3], [[2, 1, 5], [1, -1, 5], [5, 2, 5]], atol=1e-6)


def test_instances_that_cannot_be(tmp_path: Path) -> None:
    file = File()
    attributes = {"TRANSLATION": file.floats([[1, 0, 0]]), "SCALE": file.floats([[1, 1, 1], [1, 1, 1]])}
    file.add("nodes", {"mesh": file.mesh(file.square()), "extensions": {"EXT_mesh_gpu_instancing": {"attributes": attributes}}})
    with pytest.raises(InputError, match="translations, rotations and scales of instances"):
        read(file, tmp_path)


def test_what_is_not_known_is_named(tmp_path: Path) -> None:
    """By whatever name it has: nothing in the reader lists these."""
    file = File()
    square = file.square(FEATURE_ID_0=file.floats(np.zeros(4)))
    square |= {"material": 0, "targets": [{"POSITION": file.floats(np.ones((4, 3))), "COLOR_0": file.floats(np.ones((4, 3)))}]}
    file.add("materials", {"extensions": {"KHR_materials_of_tomorrow": {}, "ACME_paint": {}}})
    file.add("cameras", {"type": "perspective"})
    file.tree["nodes"] = [{"mesh": file.mesh(square), "extensions": {"ACME_physics": {}}}, {"camera": 0}]
    file.tree["extensions"] = {"KHR_lights_punctual": {"lights": []}}
    found = read(file, tmp_path)
    assert found.not_carried == (
        "COLOR_0 of morph targets", "cameras", "extension ACME_paint", "extension ACME_physics",
        "extension KHR_lights_punctual", "material extension KHR_materials_of_tomorrow", "vertex attribute FEATURE_ID_0",
    )  # fmt: skip
    report = gvpipe.encode(found, tmp_path / "a.mp4", codec="pca")
    assert report.not_carried == list(found.not_carried)
    assert gvpipe.info(tmp_path / "a.mp4").not_carried == list(found.not_carried)


def layered() -> Material:
    """A material with a value of its own in every layer."""
    changes: dict[str, Any] = {}
    for number, field in enumerate(field_name(member) for members in LAYERS.values() for member in members):
        default = next(each.default for each in dataclasses.fields(Material) if each.name == field)
        if default is None:
            changes[field] = Texture(0, scale=0.5 if field.endswith("normal_texture") else 1.0)
        elif isinstance(default, tuple):
            changes[field] = (0.25, 0.5, (number + 1) / 100)
        else:
            changes[field] = (number + 1) / 50
    return Material("all", **changes, emissive=(0.5, 0.25, 0.0), emissive_strength=3.0)


def dressed(material: Material) -> MeshSequence:
    import io

    file = io.BytesIO()
    Image.new("RGB", (4, 4), (9, 8, 7)).save(file, "PNG")
    positions = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]], np.float32)
    return MeshSequence(
        positions, np.array([[0, 1, 2]]), attributes={"uv": np.array([[0, 0], [1, 0], [0, 1]], np.float32)},
        parts=(gvpipe.Part("a", (0, 3), (0, 1), 0),), materials=(material,),
        images=(gvpipe.Image("a", "image/png", file.getvalue()),),
    )  # fmt: skip


def materials_of(path: Path) -> list[dict[str, Any]]:
    data = path.read_bytes()
    size = struct.unpack_from("<I", data, 12)[0]
    found: list[dict[str, Any]] = json.loads(data[20 : 20 + size])["materials"]
    return found


def test_layers_of_materials_come_back(tmp_path: Path) -> None:
    """Through glTF, through a geometry video, and through an archive."""
    given = dressed(layered())
    gvpipe.write(given, tmp_path / "a.glb")
    assert gvpipe.read(tmp_path / "a.glb").materials == given.materials
    gvpipe.encode(given, tmp_path / "a.mp4", codec="pca")
    assert gvpipe.open(tmp_path / "a.mp4").materials == given.materials
    gvpipe.write(gvpipe.decode(tmp_path / "a.mp4"), tmp_path / "b.glb")
    assert materials_of(tmp_path / "b.glb") == materials_of(tmp_path / "a.glb")
    assert set(materials_of(tmp_path / "b.glb")[0]["extensions"]) == {*LAYERS, "KHR_materials_emissive_strength"}
    gvpipe.write(given, tmp_path / "a.npz")
    assert gvpipe.read(tmp_path / "a.npz").materials == given.materials


def test_a_material_without_layers_has_no_extensions(tmp_path: Path) -> None:
    gvpipe.write(dressed(Material("plain", emissive=(1.0, 0.5, 0.0))), tmp_path / "a.glb")
    assert "extensions" not in materials_of(tmp_path / "a.glb")[0]


def test_the_strength_of_emission(tmp_path: Path) -> None:
    """A strength without a colour shows nothing, and stays; a colour above 1 needs a strength."""
    for emissive, strength, written in (((0.0, 0.0, 0.0), 4.0, 4.0), ((6.0, 3.0, 0.0), 1.0, 6.0), ((0.5, 0.0, 0.0), 0.5, 0.5)):
        given = dressed(Material("a", emissive=emissive, emissive_strength=strength))
        gvpipe.write(given, tmp_path / "a.glb")
        extensions = materials_of(tmp_path / "a.glb")[0]["extensions"]
        assert extensions == {"KHR_materials_emissive_strength": {"emissiveStrength": written}}
        assert gvpipe.read(tmp_path / "a.glb").materials[0].emissive == emissive
    with pytest.raises(InputError, match="ior is nan; a finite number is needed"):
        dressed(Material(ior=float("nan")))


def test_layers_that_usd_has(tmp_path: Path) -> None:
    pytest.importorskip("pxr")
    given = dressed(Material("a", clearcoat=0.75, clearcoat_roughness=0.25, ior=1.25, clearcoat_texture=Texture(0)))
    gvpipe.write(given, tmp_path / "a.usda")
    found = gvpipe.read(tmp_path / "a.usda").materials[0]
    assert (found.clearcoat, found.clearcoat_roughness, found.ior) == (0.75, 0.25, 1.25)
    assert found.clearcoat_texture is not None and found.clearcoat_roughness_texture is None


def test_extras_instances_and_meshes_that_no_scene_shows(tmp_path: Path) -> None:
    file = square_file()
    tree = file.tree
    place = file.floats([[0, 0, 0], [3, 0, 0]])
    heat = file.floats([1, 2])
    given = {"attributes": {"TRANSLATION": place, "_HEAT": heat}}
    tree["nodes"][0] |= {"extensions": {"EXT_mesh_gpu_instancing": given}, "extras": {"mass": 3}}
    tree["nodes"].append({"mesh": 0})
    tree["scenes"] = [{"nodes": [0]}, {"nodes": [0, 1]}]
    found = read(file, tmp_path)
    assert found.not_carried == ("attribute _HEAT of instances", "extras 'mass'", "meshes outside of the scene", "other scenes")


def test_clips_of_cameras_are_not_the_mesh_s(tmp_path: Path) -> None:
    file = square_file()
    file.add("nodes", {"camera": 0})
    file.tree["cameras"] = [{"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}}]
    file.tree["scenes"] = [{"nodes": [0, 1]}]
    file.clip((1, "translation", [0, 1], [[0, 0, 0], [9, 0, 0]], "LINEAR"), name="cam")
    still = read(file, tmp_path)
    assert still.n_frames == 1 and still.not_carried == ("animation of nodes without a mesh", "cameras")
    file.clip((0, "translation", [0, 1], [[0, 0, 0], [9, 0, 0]], "LINEAR"), name="walk")
    moving = read(file, tmp_path)
    assert moving.metadata.texts["clip"] == "walk" and moving.read(30, 31)[0, 0, 0] == 9


def test_matrices_of_vertices_are_named(tmp_path: Path) -> None:
    file = square_file()
    file.tree["meshes"][0]["primitives"][0]["attributes"]["_M"] = file.floats(np.zeros((4, 16)))
    assert read(file, tmp_path).not_carried == ("vertex attribute _M",)


def test_one_light_is_one(tmp_path: Path) -> None:
    file = square_file()
    lights = "KHR_lights_punctual"
    file.tree["extensions"] = {lights: {"lights": [{"type": "point"}]}}
    file.tree["nodes"][0]["extensions"] = {lights: {"light": 0}}
    assert read(file, tmp_path).not_carried == (f"extension {lights}",)
