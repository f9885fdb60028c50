"""The mesh of three.js: what it draws is the video's, and the application's clock leads."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import browsers
import npm_project
import numpy as np
import pages
import pytest
from asset_files import picture, write_asset
from sequences import waving

import gvpipe
from gvpipe.model.warp import warped

REASON = browsers.missing() or npm_project.missing()
pytestmark = [pytest.mark.slow, pytest.mark.skipif(bool(REASON), reason=REASON)]
PAGE = """<!doctype html><link rel="icon" href="data:,"><script type="importmap">{ "imports": {
"three": "./three/build/three.module.js", "three/addons/": "./three/examples/jsm/", "gvpipe/three": "./gvpipe/three.js" } }
</script>"""
START = f"""{pages.TEXT} const THREE = await import("three");
    const {{ GeometryVideo, GeometryVideoError, GeometryVideoLoader, GeometryVideoMesh }} = await import("gvpipe/three");
    const load = (name, options = {{}}) => new GeometryVideoLoader().setOptions(options).loadAsync(name);
    const rest = () => new Promise((resolve) => setTimeout(resolve, 20));
    const pass = async (mesh, seconds, step = 1 / 24) => {{
      for (let time = 0; time < seconds; time += step) {{ mesh.update(step); await rest(); }}
    }};
    const array = (mesh, name) => text(mesh.geometry.attributes[name].array.slice());"""
Run = Callable[..., Any]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A page with three.js and the package, beside a video of a second."""
    folder = tmp_path_factory.mktemp("site")
    npm_project.unpack(npm_project.pack(tmp_path_factory.mktemp("packed")), folder / "unpacked")
    shutil.copytree(folder / "unpacked" / "dist", folder / "gvpipe")
    (folder / "three").symlink_to(npm_project.WEB / "node_modules" / "three")
    (folder / "page.html").write_text(PAGE)
    gvpipe.encode(waving(10, 24), folder / "x.mp4", **pages.FAST)
    return folder


