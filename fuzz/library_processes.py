"""Processes of libraries that damaged files can crash, forked from one that has loaded them.

gvpipe starts a new Python for each Alembic and FBX file, which takes most of a second. Here a server loads the libraries once,
and forks for each file. What runs in the fork is the same: the library's worker, from its first line.
"""

from __future__ import annotations

import atexit
import contextlib
import importlib
import itertools
import os
import pickle
import runpy
import signal
import socket
import subprocess
import sys
from pathlib import Path
from typing import Any, cast

from gvpipe.io import library_process

LOADED = ("gvpipe.io.alembic.reader", "gvpipe.attributes.normal_kernels", "gvpipe.io.fbx.evaluator", "alembic3d.Abc", "ufbx")
LONGEST = 1 << 16  # bytes of a request: a number, a module and a path, or the number of what ends
_numbers = itertools.count()
_servers: dict[int, socket.socket] = {}  # by the process that started them


class ForkedProcess:
    """What `gvpipe.io.library_process` needs of a process."""

    def __init__(self, module: str, path: Path) -> None:
        requests, ours = os.pipe()
        answers, theirs = os.pipe()
        self._number = next(_numbers)
        self.stdin, self.stdout = os.fdopen(ours, "wb"), os.fdopen(answers, "rb")
        socket.send_fds(_server(), [pickle.dumps((self._number, module, str(path)))], [requests, theirs])
        os.close(requests)
        os.close(theirs)

    def kill(self) -> None:
        """End it; the server waits for it."""
        with contextlib.suppress(OSError):  # the server has ended, and all others with it
            _server().send(pickle.dumps((self._number, "", "")))

    def wait(self) -> None:
        """The server does."""


def fork_library_processes() -> None:
    """Fork library processes from here on, where the system can."""
    if hasattr(os, "fork") and hasattr(socket, "send_fds"):
        library_process.start_process = _start


def _start(module: str, path: Path) -> subprocess.Popen[bytes]:
    return cast("subprocess.Popen[bytes]", ForkedProcess(module, path))


def _server() -> socket.socket:
    """The socket of this process's server, which is started with the first file."""
    if os.getpid() not in _servers:
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
        command = [sys.executable, "-m", "fuzz.library_processes", str(theirs.fileno())]
        server = subprocess.Popen(command, pass_fds=(theirs.fileno(),), env=environment, stderr=subprocess.DEVNULL)
        theirs.close()
        _servers[os.getpid()] = ours
        atexit.register(server.wait, 10)
        atexit.register(ours.close)
    return _servers[os.getpid()]


def serve(requests: socket.socket) -> None:
    """Fork as asked until the socket ends, then end what is left."""
    running: dict[int, int] = {}
    for name in LOADED:
        with contextlib.suppress(ImportError):
            importlib.import_module(name)
    while True:
        request, descriptors, _, _ = socket.recv_fds(requests, LONGEST, 2)
        if not request:
            break
        number, module, path = pickle.loads(request)
        if descriptors:
            process = os.fork()
            if process == 0:
                requests.close()
                _become(module, path, descriptors)
            running[number] = process
            for descriptor in descriptors:
                os.close(descriptor)
        elif number in running:
            _end(running.pop(number))
    for process in running.values():
        _end(process)


def _become(module: str, path: str, descriptors: list[int]) -> None:
    """Be the process that ``python -m module path`` is."""
    for place, descriptor in enumerate(descriptors):
        os.dup2(descriptor, place)
        os.close(descriptor)
    sys.argv = [module, path]
    try:
        runpy.run_module(module, run_name="__main__", alter_sys=True)
    finally:
        os._exit(1)


def _end(process: int) -> None:
    os.kill(process, signal.SIGKILL)
    os.waitpid(process, 0)


def _main(arguments: list[Any]) -> None:
    serve(socket.socket(fileno=int(arguments[0])))


if __name__ == "__main__":
    _main(sys.argv[1:])
