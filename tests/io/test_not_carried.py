"""OBJ, MTL and PLY: what is met and not taken is named, in every place that lists it."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import gvpipe

SQUARE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nvt 1 1\nusemtl a\nf 1/1 2/2 3/3\nf 2/2 4/4 3/3\n"


def scan(folder: Path, n_frames: int = 3, shared: bool = False) -> Path:
    """Frames with a material file and a picture each, as scanners write them."""
    for frame in range(n_frames):
        Image.new("RGB", (8, 8), (80 * frame, 0, 0)).save(folder / f"t{frame}.png")
        (folder / f"m{frame}.mtl").write_text(f"newmtl a\nmap_Kd t{0 if shared else frame}.png\n")
        (folder / f"f{frame}.obj").write_text(f"mtllib m{frame}.mtl\n{SQUARE}")
    return folder


def test_materials_of_later_frames(tmp_path: Path, run: Any) -> None:
    found = gvpipe.read(scan(tmp_path))
    assert found.not_carried == () and found.images[0].pictures is not None  # a texture that moves
    (tmp_path / "m2.mtl").write_text("newmtl a\nmap_Kd t2.png\nKe 1 0 0\n")
    found = gvpipe.read(tmp_path)
    assert found.not_carried == ("materials and textures of later frames",)
    made = json.loads(run("encode", tmp_path, tmp_path / "a.mp4", "--codec", "pca", "--json").out)
    assert made["not_carried"] == ["materials and textures of later frames"]
    assert "materials and textures of later frames" in run("info", tmp_path / "a.mp4").out
    assert json.loads(run("info", tmp_path / "a.mp4", "--json").out)["not_carried"] == made["not_carried"]
    assert "materials and textures of later frames" in run("info", str(tmp_path / "f%d.obj")).err


def test_equal_materials_of_frames(tmp_path: Path) -> None:
    assert gvpipe.read(scan(tmp_path, shared=True)).not_carried == ()
    assert gvpipe.read(tmp_path / "f1.obj").not_carried == ()


def test_statements_of_obj(tmp_path: Path) -> None:
    text = f"# a comment\ns 1\n{SQUARE}s 3\nl 1 2 3\nl 2 3\np 1\ncurv 0 1 1 2\nACME thing\n"
    (tmp_path / "a.obj").write_text(text)
    named = ("statement 'ACME'", "statement 'curv'", "statement 'l' (2)", "statement 'p'", "statement 's'")
    assert gvpipe.read(tmp_path / "a.obj").not_carried == named
    (tmp_path / "b.obj").write_text(f"s off\ng group\no thing\n{SQUARE}")
    assert gvpipe.read(tmp_path / "b.obj").not_carried == ()


def test_statements_of_material_files(tmp_path: Path) -> None:
    mtl = "newmtl a\nKd 1 1 1\nNi 1.5\nillum 2\nPc 0.5\nPcr 0.25\nPs 0.125\naniso 0.5\nTf 1 0 0\nacme 7\n"
    (tmp_path / "m.mtl").write_text(mtl)
    (tmp_path / "a.obj").write_text(f"mtllib m.mtl\n{SQUARE}")
    found = gvpipe.read(tmp_path / "a.obj")
    assert found.not_carried == ("material statement acme", "material statement tf")
    (material,) = found.materials
    assert (material.clearcoat, material.clearcoat_roughness, material.anisotropy_strength) == (0.5, 0.25, 0.5)
    assert material.sheen_color == (0.125,) * 3
    gvpipe.write(found, tmp_path / "out.obj")
    assert gvpipe.read(tmp_path / "out.obj").materials[0].clearcoat == 0.5


def ply(strips: list[list[int]], binary: bool, extra: str = "") -> bytes:
    """A file of triangle strips."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0, 2, 0], [1, 2, 0]], "<f4")
    form = "binary_little_endian" if binary else "ascii"
    head = f"ply\nformat {form} 1.0\nelement vertex 6\nproperty float x\nproperty float y\nproperty float z\n"
    head += f"element tristrips {len(strips)}\nproperty list int int vertex_indices\n{extra}end_header\n"
    if binary:
        return head.encode() + points.tobytes() + b"".join(np.array([len(strip), *strip], "<i4").tobytes() for strip in strips)
    rows = [*(" ".join(map(str, point)) for point in points.tolist()), *(" ".join(map(str, [len(s), *s])) for s in strips)]
    return (head + "\n".join(rows) + "\n").encode()


STRIPS = {
    "one": ([[0, 1, 2, 3]], [[0, 1, 2], [1, 3, 2]]),
    "ended by -1": ([[0, 1, 2, -1, 2, 3, 4, 5, -1]], [[0, 1, 2], [2, 3, 4], [3, 5, 4]]),
    "several": ([[0, 1, 2], [2, 3, 4], []], [[0, 1, 2], [2, 3, 4]]),
    "joined by empty triangles": ([[0, 1, 2, 2, 3, 3, 4, 5]], [[0, 1, 2], [3, 4, 5]]),
    "short ones": ([[0, 1, -1, 0, 1, 2], [3, 4], [1, 3, 2]], [[0, 1, 2], [1, 3, 2]]),
}


