"""A process that reads a file of others can open nothing outside of that file's folder, beside what Python itself is made of.

Two lines of defence, for libraries that follow references on their own:

- Landlock, in Linux's kernel from 5.13 on: opening any other file fails, whatever the library, and nothing can be written. From
  6.7 on no connection can be made, either. It holds for the whole process, for ever.
- An audit hook, for libraries written in Python, on every system: opening such a file raises `OSError`.

Neither replaces the readers' own checks of names, which say what is wrong and hold where there is no Landlock.

Source: the Linux kernel's documentation, "Landlock: unprivileged access control".
"""

from __future__ import annotations

import ctypes
import errno
import os
import stat
import struct
import sys
import sysconfig
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import Any

CREATE_RULESET, ADD_RULE, RESTRICT_SELF = 444, 445, 446  # numbers of system calls, the same on all of Python's machines
VERSION = 1  # flag of CREATE_RULESET that asks for Landlock's version
PATH_BENEATH = 1  # kind of rule
NO_NEW_PRIVILEGES = 38  # PR_SET_NO_NEW_PRIVS
EXECUTE, READ_FILE, READ_FOLDER = 1 << 0, 1 << 2, 1 << 3
READ = EXECUTE | READ_FILE | READ_FOLDER
OF_FILES = EXECUTE | READ_FILE  # rights that a rule for a file may name
RIGHTS = {1: 13, 2: 14, 3: 15, 5: 16}  # by version: how many rights of files there are, all of which are taken away
NETWORK_VERSION, NETWORK = 4, 0b11  # binding and connecting
SYSTEM = ("/usr", "/lib", "/lib64", "/etc/ld.so.cache", "/etc/localtime", "/proc", "/sys/devices/system", "/dev/null",
          "/dev/zero", "/dev/random", "/dev/urandom")  # fmt: skip


@cache
def confine_once(folder: str) -> bool:
    """As `confine` with one folder; a process that reads a file again is confined already."""
    return confine([folder])


def confine(folders: Iterable[str | os.PathLike[str]]) -> bool:
    """Let this process read what lies in some folders, and Python's own files, and nothing else; say whether the system can.

    Call it before the library starts threads of its own: others that run already are not confined.
    """
    if not sys.platform.startswith("linux"):
        return False
    system = ctypes.CDLL(None, use_errno=True)
    version = system.syscall(CREATE_RULESET, None, ctypes.c_size_t(0), VERSION)
    if version < 1:
        return False
    rights = (1 << max(count for first, count in RIGHTS.items() if first <= version)) - 1
    head = struct.pack("=QQ", rights, NETWORK if version >= NETWORK_VERSION else 0)
    rules = system.syscall(CREATE_RULESET, head, ctypes.c_size_t(16 if version >= NETWORK_VERSION else 8), 0)
    if rules < 0:
        return False
    try:
        for path in {*code_places(), *(os.path.realpath(folder) for folder in folders)}:
            _allow(system, rules, path)
        if system.prctl(NO_NEW_PRIVILEGES, 1, 0, 0, 0) or system.syscall(RESTRICT_SELF, rules, 0):
            return False
    finally:
        os.close(rules)
    return True


def watch_opens(folder: str | os.PathLike[str]) -> None:
    """Let Python code of this process open files of a folder, and Python's own, and no others: it gets `OSError`."""
    allowed = [os.path.join(os.path.realpath(each), "") for each in (*code_places(), folder)]

    def look(event: str, arguments: tuple[Any, ...]) -> None:
        if event == "open" and isinstance(arguments[0], str | bytes | os.PathLike):
            named = os.fsdecode(arguments[0])
            if not any(os.path.join(os.path.realpath(named), "").startswith(each) for each in allowed):
                raise OSError(errno.EACCES, "it lies outside of the file's folder", named)

    sys.addaudithook(look)


def code_places() -> set[str]:
    """Files and folders that Python and its libraries are loaded from, links followed."""
    paths = [*SYSTEM, sys.prefix, sys.base_prefix, sys.exec_prefix, *sysconfig.get_paths().values()]
    found = {os.path.realpath(path) for path in (*paths, *(entry for entry in sys.path if os.path.isabs(entry)))}
    return {path for path in found if path != Path(path).anchor and os.path.exists(path)}


def _allow(system: Any, rules: int, path: str) -> None:
    """Add a rule: what lies at or below a path may be read."""
    try:
        held = os.open(path, os.O_PATH | os.O_CLOEXEC)
    except OSError:  # it has gone, or may not be looked at: then it is not read
        return
    try:
        rights = READ if stat.S_ISDIR(os.fstat(held).st_mode) else OF_FILES
        system.syscall(ADD_RULE, rules, PATH_BENEATH, struct.pack("=Qi", rights, held), 0)
    finally:
        os.close(held)
