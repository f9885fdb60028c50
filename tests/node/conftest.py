"""The web player in Node, which plays files of a web server as a page does."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from pages import BUNDLE


@pytest.fixture(scope="module")
def node() -> Iterator[Callable[..., Any]]:
    """``ask(command, **given)``: what `run_parts.mjs` answers; an error is a pair of kind and message."""
    command = ["node", str(Path(__file__).with_name("run_parts.mjs")), str(BUNDLE / "geometry-video.js")]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:

        def ask(name: str, **given: Any) -> Any:
            assert process.stdin is not None and process.stdout is not None
            process.stdin.write(json.dumps({"command": name, **given}) + "\n")
            process.stdin.flush()
            answer = json.loads(process.stdout.readline())
            return answer["value"] if "value" in answer else tuple(answer["error"])

        yield ask
        process.kill()
