"""The package on npm's form: what it holds, its types, and pages that use it as the documentation shows."""

from __future__ import annotations

import io
import json
import re
import shutil
import subprocess
import tarfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import browsers
import npm_project
import numpy as np
import pages
import pytest
from folders import ROOT
from npm_project import GUIDE, README, WEB
from PIL import Image
from sequences import waving

import gvpipe

NPM = ROOT / "tests" / "web" / "npm"
slow = pytest.mark.slow
needs_npm = pytest.mark.skipif(bool(npm_project.missing()), reason=npm_project.missing())
VITE_EXAMPLES = {  # name of a page -> heading and language of its code, and the packages that it needs
    "three": ("three.js", "js", ["three"]),
    "react": ("react-three-fiber", "jsx", ["three", "react", "react-dom", "@react-three/fiber"]),
    "babylon": ("Babylon.js", "js", ["@babylonjs/core"]),
}
ELEMENT = """import "gvpipe/element";
document.body.innerHTML = '<geometry-video src="walk.mp4" autoplay loop style="height: 500px"></geometry-video>';"""


@pytest.fixture(scope="module")
def packed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The package's file."""
    return npm_project.pack(tmp_path_factory.mktemp("packed"))


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    if missing := browsers.missing():
        pytest.skip(missing)
    with browsers.browser("chromium", tmp_path_factory.mktemp("profile")) as driver:
        yield driver


def write_walk(path: Path) -> Path:
    """A sheet within the unit ball, which moves in every frame."""
    moving = waving(12, 40)
    positions = moving.positions[:]
    low, high = positions.min(axis=(0, 1)), positions.max(axis=(0, 1))
    within = (positions - (low + high) / 2) / np.linalg.norm(high - low) * 2
    gvpipe.encode(gvpipe.MeshSequence(within, moving.faces, 24.0), path, **pages.FAST)
    return path


def check_motion(browser: Any, address: str) -> None:
    """The page shows something in front of its background, and soon something else."""
    browser.get(address)
    seen: set[bytes] = set()
    for _ in range(150):
        shot = np.asarray(Image.open(io.BytesIO(browser.get_screenshot_as_png())).convert("RGB"), int)[100:450, 50:-50]
        drawn = np.abs(shot - shot[0, 0]).max(axis=2) > 30
        if drawn.mean() > 0.02:
            assert drawn.mean() < 0.98
            seen.add(shot.tobytes())
        if len(seen) >= 3:
            return
        time.sleep(0.1)
    pytest.fail(f"{len(seen)} pictures; {browser.get_log('browser')}")


def test_its_version_is_gvpipes() -> None:
    package = json.loads((WEB / "package.json").read_text("utf-8"))
    lock = json.loads((WEB / "package-lock.json").read_text("utf-8"))
    assert package["version"] == lock["version"] == lock["packages"][""]["version"] == gvpipe.__version__
    assert package["peerDependencies"].keys() == {"three"}


def test_examples_are_short_and_the_same() -> None:
    for heading, language, _ in VITE_EXAMPLES.values():
        assert npm_project.example(heading, language).count("\n") <= 30
    assert npm_project.example("A scene of three.js", "js", README) == npm_project.example("three.js", "js")


@slow
@needs_npm
def test_contents(packed: Path) -> None:
    """README, licences, modules with types; three.js in the player alone."""
    with tarfile.open(packed) as archive:
        files = {name.removeprefix("package/"): archive.extractfile(name) for name in archive.getnames()}
        texts = {name: file.read().decode() for name, file in files.items() if file}
    package = json.loads(texts["package.json"])
    assert packed.name == f"gvpipe-{gvpipe.__version__}.tgz"
    for entry in package["exports"].values():
        for path in [entry] if isinstance(entry, str) else entry.values():
            assert path.removeprefix("./") in texts
    assert {"README.md", "LICENSE", "LICENSES/NOTICE.txt", "LICENSES/draco.txt", "LICENSES/three.txt"} <= texts.keys()
    modules = {name: text for name, text in texts.items() if name.endswith(".js")}
    assert [name for name, text in modules.items() if "THREE.WebGLRenderer:" in text] == ["dist/player.js"]
    imported = set().union(
        *(re.findall(r'^(?:import|export|}).* from "([^."][^"]*)";$', text, re.M) for text in modules.values())
    )
    addons = {"three/addons/controls/OrbitControls.js", "three/addons/environments/RoomEnvironment.js"}
    assert imported == {"three", *addons}
    bundle = (WEB / "bundle" / "player.js").read_text("utf-8")
    assert texts["dist/player.js"] == bundle


