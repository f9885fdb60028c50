"""Builds all that a release publishes, and tries it as its users will: python tools/release.py --dry-run [FOLDER].

1. A clone of the committed state, so that nothing else gets in.
2. The source distribution, a wheel for all systems, a wheel with machine code for this one, the npm package, the site.
3. `twine check --strict`, and publint for the npm package.
4. Each wheel, in a new environment without the sources, runs README's commands; with machine code nothing compiles.
5. SHA256SUMS of everything.

``--native`` builds the wheel with machine code alone. Nothing is published, with ``--dry-run`` or without: the workflow does
that, on a tag. It needs git, npm and the network.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).parents[1]
TOOLS = ("build", "twine", "wheel")
PUBLINT = "publint@0.3"
PLATFORM = "manylinux_2_28_"  # the index takes no plain Linux wheel


def main() -> int:
    """Build and try a release; the status is that of the first step that fails."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--dry-run", action="store_true", help="say so in the summary")
    parser.add_argument("--native", action="store_true", help="build and try the wheel with machine code alone")
    parser.add_argument(
        "folder", metavar="FOLDER", nargs="?", type=Path, default=ROOT / "dist", help="what is built goes there"
    )
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as work:
        try:
            build(Path(work), given.folder.resolve(), given.native)
        except subprocess.CalledProcessError as exc:
            print(f"failed: {' '.join(map(str, exc.cmd))}", file=sys.stderr)
            return 1
    names = sorted(path.name for path in given.folder.iterdir())
    print(f"{'dry run: ' if given.dry_run else ''}{given.folder} has {', '.join(names)}")
    return 0


def build(work: Path, folder: Path, is_native: bool) -> None:
    """Build everything, or the wheel with machine code, into a folder, which is made anew."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    clone = work / "clone"
    run(["git", "clone", "--quiet", str(ROOT), str(clone)], work)
    python = environment(work / "tools", ["-e", f"{clone}[docs]", *TOOLS])
    try_wheel(native_wheel(python, clone, work / "native", folder), work / "quick", compiles=False)
    if is_native:
        return
    native = set(folder.glob("*.whl"))
    run([python, "-m", "build", "--outdir", str(folder), "."], clone)
    web = clone / "gvpipe" / "web"
    run(["npm", "ci", "--silent"], web)
    run(["npm", "pack", "--silent", "--pack-destination", str(folder)], web)
    run(["npx", "--yes", PUBLINT, "--strict", "."], web)
    run(
        [python, "-m", "mkdocs", "build", "--quiet", "--strict", "--site-dir", str(work / "site")],
        clone,
        NO_MKDOCS_2_WARNING="1",
    )
    shutil.make_archive(str(folder / "site"), "zip", work / "site")
    (plain,) = set(folder.glob("*.whl")) - native
    try_wheel(plain, work / "plain", compiles=True)
    run([python, "-m", "twine", "check", "--strict", *map(str, [*folder.glob("*.whl"), *folder.glob("*.tar.gz")])], clone)
    sums = [f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.name}" for path in sorted(folder.iterdir())]
    (folder / "SHA256SUMS").write_text("\n".join(sums) + "\n")


def native_wheel(python: str, clone: Path, work: Path, folder: Path) -> Path:
    """A wheel with machine code for this system's portable processor and this version of Python."""
    run([str(Path(python).with_name("gvpipe")), "warmup", "--installed", "--portable"], clone)
    run([python, "-m", "build", "--wheel", "--outdir", str(work), "."], clone)
    shutil.rmtree(clone / "gvpipe" / "runtime" / "kernels")
    (made,) = work.glob("*.whl")
    machine = re.search(r"-linux_(\w+)\.whl$", made.name)
    if machine:
        run([python, "-m", "wheel", "tags", "--remove", "--platform-tag", f"{PLATFORM}{machine[1]}", str(made)], work)
        (made,) = work.glob("*.whl")
    return Path(shutil.move(made, folder / made.name))


def try_wheel(wheel: Path, work: Path, compiles: bool) -> None:
    """Install a wheel where nothing else is, and run README's commands on a sample; with machine code nothing may compile."""
    python = environment(work / "venv", [str(wheel)])
    (work / "samples").mkdir()
    shutil.copy(ROOT / "samples" / "creature.npz", work / "samples")
    line = next(line for line in (ROOT / "README.md").read_text("utf-8").splitlines() if "gvpipe encode samples" in line)
    for command in [part.split() for part in line.split("&&") if "bin/gvpipe " in part]:
        program = str(Path(python).with_name("gvpipe"))
        said = run([program, *command[1:], "--verbose"], work, NUMBA_CACHE_DIR=str(work / "cache"))
        if not compiles and "compiling" in said:
            raise subprocess.CalledProcessError(1, ["something was compiled by", *command])


def environment(folder: Path, packages: Sequence[str]) -> str:
    """A new environment with some packages; return its Python."""
    run([sys.executable, "-m", "venv", str(folder)], folder.parent)
    python = str(folder / ("Scripts" if os.name == "nt" else "bin") / "python")
    run([python, "-m", "pip", "install", "--quiet", *packages], folder.parent)
    return python


def run(command: Sequence[str], folder: Path, **variables: str) -> str:
    """Run a command in a folder, show it, and return what it said on standard error."""
    print("+", " ".join(command), flush=True)
    folder.mkdir(parents=True, exist_ok=True)
    done = subprocess.run(command, cwd=folder, env={**os.environ, **variables}, stderr=subprocess.PIPE, text=True)
    if done.returncode:
        print(done.stderr, file=sys.stderr)
    done.check_returncode()
    return done.stderr


if __name__ == "__main__":
    sys.exit(main())
