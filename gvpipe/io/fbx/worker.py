"""The process that runs ufbx; see `gvpipe.io.fbx.library` for why it has one, `gvpipe.io.library.process` for requests.

A request is the name of a method of `gvpipe.io.fbx.evaluator.FbxScene` and its arguments.
"""

from __future__ import annotations

import gc
import os
import sys
from functools import cache
from pathlib import Path
from typing import Any

from gvpipe.foundation.isolation.confinement import confine
from gvpipe.io.fbx.evaluator import FbxScene
from gvpipe.io.library.worker import serve

METHODS = ("takes", "choose", "describe", "positions")


@cache
def _scene() -> FbxScene:
    import ufbx

    path = Path(sys.argv[1])
    confine([os.path.dirname(os.path.realpath(path))])
    return FbxScene(ufbx, path)


def answer(name: str, arguments: tuple[Any, ...]) -> Any:
    """The result of a request."""
    return getattr(_scene(), METHODS[METHODS.index(name)])(*arguments)


if __name__ == "__main__":
    gc.disable()
    serve(answer)
