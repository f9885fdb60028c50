"""Pictures of matplotlib in a folder."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from gvpipe.foundation.atomic import output_error, unnamed_path
from gvpipe.foundation.errors import InputError


def draw_pictures(folder: str | os.PathLike[str], pictures: Mapping[str, Callable[[], Any]]) -> list[Path]:
    """Write ``NAME.png`` for each figure that ``pictures`` make into ``folder``, which is made if need be; return the paths.

    Raises:
        InputError: matplotlib is not installed, or there is nothing to draw.
        OutputError: a file cannot be written.
    """
    try:
        import matplotlib
    except ImportError as exc:
        raise InputError("plots need matplotlib, which is not installed; run: pip install 'gvpipe[plot]'") from exc
    matplotlib.use("Agg")
    if not pictures:
        raise InputError("the report has no curve to draw; measure a sequence first")
    try:
        Path(folder).mkdir(parents=True, exist_ok=True)
    except OSError as exc:
        raise output_error(folder, exc) from exc
    paths = []
    for name, make in pictures.items():
        path = Path(folder) / f"{name}.png"
        with unnamed_path(path) as temporary:
            make().savefig(temporary, format="png", dpi=100, metadata={"Software": None})
        paths.append(path)
    return paths
