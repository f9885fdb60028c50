"""Files of machine code: one for each kernel and each tuple of argument types.

numba's own cache lies beside the sources, so each clone and each environment compiles anew. Here a file's name is a hash of
all that its code follows from. So one folder serves all installations of a user, and no file is out of date:

- the bytecode of the kernel and of all kernels that it calls, and the constants and classes that they name;
- the argument types, the options, the processor, and the versions of Python, numba and LLVM.

Code is looked for in two folders:

1. the user's own, which takes new code: ``NUMBA_CACHE_DIR/gvpipe``, else ``gvpipe/kernels`` where the system keeps caches,
   else ``__pycache__/kernels`` in this package; the first that is safe and takes files (`gvpipe.runtime.code_folder`);
2. `INSTALLED`, which ``gvpipe warmup --installed`` fills and a wheel may ship. Code there may be made for a processor of
   `PORTABLE`, which others can stand in for.

`gvpipe.runtime.code_file` says what is in a file. It is written as a whole or not at all. A damaged file, and one that does not
load, count as none. The files are programs: their folder must be as safe as the sources'.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import os
import platform
import re
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any

import llvmlite
import numba
import numpy as np
from llvmlite import binding
from numba.core import config
from numba.core.caching import _Cache
from numba.core.runtime import rtsys
from numba.core.sigutils import normalize_signature

from gvpipe.runtime import borrowing
from gvpipe.runtime.announcements import announce_damaged
from gvpipe.runtime.claims import claims_in
from gvpipe.runtime.code_file import Unstorable, pack, rebuild, spelt, unpack
from gvpipe.runtime.code_folder import own_folder as own_folder

FORMAT = 3  # of the files
COMPILER = hashlib.sha256(Path(borrowing.__file__).read_bytes()).hexdigest()
INSTALLED = Path(__file__).with_name("kernels")
SUFFIX = ".nbc"
PACKAGES = ("gvpipe.", "gvcodecs.")
SETTINGS = ("OPT", "BOUNDSCHECK", "LOOP_VECTORIZE", "SLP_VECTORIZE", "DEBUGINFO_DEFAULT", "LLVM_REFPRUNE_PASS")  # of numba
DAY = 86_400.0  # seconds
KEPT = 60 * DAY  # a file that nobody reads for so long may go

V3 = ("avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe", "popcnt", "sse4.2", "xsave")
PORTABLE = {  # by machine: LLVM's name of a processor, and the features that one needs to stand in for it
    "x86_64": ("x86-64-v3", V3),
    "amd64": ("x86-64-v3", V3),
    "aarch64": ("generic", ()),
    "arm64": ("generic", ()),
}


class MachineCode(_Cache):  # type: ignore[misc]  # numba has no types
    """The files of one kernel, in the form that numba's dispatchers ask for.

    Args:
        function: the kernel, not compiled.
        options: what it is compiled with.
        on_miss: called when there is no code for some types.
        on_refusal: called when no folder takes a file.
    """

    def __init__(
        self, function: Any, options: dict[str, Any], on_miss: Callable[[], None], on_refusal: Callable[[], None]
    ) -> None:
        self._function, self._options = function, options
        self._on_miss, self._on_refusal = on_miss, on_refusal
        self._is_enabled = True

    @property
    def cache_path(self) -> str | None:
        """The folder that takes new code, if there is one."""
        folder = own_folder()
        return None if folder is None else str(folder)

    def enable(self) -> None:
        """Use files; this is how a cache begins."""
        self._is_enabled = True

    def disable(self) -> None:
        """Use no files."""
        self._is_enabled = False

    def flush(self) -> None:
        """Remove the kernel's files from the folder that takes new code."""
        folder = own_folder()
        for path in [] if folder is None else folder.glob(f"{self._stem()}-*{SUFFIX}"):
            path.unlink(missing_ok=True)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The compile result for argument types, None if there is none that fits."""
        rtsys.initialize(target_context)  # the rest of numba's context serves compilation, and takes 0.1 s
        if not self._is_enabled:
            self._on_miss()
            return None
        found = self._load(sig, target_context)
        if found is not None:
            return found
        self._on_miss()
        folder = own_folder()
        if folder is None:
            return None
        name = self._name(sig, _processor(target_context.codegen()))
        has_waited = not claims_in(folder).take(name, 0) and claims_in(folder).take(name)
        found = self._load(sig, target_context) if has_waited else None
        if found is not None:
            claims_in(folder).release(name)
        return found

    def is_wanted(self, sig: Any, target_context: Any) -> bool:
        """Whether there is no code for some types, and no other process compiles it now."""
        folder = own_folder()
        if folder is None or any(path.is_file() for path in self._places(sig, target_context.codegen())):
            return False
        name = self._name(sig, _processor(target_context.codegen()))
        is_free = claims_in(folder).take(name, 0)
        if is_free:
            claims_in(folder).release(name)
        return is_free

    def _load(self, sig: Any, target_context: Any) -> Any:
        for path in self._places(sig, target_context.codegen()):
            try:
                data = _read(path)
            except OSError:
                continue
            try:
                return rebuild(target_context, tuple(normalize_signature(sig)[0]), unpack(data))
            except Exception as exc:  # LLVM and the linker may raise any
                announce_damaged(exc)
                break
        return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Store a compile result, if a folder takes it."""
        folder = own_folder()
        if folder is None:
            if self._is_enabled:
                self._on_refusal()
            return
        path = folder / self._name(sig, _processor(data.codegen))
        try:
            if self._is_enabled and not data.library.has_dynamic_globals:  # addresses of this process
                _write(path, pack(data))
                _remove_old(folder, self._stem())
        except (OSError, Unstorable):
            self.disable()
        finally:
            claims_in(folder).release(path.name)

    def _places(self, sig: Any, codegen: Any) -> Iterator[Path]:
        """Where code for argument types may be."""
        name, folder = self._name(sig, _processor(codegen)), own_folder()
        if folder is not None:
            yield folder / name
        if INSTALLED.is_dir():
            yield INSTALLED / name
            if stands_in():
                yield INSTALLED / self._name(sig, (_portable()[0], ""))

    def _name(self, sig: Any, processor: tuple[str, str]) -> str:
        """The name of the file for argument types on a processor: LLVM's name of it, and features beside those of that name."""
        arguments = [spelt(kind) for kind in normalize_signature(sig)[0]]
        key = repr((_content(self._function), sorted(self._options.items()), arguments, _surroundings(), processor))
        return f"{self._stem()}-{hashlib.sha256(key.encode()).hexdigest()[:32]}{SUFFIX}"

    def _stem(self) -> str:
        return re.sub(r"[^\w.]", "_", f"{self._function.__module__}.{self._function.__qualname__}")[-100:]