@pytest.mark.parametrize("binary", [False, True])
@pytest.mark.parametrize(("strips", "faces"), STRIPS.values(), ids=STRIPS)
def test_triangle_strips_of_ply(strips: list[list[int]], faces: list[list[int]], binary: bool, tmp_path: Path) -> None:
    if not binary and any(not strip for strip in strips):
        strips = [strip for strip in strips if strip]
    (tmp_path / "a.ply").write_bytes(ply(strips, binary))
    found = gvpipe.read(tmp_path / "a.ply")
    made = [sorted(face) for face in found.faces.tolist()]
    assert made == [sorted(face) for face in faces] and found.not_carried == ()
    normals = np.cross(*(found.read(0, 1)[0][found.faces[:, k]] - found.read(0, 1)[0][found.faces[:, 0]] for k in (1, 2)))
    assert (normals[:, 2] > 0).all()  # none is turned round


def test_other_elements_of_ply(tmp_path: Path) -> None:
    data = ply([[0, 1, 2, 3]], False, "element edge 2\nproperty int a\nproperty int b\n")
    (tmp_path / "a.ply").write_bytes(data + b"0 1\n1 2\n")
    assert gvpipe.read(tmp_path / "a.ply").not_carried == ("element 'edge' (2)",)


def test_numbers_that_only_later_frames_have(tmp_path: Path) -> None:
    head = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n{}element face 1\n"
    head += "property list uchar int vertex_indices\nend_header\n"
    rows = ["0 0 0", "1 0 0", "0 1 0"]
    for frame in range(3):
        more = "property float heat\n" if frame else ""
        lines = [f"{row} {frame}" if frame else row for row in rows]
        (tmp_path / f"f{frame}.ply").write_text(head.format(more) + "\n".join([*lines, "3 0 1 2"]) + "\n")
    found = gvpipe.read(tmp_path)
    assert found.not_carried == ("heat of later frames",) and any("heat of later frames" in note for note in found.notes)


def test_what_each_frame_of_obj_shows(tmp_path: Path) -> None:
    (tmp_path / "m.mtl").write_text("newmtl a\nKd 1 0 0\nnewmtl b\nKd 0 1 0\n")
    head = "mtllib m.mtl\n"
    for frame, name in enumerate("aab"):
        (tmp_path / f"f{frame}.obj").write_text(head + SQUARE.replace("usemtl a", f"usemtl {name}"))
    assert gvpipe.read(tmp_path).not_carried == ("materials and textures of later frames",)
    (tmp_path / "f2.obj").write_text(head + SQUARE.replace("vt 1 1", "vt 1 0.5") + "l 1 2\n")
    assert gvpipe.read(tmp_path).not_carried == ("uv of later frames", "statement 'l'")


def test_what_each_frame_of_ply_shows(tmp_path: Path) -> None:
    head = "ply\nformat ascii 1.0\ncomment TextureFile {}.png\ncomment made by hand\nobj_info num_cols 4\nelement vertex 3\n"
    head += "".join(f"property float {name}\n" for name in ("x", "y", "z", "s", "t"))
    head += "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    for frame in range(3):
        Image.new("RGB", (8, 8), (80 * frame, 0, 0)).save(tmp_path / f"{frame}.png")
        rows = f"0 0 0 0 0\n1 0 0 1 0\n0 1 0 0 {1 - frame / 4}\n3 0 1 2\n"
        (tmp_path / f"f{frame}.ply").write_text(head.format(frame) + rows)
    found = gvpipe.read(str(tmp_path / "f%d.ply"))
    assert found.not_carried == ("uv of later frames", "materials and textures of later frames")
    assert found.metadata.texts == {"comment": "made by hand", "obj_info": "num_cols 4"}


def test_what_each_frame_of_gltf_shows(tmp_path: Path) -> None:
    walk = gvpipe.read(scan(tmp_path, n_frames=1))
    for frame in range(3):
        color = (1.0, 1.0, 1.0, 1.0) if frame < 2 else (1.0, 0.0, 0.0, 1.0)
        uv = np.array(walk.attributes["uv"].values) / (1 + frame)
        looks = tuple(replace(each, base_color=color) for each in walk.materials)
        still = replace(walk, positions=walk.read(0, 1), attributes={"uv": uv}, materials=looks)
        gvpipe.write(still, tmp_path / f"g{frame}.glb")
    found = gvpipe.read(str(tmp_path / "g%d.glb")).not_carried
    assert found == ("uv of later frames", "materials and textures of later frames")


