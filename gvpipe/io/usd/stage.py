"""Opening a USD stage: the library's diagnostics become errors and notes, and time codes become frames."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from gvpipe.foundation.arrays import Float64
from gvpipe.foundation.errors import InputError
from gvpipe.io.damage import reading
from gvpipe.io.options import ReadOptions
from gvpipe.io.scene.frames import between_note, frame_times

TOO_LARGE = "it asks for more memory than files of its size may take; export it again, or read it with --unlimited"
MISSING = ("ErrorInvalidAssetPath", "ErrorInvalidSublayerPath")  # of composition: a file that is not there
FASTEST = 120.0  # time codes a second above which codes are a unit of time rather than frames
SLOWEST = 5.0  # and below which


def open_stage(path: Path) -> Any:
    """Open a stage.

    Raises:
        InputError: it is damaged, or a file that it refers to is missing.
    """
    from pxr import Usd

    with usd_errors(path):
        stage = Usd.Stage.Open(str(path))
        for error in stage.GetCompositionErrors():
            if type(error).__name__ in MISSING:
                named = re.search(r"@(.*?)@", str(error))
                file = _beside(stage, named[1]) if named else ""
                if os.path.exists(file) and not is_inside(file, Path(os.path.realpath(path)).parent):
                    raise _outside(path, file)  # `gvpipe.foundation.isolation.confinement` kept it from being opened
                raise InputError(
                    f"{path} refers to {named[1] if named else 'a file'}, which cannot be read; put it in its place, or export "
                    "again as one file"
                )
    return stage


@contextmanager
def usd_errors(path: Path) -> Iterator[None]:
    """Turn what the library raises into `InputError`, and keep its warnings from the terminal."""
    from pxr import UsdUtils

    silencer = UsdUtils.CoalescingDiagnosticDelegate()
    try:
        with reading(path, "USD"):
            try:
                yield
            except MemoryError as exc:
                raise ValueError(TOO_LARGE) from exc
    finally:
        silencer.TakeUncoalescedDiagnostics()
        del silencer


def check_inside(stage: Any, path: Path) -> None:
    """Raise `InputError` if a layer that the stage uses, or will use as a value clip, lies outside of the file's folder."""
    folder = Path(os.path.realpath(path)).parent
    for file in (*(layer.realPath for layer in stage.GetUsedLayers()), *_clip_files(stage)):
        if file and not is_inside(file, folder):
            raise _outside(path, file)


def is_inside(path: str, folder: Path) -> bool:
    """Whether a file, or a package of USD and a file in it (``a.usdz[b.usdc]``), lies below a folder, links followed."""
    from pxr import Ar

    outer = Ar.SplitPackageRelativePathOuter(path)[0] if Ar.IsPackageRelativePath(path) else path
    return Path(os.path.realpath(outer)).is_relative_to(folder)


def _clip_files(stage: Any) -> Iterator[str]:
    """Files of value clips, which OpenUSD opens when a frame is asked for."""
    from pxr import Usd

    for prim in stage.Traverse(Usd.TraverseInstanceProxies(Usd.PrimAllPrimsPredicate)):
        if not prim.HasAuthoredMetadata("clips"):
            continue
        clips = Usd.ClipsAPI(prim)
        for name in clips.GetClips():
            assets = [clips.GetClipManifestAssetPath(name), *clips.ComputeClipAssetPaths(name)]
            yield from (asset.resolvedPath or _beside(stage, asset.path) for asset in assets if asset)


def _beside(stage: Any, named: str) -> str:
    """Where a file that OpenUSD did not find would lie."""
    return os.path.join(os.path.dirname(stage.GetRootLayer().realPath), named) if named else ""


def _outside(path: Path, file: str) -> InputError:
    return InputError(
        f"{path} takes what it shows from outside of its folder: {file}; put that inside, or make one file of all "
        "(usdcat --flatten)"
    )


def stage_times(
    stage: Any, samples: Iterable[float], options: ReadOptions, where: str
) -> tuple[Float64, float, tuple[str, ...]]:
    """Return the time code of each frame, the frames per second, and notes.

    Frames are the stage's time codes from its start to its end, or from the first to the last sample where the stage has no
    range. Where time codes are no frames (1000 a second, say), the stage's frames per second count, else the densest samples.

    Args:
        samples: time codes of all samples of what moves.
        options: `fps` evaluates at other times of the same range.
    """
    codes = float(stage.GetTimeCodesPerSecond())
    if not (np.isfinite(codes) and codes > 0):
        raise InputError(f"{where} has {codes} time codes a second; a number above 0 is needed")
    given = np.unique(np.fromiter(samples, np.float64))
    given = given[np.isfinite(given)]
    whole = np.rint(given)
    given = np.unique(np.where(np.abs(given - whole) < 1e-6, whole, given))  # of programs that store codes in seconds
    start, stop = float(stage.GetStartTimeCode()), float(stage.GetEndTimeCode())
    if not stop > start:
        start, stop = (float(given[0]), float(given[-1])) if len(given) else (start, start)
    if not len(given):  # nothing moves
        stop = start
    inside = given[(given >= start) & (given <= stop)]
    step = codes / options.fps if options.fps else _step(stage, codes, inside)
    fps = codes / step
    times = frame_times(start, stop, step, where)
    return times, fps, between_note(inside, start, step, fps, codes)


def _step(stage: Any, codes: float, samples: Float64) -> float:
    """Time codes from frame to frame."""
    rate = float(stage.GetFramesPerSecond())
    if stage.GetRootLayer().HasFramesPerSecond() and 0 < rate <= FASTEST and rate < codes:
        return codes / rate
    if SLOWEST <= codes <= FASTEST or len(samples) < 2:
        return 1.0
    return max(float(np.diff(samples).min()), codes / FASTEST)
