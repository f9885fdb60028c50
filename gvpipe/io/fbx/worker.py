"""The process that runs ufbx: it reads requests from its input and writes answers to its output, as pickles.

A request is the name of a method of `gvpipe.io.fbx.evaluator.FbxScene` and its arguments. The answer is ``("done", result)`` or
``("refused", message)``. The process ends with its input. See `gvpipe.io.fbx.library` for why ufbx has one.
"""

from __future__ import annotations

import gc
import os
import pickle
import sys
from pathlib import Path
from typing import Any

METHODS = ("takes", "choose", "describe", "positions")


def main() -> None:
    """Serve the file that the first argument names."""
    gc.disable()
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # nothing but answers may reach them
    scene = _answer(answers, lambda: _open(Path(sys.argv[1])))
    while scene is not None:
        try:
            name, arguments = pickle.load(sys.stdin.buffer)
        except EOFError:
            break
        if name in METHODS:
            _answer(answers, lambda name=name, arguments=arguments: getattr(scene, name)(*arguments))
    answers.flush()
    os._exit(0)  # without taking anything down, which would crash


def _open(path: Path) -> Any:
    import ufbx

    from gvpipe.io.fbx.evaluator import FbxScene

    return FbxScene(ufbx, path)


def _answer(answers: Any, call: Any) -> Any:
    """Send what a call returns, or why it failed; returns what it returned. A scene itself is not sent."""
    result: Any = None
    answer: tuple[str, Any]
    try:
        result = call()
        answer = ("done", result if isinstance(result, list | tuple) else None)
    except Exception as exc:  # whatever it is, the other process turns it into one line
        answer = ("refused", " ".join(str(exc).split())[:300] or type(exc).__name__)
    pickle.dump(answer, answers, protocol=5)
    answers.flush()
    return result


if __name__ == "__main__":
    main()