def test_options_of_material_files(tmp_path: Path) -> None:
    Image.new("RGB", (8, 8)).save(tmp_path / "t.png")
    said = "Ka 1 1 1\nKs 0.5 0.5 0.5\nmap_Ka t.png\nillum 2\nNi 1.0\nmap_Kd -mm 0 1 -s 2 2 1 -o 0 0 0 -blendu on t.png\n"
    (tmp_path / "m.mtl").write_text(f"newmtl a\n{said}")
    (tmp_path / "a.obj").write_text(f"mtllib m.mtl\n{SQUARE.replace('vt 1 1', 'vt 1 1 0')}")
    found = gvpipe.read(tmp_path / "a.obj")
    assert found.not_carried == () and found.materials[0].ior == 1.5
    said = "Ka 1 1 1\nKs 0.5 0 0\nillum 4\nNi 1.33\nmap_Kd -mm 0.5 2 -s 2 2 3 -t 0.1 -blendu off t.png\nmap_Ke -bm 2 t.png\n"
    (tmp_path / "m.mtl").write_text(f"newmtl a\n{said}")
    (tmp_path / "a.obj").write_text(f"mtllib m.mtl\n{SQUARE.replace('vt 1 1', 'vt 1 1 0.5')}")
    found = gvpipe.read(tmp_path / "a.obj")
    named = {"-blendu": "kd", "-bm": "ke", "-mm": "kd", "-s": "kd", "-t": "kd"}
    options = tuple(f"option {name} of map_{of}" for name, of in named.items())
    statements = tuple(f"material statement {name}" for name in ("illum", "ks"))
    assert found.not_carried == ("third numbers of 'vt'", *statements, *options)
    assert found.materials[0].ior == 1.33
    gvpipe.write(found, tmp_path / "out.obj")
    assert gvpipe.read(tmp_path / "out.obj").materials[0].ior == 1.33


def test_smoothing_of_some_faces(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text(SQUARE.replace("f 2", "s off\nf 2").replace("usemtl a", "s 1"))
    assert gvpipe.read(tmp_path / "a.obj").not_carried == ("smoothing of some faces alone",)


def test_later_colours_of_obj(tmp_path: Path) -> None:
    (tmp_path / "0.obj").write_text(SQUARE)
    (tmp_path / "1.obj").write_text(SQUARE.replace("v 0 0 0", "v 0 0 0 1 0 0"))
    assert gvpipe.read(tmp_path).not_carried == ("color of later frames",)


def test_texture_coordinates_of_some_faces_of_ply(tmp_path: Path) -> None:
    head = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty float s\n"
    head += "property float t\nelement face 2\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\n"
    rows = "0 0 0 9 9\n1 0 0 9 9\n0 1 0 9 9\n1 1 0 9 9\n3 0 1 2 6 0.5 0 1 0 0 1\n3 1 3 2 0\n"
    (tmp_path / "a.ply").write_text(f"{head}end_header\n{rows}")
    found = gvpipe.read(tmp_path / "a.ply")
    uv = found.attributes["uv"]
    assert np.asarray(uv.values)[np.asarray(uv.indices)].tolist() == [[0.5, 0], [1, 0], [0, 1], [0, 0], [0, 0], [0, 0]]
    assert found.not_carried == ("s, t",)


def test_colours_of_some_faces_of_off(tmp_path: Path) -> None:
    (tmp_path / "a.off").write_text("OFF\n4 2 0\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n3 0 1 2 255 0 0\n3 1 3 2\n")
    found = gvpipe.read(tmp_path / "a.off")
    assert np.asarray(found.attributes["color"].values).tolist() == [[255, 0, 0, 255], [255, 255, 255, 255]]
    (tmp_path / "b.off").write_text("OFF\n3 1 0\n0 0 0 1 0 0 1\n1 0 0 0 1 0 1\n0 1 0 0 0 1 1\n3 0 1 2 7\n")
    found = gvpipe.read(tmp_path / "b.off")
    assert found.not_carried == ("colours of faces by a palette",) and "color" in found.attributes
    (tmp_path / "c.off").write_text("COFF\n3 1 0\n0 0 0 1 0 0\n1 0 0 0 1\n0 1 0 0 0 1\n3 0 1 2\n")
    assert gvpipe.read(tmp_path / "c.off").not_carried == ("numbers of vertices behind their coordinates",)


def test_colours_of_stl(tmp_path: Path) -> None:
    gvpipe.write(gvpipe.MeshSequence(np.eye(3, dtype=np.float32)[None], np.array([[0, 1, 2]], np.int32)), tmp_path / "a.stl")
    assert gvpipe.read(tmp_path / "a.stl").not_carried == ()
    data = (tmp_path / "a.stl").read_bytes()
    (tmp_path / "a.stl").write_bytes(data[:-2] + b"\x1f\x80")
    assert gvpipe.read(tmp_path / "a.stl").not_carried == ("colours of triangles",)
