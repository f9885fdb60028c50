"""The zips of the Blender extension: manifest, code, licence, wheels; without Blender and without a network."""

from __future__ import annotations

import ast
import importlib.util
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path
from typing import Any

import pytest
from folders import ROOT

import gvpipe

FOLDER = ROOT / "integrations" / "blender"
REQUIRED = {"schema_version", "id", "version", "name", "tagline", "maintainer", "type", "blender_version_min", "license"}


def build() -> Any:
    """``build.py`` as a module."""
    spec = importlib.util.spec_from_file_location("blender_build", FOLDER / "build.py")
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(("python", "newest"), [("3.11", "5.1.0"), ("3.13", None)])
@pytest.mark.parametrize("platform", ["linux-x64", "windows-x64", "macos-arm64"])
def test_zip_has_what_its_manifest_lists(tmp_path: Path, platform: str, python: str, newest: str | None) -> None:
    wheels = [tmp_path / "b-1.0-py3-none-any.whl", tmp_path / "a-1.0-py3-none-any.whl"]
    for wheel in wheels:
        wheel.write_bytes(b"wheel")
    build().pack(tmp_path / "extension.zip", platform, python, wheels)
    with zipfile.ZipFile(tmp_path / "extension.zip") as file:
        names = set(file.namelist())
        manifest = tomllib.loads(file.read("blender_manifest.toml").decode())
    assert set(manifest) >= REQUIRED and manifest["schema_version"] == "1.0.0" and manifest["type"] == "add-on"
    assert manifest["version"] == gvpipe.__version__ and manifest["platforms"] == [platform]
    assert manifest["license"] == ["SPDX:GPL-3.0-or-later"] and len(manifest["tagline"]) <= 64
    assert manifest.get("blender_version_max") == newest
    assert manifest["wheels"] == ["./wheels/a-1.0-py3-none-any.whl", "./wheels/b-1.0-py3-none-any.whl"]
    assert {name.removeprefix("./") for name in manifest["wheels"]} == {name for name in names if name.endswith(".whl")}
    assert {"__init__.py", "playing.py", "LICENSE", "README.md"} <= names and "build.py" not in names


def test_modules_import_each_other_blender_and_gvpipe_alone() -> None:
    known = {"bpy", "bpy_extras", "gvpipe", "numpy", *sys.stdlib_module_names}
    for path in FOLDER.glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                assert {each.name.split(".")[0] for each in node.names} <= known, path
            if isinstance(node, ast.ImportFrom) and not node.level:
                assert str(node.module).split(".")[0] in known, path


def test_help_is_the_docstring() -> None:
    done = subprocess.run([sys.executable, str(FOLDER / "build.py"), "--help"], capture_output=True, text=True, check=True)
    assert "Build the Blender extension: one zip for each platform" in done.stdout