@functools.cache
def stands_in() -> bool:
    """Whether code for the portable processor serves here; not if ``NUMBA_CPU_NAME`` or ``NUMBA_CPU_FEATURES`` is set."""
    name, needed = _portable()
    if not name or config.CPU_NAME is not None or config.CPU_FEATURES is not None:
        return False
    features = binding.get_host_cpu_features() if needed else {}
    return all(features.get(feature, False) for feature in needed)


def portable_settings() -> dict[str, str]:
    """The environment variables with which numba compiles for the portable processor; none where there is no such."""
    name, _ = _portable()
    return {"NUMBA_CPU_NAME": name, "NUMBA_CPU_FEATURES": ""} if name else {}


def _portable() -> tuple[str, tuple[str, ...]]:
    """LLVM's name of the portable processor, and the features that it has."""
    return PORTABLE.get(platform.machine().lower(), ("", ()))


def _processor(codegen: Any) -> tuple[str, str]:
    _, name, features = codegen.magic_tuple()
    return str(name), str(features)


@functools.cache
def _surroundings() -> tuple[object, ...]:
    """What all machine code of this process depends on, but for the processor."""
    versions = FORMAT, numba.__version__, llvmlite.__version__, sys.implementation.cache_tag, COMPILER
    settings = tuple(str(getattr(config, name, None)) for name in SETTINGS)
    return (*versions, sys.platform, platform.machine().lower(), settings)


