"""Processes of libraries that damaged files can crash, forked from one that has loaded them.

gvpipe starts a new Python for each Alembic, FBX and USD file, which takes most of a second. Here a server loads the libraries
once, and forks for each file. What runs in the fork is the same: the library's worker, from its first line. `library_cost` says
what the forks took.
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
import struct
import subprocess
import sys
from pathlib import Path
from typing import Any, cast

from gvpipe.io.library import process as library_process

LOADED = (
    "gvpipe.io.alembic.reader",
    "gvpipe.attributes.normal_kernels",
    "gvpipe.io.fbx.reader",
    "gvpipe.io.fbx.evaluator",
    "gvpipe.io.usd.reader",
    "gvpipe.io.simulation.meshio_files",
    "meshio",
    "alembic3d.Abc",
    "ufbx",
    "pxr.UsdSkel",
    "pxr.UsdShade",
)
LONGEST = 1 << 16  # bytes of a request: a number, a module, a path and the working folder, or the number of what ends
ANSWER = struct.Struct("<dQ")  # what a process took: seconds of processor time, bytes beside those of the server at most
_numbers = itertools.count()
_cost = [0.0, 0]  # seconds of all, bytes of the largest, since they were asked for
_servers: dict[int, socket.socket] = {}  # by the process that started them


class ForkedProcess:
    """What `gvpipe.io.library.process` needs of a process."""

    def __init__(self, module: str, path: Path) -> None:
        requests, ours = os.pipe()
        answers, theirs = os.pipe()
        self._number = next(_numbers)
        self.stdin, self.stdout = os.fdopen(ours, "wb"), os.fdopen(answers, "rb")
        socket.send_fds(_server(), [pickle.dumps((self._number, module, str(path), os.getcwd()))], [requests, theirs])
        os.close(requests)
        os.close(theirs)

    def kill(self) -> None:
        """End it; the server waits for it, and says what it took."""
        with contextlib.suppress(OSError, struct.error):  # the server has ended, and all others with it
            _server().send(pickle.dumps((self._number, "", "", "")))
            seconds, memory = ANSWER.unpack(_server().recv(ANSWER.size))
            _cost[:] = _cost[0] + seconds, max(_cost[1], memory)

    def wait(self, timeout: float | None = None) -> int:
        """The server does."""
        return 0


def fork_library_processes() -> None:
    """Fork library processes from here on, where the system can."""
    if sys.platform == "linux":
        library_process.start_process = _start


def library_cost() -> tuple[float, int]:
    """Seconds of processor time of the processes that have ended since the last call, and bytes of the largest."""
    seconds, memory = _cost
    _cost[:] = 0.0, 0
    return seconds, int(memory)


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
        number, module, path, folder = pickle.loads(request)
        if descriptors:
            process = os.fork()
            if process == 0:
                requests.close()
                os.chdir(folder)
                _become(module, path, descriptors)
            running[number] = process
            for descriptor in descriptors:
                os.close(descriptor)
        else:
            requests.send(ANSWER.pack(*_end(running.pop(number))))
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


def _end(process: int) -> tuple[float, int]:
    """End a fork; return seconds of processor time, and bytes that it had beside the server's at most."""
    os.kill(process, signal.SIGKILL)
    _, _, used = os.wait4(process, 0)
    with open("/proc/self/statm") as file:
        own = int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    return used.ru_utime + used.ru_stime, max(0, (used.ru_maxrss << 10) - own)


def _main(arguments: list[Any]) -> None:
    serve(socket.socket(fileno=int(arguments[0])))


if __name__ == "__main__":
    _main(sys.argv[1:])
