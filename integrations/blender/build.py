"""Build the Blender extension: one zip for each platform, with the wheels that it needs.

It asks PyPI for wheels of other platforms by pip, and makes gvpipe's from the folder above. Blender has NumPy.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Sequence
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
PLATFORMS = {  # Blender's name: tags of wheels, newest system first
    "linux-x64": ("manylinux_2_28_x86_64", "manylinux_2_27_x86_64", "manylinux_2_17_x86_64", "manylinux2014_x86_64"),
    "windows-x64": ("win_amd64",),
    "macos-arm64": ("macosx_14_0_arm64", "macosx_13_0_arm64", "macosx_12_0_arm64", "macosx_11_0_arm64"),
}
BLENDERS = {"3.11": ("4.2.0", "5.1.0"), "3.13": ("5.1.0", "")}  # oldest with this Python, and the first that has a newer one
# What reading, writing, skins and OBJ, PLY, STL and GLB files import. SciPy of NumPy 1.24, which Blender 4.2 has. Left out:
# OpenCV (JPEG pictures), readers of USD, Alembic and FBX (Blender has its own), click and rich (the command line).
REQUIREMENTS = (
    "scipy>=1.15,<1.16",
    "numba>=0.60,<0.69",
    "llvmlite",
    "av>=18",
    "DracoPy>=2",
    "threadpoolctl>=3.5",
    "pillow>=10.1",
    "trimesh>=4.6.1",
    "pyfqmr>=0.5",
    "xatlas>=0.0.11",
)
SOURCES = ("*.py", "LICENSE", "README.md")  # beside the manifest


def version() -> str:
    """gvpipe's version, which is the extension's."""
    found = re.search(r'__version__ = "([^"]+)"', (ROOT / "gvpipe/foundation/version.py").read_text(encoding="utf-8"))
    assert found
    return found.group(1)


def manifest(platform: str, python: str, wheels: Sequence[str]) -> str:
    """The manifest of a zip: the folder's, with its version, platform, range of Blenders and the names of its wheels."""
    oldest, newer = BLENDERS[python]
    text = (HERE / "blender_manifest.toml").read_text(encoding="utf-8")
    text = re.sub(r"^#.*\n", "", text)
    text = re.sub(r"^version = .*$", f'version = "{version()}"', text, flags=re.M)
    limits = f'blender_version_min = "{oldest}"\n' + (f'blender_version_max = "{newer}"\n' if newer else "")
    text = re.sub(r"^blender_version_min = .*\n", limits, text, flags=re.M)
    rows = "".join(f'  "./wheels/{name}",\n' for name in sorted(wheels))
    return text.replace("\n[permissions]", f'platforms = ["{platform}"]\nwheels = [\n{rows}]\n\n[permissions]')


def pack(target: Path, platform: str, python: str, wheels: Sequence[Path]) -> None:
    """Write a zip: the manifest, the code, the licence and the wheels, which are compressed already."""
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("blender_manifest.toml", manifest(platform, python, [wheel.name for wheel in wheels]))
        for pattern in SOURCES:
            for path in sorted(HERE.glob(pattern)):
                if path.name != Path(__file__).name:
                    file.write(path, path.name)
        for wheel in sorted(wheels):
            file.write(wheel, f"wheels/{wheel.name}", zipfile.ZIP_STORED)


def fetch(platform: str, python: str, folder: Path) -> None:
    """Put the wheels that a platform needs into a folder."""
    tag = f"cp{python.replace('.', '')}"
    command = ["download", "--no-deps", "--only-binary=:all:", "--implementation=cp", f"--python-version={python}"]
    command += [f"--abi={abi}" for abi in (tag, "abi3", "none")] + [f"--platform={each}" for each in PLATFORMS[platform]]
    _pip(*command, "--dest", str(folder), *REQUIREMENTS)


def _pip(*arguments: str) -> None:
    subprocess.run([sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check", *arguments], check=True)


def main(arguments: Sequence[str] | None = None) -> None:
    """Build what the command line asks for, and print the sizes."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--platform", action="append", choices=PLATFORMS, help="one of them; may be given again (default: all)")
    parser.add_argument("--python", default="3.11", choices=BLENDERS, help="of Blender: 3.11 up to 5.0, 3.13 from 5.1")
    parser.add_argument("--to", type=Path, default=HERE / "dist", help="folder of the zips (default: dist beside this file)")
    parser.add_argument("--verbose", action="store_true", help="print the size of each wheel, too")
    given = parser.parse_args(arguments)
    given.to.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as name:
        own = Path(name) / "gvpipe"
        _pip("wheel", "--no-deps", "--wheel-dir", str(own), str(ROOT))
        for platform in given.platform or PLATFORMS:
            folder = Path(name) / platform
            fetch(platform, given.python, folder)
            wheels = [*folder.glob("*.whl"), *own.glob("*.whl")]
            target = given.to / f"geometry_video-{version()}-{platform}-py{given.python.replace('.', '')}.zip"
            pack(target, platform, given.python, wheels)
            print(f"{target}: {target.stat().st_size / 1e6:.0f} MB, {len(wheels)} wheels")
            for wheel in sorted(wheels, key=lambda each: -each.stat().st_size) if given.verbose else ():
                print(f"  {wheel.stat().st_size / 1e6:6.1f} MB  {wheel.name}")


if __name__ == "__main__":
    main()