@pytest.fixture(scope="module")
def driver(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Any:
    with browsers.browser("chromium", tmp_path_factory.mktemp("profile")) as driver, browsers.served(folder) as address:
        driver.get(f"{address}/page.html")
        yield driver


@pytest.fixture
def page(driver: Any) -> Run:
    return lambda body, *arguments: pages.run(driver, START + body, *arguments)


def test_positions_are_the_videos(page: Run, folder: Path) -> None:
    """In model units without options, else about a centre; normals are of unit length, and the bounds hold the motion."""
    found = page(
        """const mesh = await load("x.mp4");
        const placed = await load("x.mp4", { centre: [1, 2, 3], scale: 0.5 });
        const seen = [];
        for (const k of [0, 17, 5, 23]) {
          await Promise.all([mesh.seek(k), placed.seek(k)]);
          seen.push([array(mesh, "position"), array(placed, "position"), array(mesh, "normal"), mesh.currentFrame]);
        }
        const { min, max } = mesh.geometry.boundingBox;
        const indices = text(new Uint32Array(mesh.geometry.index.array));
        return [seen, [min.toArray(), max.toArray()], indices, mesh.material[0].type];"""
    )
    with gvpipe.open(folder / "x.mp4") as video:
        low, high = np.array(found[1])
        for (positions, placed, normals, shown), k in zip(found[0], [0, 17, 5, 23], strict=True):
            assert shown == k
            assert np.array_equal(pages.points(positions), video[k])
            assert np.abs(pages.points(placed) - (video[k].astype(float) - [1, 2, 3]) / 2).max() < 1e-6
            assert np.abs(np.linalg.norm(pages.points(normals), axis=1) - 1).max() < 1e-6
            assert (video[k] >= low - 1e-6).all() and (video[k] <= high + 1e-6).all()
        assert np.array_equal(pages.points(found[2]).view("<u4"), video.faces)
    assert found[3] == "MeshLambertMaterial"


def test_the_clock_is_the_applications(page: Run) -> None:
    """Frames follow ``update``: nothing moves without it, and a rate of 2 takes half of the time."""
    found = page(
        """const mesh = await load("x.mp4");
        const [frames, log] = [[], []];
        mesh.addEventListener("frame", ({ frame }) => frames.push(frame));
        const names = ["play", "playing", "pause", "ended", "seeking", "seeked"];
        for (const name of names) mesh.addEventListener(name, () => log.push(name));
        await mesh.play();
        await new Promise((resolve) => setTimeout(resolve, 300));
        const still = [frames.slice(), mesh.paused];
        await pass(mesh, 0.5);
        const half = [mesh.currentFrame, mesh.currentTime];
        mesh.pause();
        await pass(mesh, 0.3);
        const paused = mesh.currentFrame === half[0];
        await mesh.play();
        await pass(mesh, 1);
        const end = [mesh.ended, mesh.paused, mesh.currentTime, mesh.duration, log.splice(0)];
        const first = frames.slice();
        mesh.playbackRate = 2;
        mesh.loop = true;
        frames.length = 0;
        await mesh.play();
        await pass(mesh, 1.2);
        const turns = frames.filter((k, i) => i && k < frames[i - 1]).length;
        mesh.currentTime = 0.5;
        const sought = [mesh.seeking, mesh.paused];
        await new Promise((resolve) => mesh.addEventListener("seeked", resolve));
        sought.push(mesh.currentFrame, mesh.paused);
        mesh.dispose();
        return { still, half, paused, end, first, turns, sought };"""
    )
    assert found["still"] == [[], False]
    assert 10 <= found["half"][0] <= 12 and found["half"][1] == found["half"][0] / 24
    assert found["paused"]
    assert found["first"] == sorted(found["first"]) and len(set(found["first"])) >= 20
    assert found["end"] == [True, True, 1, 1, ["play", "playing", "pause", "play", "playing", "pause", "ended"]]
    assert found["turns"] == 2
    assert found["sought"] == [True, False, 12, False]


def test_materials_attributes_fields_and_parts(page: Run, folder: Path) -> None:
    y, x = np.divmod(np.arange(25), 5)
    points = np.c_[x / 4, y / 4, 0 * x].astype(np.float32)
    corner = np.flatnonzero((x < 4) & (y < 4))
    faces = np.concatenate([np.c_[corner, corner + 1, corner + 6], np.c_[corner, corner + 6, corner + 5]])
    sheet = gvpipe.MeshSequence(
        np.stack([points, points * np.array([1, 1.1, 1], np.float32)]),
        faces,
        attributes={"uv": points[:, :2]},
        fields={"height": gvpipe.Field(np.stack([points[:, 1], points[:, 0]]))},
        parts=(gvpipe.Part("left", (0, 25), (0, 16), 0), gvpipe.Part("right", (0, 25), (16, 32), None)),
        materials=(gvpipe.Material("paper", base_color_texture=gvpipe.Texture(0), roughness=0.25),),
        images=(gvpipe.Image("checks", "image/png", picture([[[255, 0, 0], [0, 255, 0]]])),),
    )
    write_asset(folder / "asset.mp4", sheet)
    found = page(
        """const mesh = await load("asset.mp4");
        const plain = await load("asset.mp4", { gloss: false });
        const look = ({ type, name, roughness, map }) => [type, name, roughness ?? null, map?.image.width ?? 0];
        const materials = mesh.material.map(look);
        const { groups } = mesh.geometry;
        const uv = array(mesh, "uv");
        const range = await mesh.showField("height", { colormap: "magma" });
        const shown = [mesh.material.type, mesh.geometry.attributes.uv3.itemSize];
        await mesh.seek(1);
        const high = Math.max(...mesh.geometry.attributes.uv3.array);
        await mesh.showField(null);
        const back = mesh.material.length;
        const none = await mesh.showField("speed").catch((error) => error.message);
        mesh.hide(["left"]);
        const drawn = mesh.geometry.drawRange.count;
        mesh.hide([]);
        const twin = mesh.clone();
        const clone = [twin.type, twin.geometry === mesh.geometry, twin.material[0] === mesh.material[0]];
        const ray = new THREE.Raycaster(new THREE.Vector3(0.3, 0.3, 5), new THREE.Vector3(0, 0, -1));
        const hits = ray.intersectObject(mesh).length;
        return { materials, gloss: plain.material[0].type, groups, uv, range, shown, high, back, none, drawn, clone, hits,
          names: mesh.partNames, notes: mesh.notes };"""
    )
    assert found["materials"] == [["MeshStandardMaterial", "paper", 0.25, 16], ["MeshLambertMaterial", "", None, 0]]
    assert found["gloss"] == "MeshLambertMaterial"
    assert [(group["start"], group["count"], group["materialIndex"]) for group in found["groups"]] == [(0, 48, 0), (48, 48, 1)]
    assert found["range"] == [0, 1] and found["shown"] == ["MeshLambertMaterial", 2] and 0.9 < found["high"] <= 1
    assert found["back"] == 2 and found["none"] == "there is no field 'speed'; fields: height"
    assert found["drawn"] == 48 and found["names"] == ["left", "right"] and found["notes"] == []
    assert found["clone"] == ["Mesh", True, True] and found["hits"] == 1


def test_a_field_moves_vertices(page: Run, folder: Path) -> None:
    """As Python's warped sequence, float32 for float32 in model units; bounds hold it, and normals follow."""
    sequence = waving(10, 6)
    random = np.random.default_rng(0)
    fields = {
        "disp": random.normal(size=(6, 100, 3)).astype(np.float32),
        "flat": random.normal(size=(6, 100, 2)),
        "heat": np.zeros((6, 100)),
    }
    video = write_asset(folder / "moved.mp4", gvpipe.MeshSequence(sequence.positions[:], sequence.faces, 24.0, fields=fields))
    found = page(
        """const mesh = await load("moved.mp4");
        const seen = [];
        for (const [name, scale, k] of args[0]) {
          const isShown = await mesh.setWarp(name, scale);
          await mesh.seek(k);
          const { min, max } = mesh.geometry.boundingBox;
          const [front, normals] = [array(mesh, "position"), array(mesh, "normal")];
          seen.push([isShown, front, normals, min.toArray(), max.toArray()]);
        }
        const none = await mesh.setWarp("heat").catch((error) => error.message);
        const two = await Promise.all([mesh.setWarp("disp", 9), mesh.setWarp(null)]);
        return [seen, none, two, array(mesh, "position")];""",
        [["disp", 0.5, 2], ["disp", -3, 5], ["flat", 1.5, 4], [None, 1, 1]],
    )
    wanted = [
        *(warped(video.sequence(), text).read(k, k + 1)[0] for text, k in (("disp:0.5", 2), ("disp:-3", 5), ("flat:1.5", 4))),
        video[1],
    ]
    for (is_shown, positions, normals, low, high), points in zip(found[0], wanted, strict=True):
        assert is_shown and np.abs(pages.points(positions) - points).max() <= 2 * np.spacing(np.abs(points).max())
        assert (points >= np.array(low) - 1e-5).all() and (points <= np.array(high) + 1e-5).all()
        sides = np.cross(*(points[video.faces[:, i]] - points[video.faces[:, 0]] for i in (1, 2)))
        sums = np.zeros((100, 3))
        np.add.at(sums, video.faces.ravel(), np.repeat(sides, 3, axis=0))
        assert np.abs(pages.points(normals) - sums / np.linalg.norm(sums, axis=1, keepdims=True)).max() < 1e-4
    assert "no field 'heat' of displacements" in found[1] and found[2] == [False, True]
    assert np.array_equal(pages.points(found[3]), video[1])


def test_points_without_triangles(page: Run, folder: Path) -> None:
    sequence = waving(8, 6)
    gvpipe.encode(gvpipe.MeshSequence(sequence.positions[:], np.zeros((0, 3), np.int32), 24.0), folder / "points.mp4")
    found = page(
        """const mesh = await load("points.mp4");
        await mesh.seek(3);
        const [points] = mesh.children;
        const { count } = mesh.geometry.attributes.position;
        return [points.isPoints, points.geometry === mesh.geometry, mesh.material.length, count];"""
    )
    assert found == [True, True, 0, 64]


def test_what_cannot_be_loaded(page: Run, folder: Path) -> None:
    (folder / "text.mp4").write_text("no video")
    found = page(
        """const manager = new THREE.LoadingManager();
        const [log, kinds] = [[], []];
        manager.onError = (url) => log.push(url);
        const loader = new GeometryVideoLoader(manager).setPath("./");
        for (const name of ["nothing.mp4", "text.mp4"]) {
          const error = await new Promise((resolve) => loader.load(name, null, null, resolve));
          kinds.push([error instanceof GeometryVideoError, error.kind]);
        }
        const mesh = await load("x.mp4");
        const rate = (() => { try { mesh.playbackRate = 99 } catch (error) { return error.name } })();
        const delta = (() => { try { mesh.update() } catch (error) { return error.message } })();
        mesh.dispose();
        mesh.dispose();
        const played = await mesh.play().catch((error) => error.name);
        await mesh.seek(3);
        return [kinds, log, rate, delta, mesh.paused, played];"""
    )
    assert found[0] == [[True, "load"], [True, "not-geometry-video"]]
    assert found[1] == ["./nothing.mp4", "./text.mp4"]
    assert found[2:] == ["NotSupportedError", "delta is undefined; a number of seconds is needed", True, "AbortError"]


def test_a_capture_is_one_mesh(page: Run, folder: Path) -> None:
    """Its geometry is that of the shot; the GPU keeps no other, and bounds hold the whole."""
    shots = [waving(side, 5) for side in (6, 9, 5, 8)]
    gvpipe.encode(gvpipe.Capture(shots, "four"), folder / "four.mp4", "pca")
    found = page(
        """const mesh = await load("four.mp4");
        const scene = new THREE.Scene().add(mesh);
        const renderer = new THREE.WebGLRenderer();
        const camera = new THREE.PerspectiveCamera();
        const changes = [];
        mesh.addEventListener("shotchange", ({ shot }) => changes.push(shot));
        const seen = [];
        for (const k of [...Array(20).keys(), 0, 12]) {
          await mesh.seek(k);
          renderer.render(scene, camera);
          seen.push([k, mesh.video.shot, mesh.geometry.attributes.position.count, array(mesh, "position")]);
        }
        const { geometries, textures } = renderer.info.memory;
        mesh.loop = true;
        await mesh.play();
        await pass(mesh, 1.2);
        const { min, max } = mesh.bounds;
        const result = [mesh.duration, changes.slice(0, 5), seen, geometries, textures, min, max];
        mesh.dispose();
        renderer.dispose();
        return [...result, changes.length];"""
    )
    duration, changes, seen, geometries, textures, low, high, n_changes = found
    assert duration == 20 / 24 and changes == [1, 2, 3, 0, 2] and n_changes > 5
    assert (geometries, textures) == (1, 0)
    with gvpipe.open_capture(folder / "four.mp4") as video:
        for k, shot, count, positions in seen:
            assert shot == k // 5 and count == len(video[k])
            assert np.array_equal(pages.points(positions), video[k])
            assert (video[k] >= np.float32(low)).all() and (video[k] <= np.float32(high)).all()
