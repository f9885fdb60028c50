"""A project of a web developer: the package as npm packs it, beside packages that are installed for tests."""

from __future__ import annotations

import re
import shutil
import subprocess
import tarfile
from pathlib import Path

from folders import ROOT

WEB = ROOT / "gvpipe" / "web"
PACKAGES = ROOT / "tests" / "web" / "npm" / "node_modules"
GUIDE = (ROOT / "docs" / "web.md").read_text("utf-8")
README = (WEB / "README.md").read_text("utf-8")


def missing(*packages: str) -> str:
    """Why nothing can be packed, or what is not there to use it with; "" if all is."""
    if shutil.which("npm") is None:
        return "no npm"
    if not (WEB / "node_modules").exists():
        return "no packages; npm ci in gvpipe/web"
    absent = [name for name in packages if not (PACKAGES / name).exists()]
    return f"no {', '.join(absent)}; npm ci in tests/web/npm" if absent else ""


def pack(folder: Path) -> Path:
    """The package that ``npm pack`` writes, with what it is built from copied beside: nothing is written in the repository."""
    source = folder / "repository"
    copied = shutil.ignore_patterns("node_modules", "bundle", "__pycache__")
    shutil.copytree(WEB, source / "gvpipe" / "web", ignore=copied)
    shutil.copy(ROOT / "LICENSE", source)
    (source / "gvpipe" / "web" / "node_modules").symlink_to(WEB / "node_modules")
    subprocess.run(["npm", "pack", "--pack-destination", folder], cwd=source / "gvpipe/web", check=True, capture_output=True)
    (packed,) = folder.glob("*.tgz")
    return packed


def make_project(packed: Path, folder: Path) -> None:
    """A project with the package and those of tests in its ``node_modules``."""
    modules = folder / "node_modules"
    modules.mkdir(parents=True)
    for path in PACKAGES.glob("*"):
        (modules / path.name).symlink_to(path)
    unpack(packed, modules / "gvpipe")
    (folder / "package.json").write_text('{ "type": "module" }')


def unpack(packed: Path, folder: Path) -> None:
    with tarfile.open(packed) as archive:
        archive.extractall(folder.parent, filter="data")
    (folder.parent / "package").rename(folder)


def example(heading: str, language: str, page: str = GUIDE) -> str:
    """The code that a page shows below a heading."""
    below = page.split(f"\n## {heading}\n")[1].split("\n## ")[0]
    (code,) = re.findall(rf"```{language}\n(.*?)```", below, re.DOTALL)
    return str(code)
