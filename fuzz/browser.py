"""The web player's readers, run by Node over the cases that Python's readers get."""

from __future__ import annotations

import dataclasses
import json
import select
import shutil
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import gvpipe
from fuzz.captures import capture_target
from fuzz.live import live_target
from fuzz.parts import BrokenPromise, Seed, Target
from fuzz.streams import stream_target
from fuzz.videos import JSON, video_targets
from gvpipe.container.bitstream import HEADER
from gvpipe.foundation.budget import LEAST_SECONDS, SECONDS_PER_BYTE

SCRIPT = Path(__file__).with_name("browser.mjs")
BUNDLE = Path(gvpipe.__file__).parent / "web" / "bundle" / "geometry-video.js"
PREFIX = "web-"
WAIT = 30  # s of the clock, for one file
MOST_HEAP = 1024  # MB
MOST_MEMORY = 400 << 20  # bytes that a file may add to what the process held at its peak; what is garbage counts, too
READ = ("laplacian", "mcgv", "pca", "pdct")  # codecs that browsers read


class RefusedByPlayer(Exception):
    """The web player refuses a file."""


class Node:
    """A process that reads files; started again after each that ended it."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[str] | None = None
        self._peak = 0

    def read(self, path: Path) -> None:
        """Read a file.

        Raises:
            RefusedByPlayer: by an error that is meant.
            BrokenPromise: anything else.
        """
        answer = self._ask(path)
        size = path.stat().st_size
        grown, self._peak = answer["peak"] - max(self._peak, answer["before"]), answer["peak"]
        if answer["kind"] == "crashed":
            raise BrokenPromise(
                f"{answer['text'].split(':')[0]} {_place(answer['stack'])}: {answer['text']} {answer['stack'][:800]}"
            )
        if answer["kind"] == "broken":
            raise BrokenPromise(answer["text"])
        if grown > MOST_MEMORY:
            raise MemoryError(f"{grown >> 20} MB for {size} bytes")
        if answer["seconds"] > max(LEAST_SECONDS, SECONDS_PER_BYTE * size):
            raise BrokenPromise(f"too slow: {answer['seconds']} s for {size} bytes")
        if answer["kind"] == "refused":
            text = answer["text"].encode("unicode_escape").decode()  # pages show any text as it is
            raise RefusedByPlayer(f"{path.name}: {text}")

    def close(self) -> None:
        """End the process."""
        if self._process is not None:
            self._process.kill()
            self._process.communicate()
            self._process = None

    def _ask(self, path: Path) -> dict[str, Any]:
        process = self._process or self._start()
        assert process.stdin is not None and process.stdout is not None
        process.stdin.write(f"{path}\n")
        process.stdin.flush()
        ready = select.select([process.stdout], [], [], WAIT)[0]
        line = process.stdout.readline() if ready else ""
        if not line:
            self.close()
            raise BrokenPromise("Node ended" if ready else f"Node gave no answer in {WAIT} s")
        answer: dict[str, Any] = json.loads(line)
        return answer

    def _start(self) -> subprocess.Popen[str]:
        command = ["node", f"--max-old-space-size={MOST_HEAP}", str(SCRIPT), str(BUNDLE)]
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, preexec_fn=_unlimited
        )
        self._peak = 0
        return self._process


def _unlimited() -> None:
    """Node reserves far more addresses than it uses, so the worker's limit is not for it."""
    import resource

    resource.setrlimit(resource.RLIMIT_AS, (resource.RLIM_INFINITY, resource.getrlimit(resource.RLIMIT_AS)[1]))


_nodes = threading.local()


def browser_targets(
    seeds: tuple[Seed, ...],
    streams: tuple[Seed, ...] = (),
    growing: tuple[Seed, ...] = (),
    captures: tuple[Seed, ...] = (),
) -> list[Target]:
    """The parsers of geometry videos as browsers have them; none without Node, or on Windows, where pipes cannot be polled."""
    if shutil.which("node") is None or sys.platform == "win32":
        return []
    played = tuple(seed for seed in seeds if json.loads(seed.parts[JSON])["codec"] in READ)
    flowing = tuple(seed for seed in streams if json.loads(seed.parts[HEADER])["codec"] in READ)
    made = (*video_targets(played), stream_target(flowing), live_target(growing), capture_target(captures))
    targets = [target for target in made if target.seeds]
    return [
        dataclasses.replace(target, name=PREFIX + target.name, parse=_parse, refusal=(RefusedByPlayer,)) for target in targets
    ]


def _parse(path: Path) -> None:
    if not hasattr(_nodes, "node"):
        _nodes.node = Node()
    _nodes.node.read(path)


def _place(stack: str) -> str:
    """Line and column of the bundle where an error arose."""
    lines = [line for line in stack.splitlines() if BUNDLE.name in line]
    return lines[0].rsplit("/", 1)[-1].rstrip(")") if lines else "?"