def _content(function: FunctionType) -> str:
    """A hash of the functions that a kernel's machine code holds, and of what they name."""
    found: dict[str, str] = {}
    open_functions = [function]
    while open_functions:
        text, called = _text(open_functions.pop())
        if text not in found:
            found[text] = text
            open_functions.extend(called)
    return hashlib.sha256("\n".join(sorted(found)).encode()).hexdigest()


@functools.cache
def _text(function: FunctionType) -> tuple[str, tuple[FunctionType, ...]]:
    """A function's bytecode and what it names, as text; the functions that it may call."""
    called: list[FunctionType] = []
    used = [
        (name, _value(function.__globals__[name], called)) for name in _names(function.__code__) if name in function.__globals__
    ]
    cells = [_value(cell.cell_contents, called) for cell in function.__closure__ or ()]
    text = repr(
        (function.__module__, function.__qualname__, _code(function.__code__), repr(function.__defaults__), cells, used)
    )
    return text, tuple(called)


def _names(code: CodeType) -> list[str]:
    """Global names, and others, of a function and of those within it."""
    inner = [constant for constant in code.co_consts if isinstance(constant, CodeType)]
    return sorted({*code.co_names, *(name for each in inner for name in _names(each))})


def _code(code: CodeType) -> tuple[object, ...]:
    """What a code object does, without where it lies."""
    constants = [_code(each) if isinstance(each, CodeType) else _value(each, []) for each in code.co_consts]
    names = code.co_names, code.co_varnames, code.co_freevars, code.co_cellvars
    return code.co_code, getattr(code, "co_exceptiontable", b""), code.co_flags, code.co_argcount, names, constants


def _value(value: Any, called: list[FunctionType]) -> str:
    """A constant, class or function that a kernel names, as text that is the same in every process."""
    function = getattr(value, "py_func", value)
    if isinstance(function, FunctionType):
        if f"{function.__module__}.".startswith(PACKAGES) or function is not value:
            called.append(function)
        return f"{function.__module__}.{function.__qualname__} {getattr(value, 'targetoptions', '')}"
    written = getattr(value, "_defn", None)  # an intrinsic's Python, which writes code with all that its module has
    if isinstance(written, FunctionType):
        return f"{written.__qualname__} {_value(sys.modules[written.__module__], called)}"
    if isinstance(value, ModuleType):
        file = getattr(value, "__file__", None)
        ours = f"{value.__name__}.".startswith(PACKAGES) and file
        return f"{value.__name__} {hashlib.sha256(Path(file).read_bytes()).hexdigest() if ours and file else ''}"
    if isinstance(value, type):
        return f"{value.__module__}.{value.__qualname__} {getattr(value, '_fields', '')} {getattr(value, '__members__', '')}"
    if isinstance(value, np.ndarray):
        return f"{value.dtype.str} {value.shape} {hashlib.sha256(value.tobytes()).hexdigest()}"
    if isinstance(value, tuple | list):
        return f"{type(value).__qualname__}({', '.join(_value(each, called) for each in value)})"
    if isinstance(value, frozenset):
        return f"frozenset({sorted(map(repr, value))})"
    named = getattr(value, "__module__", None), getattr(value, "__name__", None)
    return repr(named) if all(named) else repr(value)  # built-in functions, numpy's; numbers, texts


def _read(path: Path) -> bytes:
    """What is in a file; raises OSError for a missing one."""
    data = path.read_bytes()
    now = time.time()
    with contextlib.suppress(OSError):  # of folders that are only read
        if now - path.stat().st_mtime > DAY:
            os.utime(path)
    return data


def _write(path: Path, data: bytes) -> None:
    """Write a file as a whole, whoever else does at the same time."""
    descriptor, name = tempfile.mkstemp(dir=path.parent, prefix=".")
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(data)
        os.replace(name, path)
    except BaseException:
        with contextlib.suppress(OSError):
            os.unlink(name)
        raise


def _remove_old(folder: Path, stem: str) -> None:
    """Remove files of a kernel that nobody has read for long, of earlier versions for instance."""
    limit = time.time() - KEPT
    for path in folder.glob(f"{stem}-*{SUFFIX}"):
        with contextlib.suppress(OSError):
            if path.stat().st_mtime < limit:
                path.unlink()