@slow
@pytest.mark.skipif(bool(npm_project.missing("typescript", "@types")), reason=npm_project.missing("typescript", "@types"))
def test_types(packed: Path, tmp_path: Path) -> None:
    """A strict compiler takes a project that uses them, and refuses what is wrong in it."""
    npm_project.make_project(packed, tmp_path)
    shutil.copy(NPM / "consumer.ts", tmp_path)
    options = {"strict": True, "noEmit": True, "module": "esnext", "moduleResolution": "bundler", "target": "es2022"}
    checked = {"lib": ["es2023", "dom", "dom.iterable"], "types": [], "skipLibCheck": True}
    types = [f"node_modules/gvpipe/dist/{path.name}" for path in (WEB / "types").iterdir()]
    (tmp_path / "tsconfig.json").write_text(
        json.dumps({"compilerOptions": {**options, **checked}, "files": ["consumer.ts", *types]})
    )
    found = subprocess.run(["node_modules/typescript/bin/tsc"], cwd=tmp_path, capture_output=True, text=True)
    assert found.returncode == 0, found.stdout


@slow
@pytest.mark.skipif(bool(npm_project.missing("vite", "three")), reason=npm_project.missing("vite", "three"))
def test_pages_that_vite_builds(packed: Path, browser: Any, tmp_path: Path) -> None:
    """The documentation's examples, and the element."""
    npm_project.make_project(packed, tmp_path)
    (tmp_path / "public").mkdir()
    write_walk(tmp_path / "public" / "walk.mp4")
    sources = {"element": ("js", ELEMENT)}
    for name, (heading, language, needed) in VITE_EXAMPLES.items():
        if not npm_project.missing(*needed):
            sources[name] = (language, npm_project.example(heading, language))
    for name, (suffix, source) in sources.items():
        (tmp_path / f"{name}.{suffix}").write_text(source)
        script = f'<script type="module" src="/{name}.{suffix}"></script>'
        (tmp_path / f"{name}.html").write_text(f'<!doctype html><body style="margin: 0">{script}</body>')
    inputs = json.dumps([f"{name}.html" for name in sources])
    options = f'{{ target: "es2022", rolldownOptions: {{ input: {inputs} }} }}'
    (tmp_path / "vite.config.js").write_text(f'export default {{ base: "./", build: {options} }}')
    built = subprocess.run(["node", "node_modules/vite/bin/vite.js", "build"], cwd=tmp_path, capture_output=True, text=True)
    assert built.returncode == 0, built.stderr
    with browsers.served(tmp_path / "dist") as address:
        for name in sources:
            check_motion(browser, f"{address}/{name}.html")


@slow
@needs_npm
def test_a_plain_page(packed: Path, browser: Any, tmp_path: Path) -> None:
    """The import map of the documentation; members of classes are those that the types declare."""
    npm_project.unpack(packed, tmp_path / "package_of_npm")
    shutil.copytree(tmp_path / "package_of_npm" / "dist", tmp_path / "gvpipe")
    (tmp_path / "three").symlink_to(WEB / "node_modules" / "three")
    write_walk(tmp_path / "walk.mp4")
    page = npm_project.example("Without a bundler", "html")
    (tmp_path / "page.html").write_text(page.replace("<title>", '<link rel="icon" href="data:,"><title>'))
    with browsers.served(tmp_path) as address:
        check_motion(browser, f"{address}/page.html")
        found = pages.run(
            browser,
            """const [{ Mesh, Loader }, { GeometryVideo, GeometryVideoLoader, GeometryVideoMesh }, own] =
              await Promise.all(["three", "gvpipe/three", "gvpipe"].map((name) => import(name)));
            const members = (object, base) => {
              const names = new Set(Object.keys(object));
              for (let type = object; type && type !== base.prototype; type = Object.getPrototypeOf(type)) {
                for (const name of Object.getOwnPropertyNames(type)) names.add(name);
              }
              const own = base === Mesh || base === Loader ? new base() : {};
              for (const name of Object.getOwnPropertyNames(own)) names.delete(name);
              return [...names];
            };
            const video = await GeometryVideo.load("walk.mp4");
            const mesh = await GeometryVideoMesh.create(video);
            const element = document.querySelector("geometry-video");
            return { same: own.GeometryVideo === GeometryVideo && element.video instanceof GeometryVideo,
              GeometryVideo: members(video, Object), GeometryVideoMesh: members(mesh, Mesh),
              GeometryVideoLoader: members(new GeometryVideoLoader(), Loader),
              GeometryVideoElement: members(element, HTMLElement) };""",
        )
    assert found.pop("same")
    hidden = {"constructor", "connectedCallback", "disconnectedCallback", "attributeChangedCallback"}
    for name, members in found.items():
        assert set(members) - hidden == declared(name), name


def declared(name: str) -> set[str]:
    """Members of a class in the types; static ones, and those that its base has, are left out."""
    text = "".join(path.read_text("utf-8") for path in (WEB / "types").iterdir())
    body = re.split(rf"export class {name}\b[^{{]*{{\n", text)[1].split("\n}")[0]
    names = re.findall(r"^  (?:readonly )?(\w+)(?:<[^>]*>)?[(:?]", body, re.MULTILINE)
    return set(names) - {"constructor", "addEventListener", "removeEventListener"}


def test_the_guide_names_every_entry() -> None:
    entries = json.loads((WEB / "package.json").read_text("utf-8"))["exports"]
    for entry in entries.keys() - {"./package.json"}:
        name = f"`gvpipe{entry.removeprefix('.')}`"
        assert name in GUIDE and name in README
