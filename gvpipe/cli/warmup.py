"""Compile kernels before a command needs them: ``gvpipe warmup``, for images, wheels and machines that many use.

Kernels compile for the types of their arguments, which only a call knows. So processes encode, decode, compare and draw a small
sequence with every codec, beside each other, and keep what they compile (`gvpipe.runtime.machine_code`).
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gvpipe import api
from gvpipe.coding.registry import codec_ids
from gvpipe.foundation.atomic import atomic_files, temporary_folder
from gvpipe.foundation.errors import GvpipeError, InputError
from gvpipe.foundation.isolation.python import run_python

if TYPE_CHECKING:
    from gvpipe.model.sequence import MeshSequence

AROUND, FRAMES = 24, 24  # vertices along either circle of the torus
ASSETS = "assets"  # the task with attributes, materials and a bound on the error
PICTURE = (192, 192)  # pixels


@dataclass(frozen=True)
class Warmed:
    """What `warm_up` did.

    Attributes:
        folder: with the machine code.
        files: in it, kernels for some types of arguments.
        new: of these, those that were not there before.
        size: bytes of all.
        seconds: it took.
    """

    folder: str
    files: int
    new: int
    size: int
    seconds: float


def warm_up(installed: bool = False, portable: bool = False, progress: Callable[[str, float], None] | None = None) -> Warmed:
    """Compile the kernels that encoding, decoding, comparing and drawing usually need.

    Args:
        installed: keep them in the installation, for all its users and for a wheel; else in the user's own folder.
        portable: compile for a processor that others can stand in for, not for this one.

    Raises:
        InputError: no folder takes files; ``portable`` without ``installed``, where nothing would look for it; no portable
            processor is known for this machine.
        GvpipeError: a task failed.
    """
    from gvpipe.runtime.code_folder import own_folder, why_none

    start = time.perf_counter()
    if portable and not installed:
        raise InputError("portable code is looked for in the installation alone; add --installed")
    folder, settings = _installed_folder(portable) if installed else (own_folder(), {})
    if folder is None:
        raise InputError(f"no safe folder takes machine code ({why_none()}); set NUMBA_CACHE_DIR to one of your own")
    before = set(folder.rglob("*.nbc"))  # numba's own cache has a folder in it
    if installed:
        with atomic_files(folder) as made, temporary_folder() as empty:
            _run_tasks({**settings, "NUMBA_CACHE_DIR": empty}, progress)
            for path in Path(empty, "gvpipe").glob("*.nbc"):
                Path(made, path.name).write_bytes(path.read_bytes())
    else:
        _run_tasks({}, progress)
    after = set(folder.rglob("*.nbc"))
    size = sum(path.stat().st_size for path in after)
    return Warmed(str(folder), len(after), len(after - before), size, time.perf_counter() - start)


def _installed_folder(portable: bool) -> tuple[Path, dict[str, str]]:
    """The folder of the installation, and the environment that compiles for the portable processor if that is asked for."""
    from gvpipe.runtime.kernel_form import Form, kernel_form

    if kernel_form() is not Form.QUICK:
        raise InputError("kernels are not quick here, and only those can be kept in the installation; leave out --installed")
    from gvpipe.runtime.machine_code import INSTALLED, portable_settings

    settings = portable_settings() if portable else {}
    if portable and not settings:
        raise InputError("no portable processor is known for this machine; leave out --portable")
    return INSTALLED, settings


def _run_tasks(environment: dict[str, str], progress: Callable[[str, float], None] | None) -> None:
    """Run every task in a process of its own, as many at a time as there are cores."""
    tasks = [*codec_ids(), ASSETS]
    with ThreadPoolExecutor(min(len(tasks), os.cpu_count() or 1)) as pool:
        for done, _ in enumerate(pool.map(lambda task: _run_task(task, environment), tasks), 1):
            if progress is not None:
                progress("compile", done / len(tasks))


def _run_task(task: str, environment: dict[str, str]) -> None:
    ended = run_python(["-W", "ignore", "-m", "gvpipe.cli.warmup", task], environment)
    if ended.status:
        raise GvpipeError(f"compiling for {task} failed: {ended.last_line}")


def run_task(task: str) -> None:
    """Make kernels compile in this process: those of a codec, or of assets, pictures and bounded errors."""
    with temporary_folder() as folder:
        video = str(Path(folder, "torus.mp4"))
        if task == ASSETS:
            dressed = _dressed()
            api.encode(dressed, video, "pca", max_error="0.1%")
            from gvpipe.metrics.comparison import compare

            compare(dressed, api.decode(video))
            api.render(video, str(Path(folder, "torus.png")), frame=0, size=PICTURE)
            api.render(video, str(Path(folder, "errors.png")), frame=0, size=PICTURE, error_of=dressed)
            api.render(video, str(Path(folder, "plain.png")), frame=0, size=PICTURE, plain=True, shading="flat")
        else:
            for sequence in (_torus(), _bent()):
                api.encode(sequence, video, task)
                api.decode(video)


def _torus() -> MeshSequence:
    """A torus on which waves run: as regular as most meshes, and with motion that no codec finds at rest."""
    from gvpipe.model.sequence import MeshSequence

    u, v = np.meshgrid(np.arange(AROUND), np.arange(AROUND), indexing="ij")
    number = (u * AROUND + v, (u + 1) % AROUND * AROUND + v, (u + 1) % AROUND * AROUND + (v + 1) % AROUND)
    opposite = u * AROUND + (v + 1) % AROUND
    faces = np.stack([*number, number[0], number[2], opposite], axis=-1).reshape(-1, 3)
    a, b = 2 * np.pi * u.ravel() / AROUND, 2 * np.pi * v.ravel() / AROUND  # (V,)
    t = 2 * np.pi * np.arange(FRAMES)[:, None] / FRAMES
    radius = 1 + 0.2 * np.sin(3 * a + t) + 0.1 * np.cos(2 * b - 2 * t)  # (F, V)
    across = 3 + radius * np.cos(b)
    return MeshSequence(np.stack([across * np.cos(a), across * np.sin(a), radius * np.sin(b)], axis=-1), faces.astype(np.int32))


def _bent() -> MeshSequence:
    """The torus as it stands in the first frame, bent to and fro as by two bones, which a blend predicts without pictures."""
    torus = _torus()
    x, y, z = np.moveaxis(torus.read(0, 1).astype(np.float64), -1, 0)  # (1, V)
    angle = np.sin(2 * np.pi * np.arange(FRAMES)[:, None] / FRAMES) / (1 + np.exp(-2 * x))  # (F, V)
    bent = np.stack([x * np.cos(angle) - z * np.sin(angle), y + 0 * angle, x * np.sin(angle) + z * np.cos(angle)], axis=-1)
    return type(torus)(bent, torus.faces)


def _dressed() -> MeshSequence:
    """The torus with texture coordinates that have a seam, normals, colours, a field and a material."""
    from dataclasses import replace

    from gvpipe.asset.material import Material
    from gvpipe.asset.part import Part

    torus = _torus()
    base, n_vertices = torus.read(0, 1)[0], torus.n_vertices
    corners = np.stack(np.divmod(torus.faces.ravel(), AROUND), axis=1) / np.float32(AROUND)  # (3T, 2)
    uv = corners.reshape(-1, 3, 2)
    uv += uv.max(axis=1, keepdims=True) - uv > 0.5  # triangles over the seam
    attributes = {
        "uv": uv.reshape(-1, 2),
        "normal": base / np.linalg.norm(base, axis=1, keepdims=True),
        "color": np.round(255 * np.linspace(0, 1, 4 * n_vertices)).reshape(-1, 4).astype(np.uint8),
    }
    whole = Part("torus", (0, n_vertices), (0, len(torus.faces)), 0)
    height = torus.read(0, torus.n_frames)[:, :, 2]
    return replace(torus, attributes=attributes, fields={"height": height}, parts=(whole,), materials=(Material("skin"),))


if __name__ == "__main__":
    run_task(sys.argv[1])
