"""A cache of machine code that is stale, damaged or mixed costs time, and never a result."""

from __future__ import annotations

import importlib
import importlib.util
import logging
import os
import sys
import threading
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from gvpipe import compiled as module
from gvpipe.compiled import compiled

KERNELS = """
from {home} import Pair
from gvpipe.compiled import compiled

@compiled
def total(pair):
    return pair.a + pair.b

@compiled
def double(value):
    return 2 * value
"""
PAIR = "from typing import NamedTuple\nclass Pair(NamedTuple):\n    a: float\n    b: float\n"


@pytest.fixture
def kernels(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """``kernels("pairs")`` loads two kernels as a new process would; their `Pair` is of the module of that name."""
    monkeypatch.syspath_prepend(str(tmp_path))
    path = tmp_path / "some_kernels.py"

    def load(home: str = "pairs") -> ModuleType:
        for name in ("pairs", "elsewhere"):
            (tmp_path / f"{name}.py").unlink(missing_ok=True)
            sys.modules.pop(name, None)
        importlib.invalidate_caches()
        (tmp_path / f"{home}.py").write_text(PAIR, encoding="utf-8")
        path.write_text(KERNELS.format(home=home), encoding="utf-8")
        spec = importlib.util.spec_from_file_location("some_kernels", path)
        assert spec is not None and spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        monkeypatch.setitem(sys.modules, "some_kernels", module)
        spec.loader.exec_module(module)
        return module

    yield load
    for name in ("pairs", "elsewhere"):
        sys.modules.pop(name, None)


def files(kernel: Any, kind: str) -> list[Path]:
    """Files of a kernel's cache: ``nbi`` the index, ``nbc`` the machine code."""
    return sorted(Path(kernel.stats.cache_path).glob(f"some_kernels.{kernel.py_func.__name__}-*.{kind}"))


def hits(kernel: Any) -> int:
    return sum(kernel.stats.cache_hits.values())


def test_code_comes_from_the_cache(kernels: Any) -> None:
    assert kernels().double(2) == 4
    again = kernels().double
    assert again(3) == 6 and hits(again) == 1


def test_classes_that_have_moved(kernels: Any) -> None:
    """The cached index names ``pairs.Pair``, which is gone."""
    old = kernels("pairs")
    assert old.total(old.Pair(1.0, 2.0)) == 3
    new = kernels("elsewhere")
    assert new.total(new.Pair(1.0, 2.5)) == 3.5
    again = kernels("elsewhere")
    assert again.total(again.Pair(1.0, 2.5)) == 3.5


@pytest.mark.parametrize("kind", ["nbi", "nbc"])
@pytest.mark.parametrize(
    "damage", [lambda data: b"", lambda data: data[:-9], lambda data: b"\x80" + data], ids=["empty", "cut", "shifted"]
)
def test_damaged_files(kernels: Any, kind: str, damage: Any) -> None:
    assert kernels().double(2) == 4
    kernel = kernels().double
    (path,) = files(kernel, kind)
    path.write_bytes(damage(path.read_bytes()))
    assert kernel(3) == 6 and hits(kernel) == 0
    again = kernels().double
    assert again(4) == 8 and hits(again) == 1  # mended


def test_an_index_with_the_code_of_other_types(kernels: Any) -> None:
    """Two processes compiled at once: the index is of the one, the machine code of the other."""
    kernel = kernels().double
    assert kernel(2) == 4
    (index,), (code,) = files(kernel, "nbi"), files(kernel, "nbc")
    of_integers = code.read_bytes()
    index.unlink()
    code.unlink()
    assert kernels().double(0.5) == 1.0
    code.write_bytes(of_integers)
    mixed = kernels().double
    assert mixed(0.75) == 1.5 and hits(mixed) == 0
    again = kernels().double
    assert again(0.75) == 1.5 and hits(again) == 1


def test_a_folder_that_takes_no_file(kernels: Any) -> None:
    """Neither a stale index that cannot be replaced nor new code that cannot be stored is an error."""
    kernel = kernels().double
    assert kernel(2) == 4
    kernel = kernels().double
    (index,) = files(kernel, "nbi")
    index.unlink()
    index.mkdir()  # opening it raises an OSError, whoever asks
    assert kernel(3) == 6
    index.rmdir()


@pytest.mark.skipif(sys.platform == "win32", reason="no such locks")
def test_processes_save_in_turn(kernels: Any) -> None:
    import fcntl

    assert kernels().total(kernels().Pair(1.0, 2.0)) == 3.0  # the folder is there
    kernel = kernels().double
    descriptor = os.open(kernel.stats.cache_path, os.O_RDONLY)
    fcntl.flock(descriptor, fcntl.LOCK_EX)  # as another process that saves
    thread = threading.Thread(target=kernel, args=(2,))
    thread.start()
    thread.join(1)
    assert thread.is_alive() and files(kernel, "nbi") == []
    os.close(descriptor)
    thread.join(20)
    assert len(files(kernel, "nbi")) == len(files(kernel, "nbc")) == 1


def test_functions_without_a_file() -> None:
    assert compiled(eval("lambda value: value + 1"))(2) == 3


def test_compiling_is_logged_once(kernels: Any, caplog: pytest.LogCaptureFixture) -> None:
    """At level INFO, so that a library's user sees nothing unasked; loading code from the cache is not logged."""
    for wanted in ([module.ONCE], []):
        module._announce.cache_clear()
        caplog.clear()
        with caplog.at_level(logging.INFO, logger="gvpipe.compiled"):
            loaded = kernels()
            assert (loaded.double(2), loaded.total(loaded.Pair(1.0, 2.0))) == (4, 3)
        assert caplog.messages == wanted


def test_code_that_no_folder_takes_is_logged(caplog: pytest.LogCaptureFixture) -> None:
    module._announce.cache_clear()
    with caplog.at_level(logging.INFO, logger="gvpipe.compiled"):
        compiled(eval("lambda value: value + 1"))
    assert caplog.messages == [module.EVERY_TIME]


def test_a_callee_that_has_changed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Machine code holds what a kernel calls, which may come from another file."""
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(module, "PACKAGES", ("callee_kernels", "caller_kernels"))
    head = "from gvpipe.compiled import compiled\n"
    (tmp_path / "caller_kernels.py").write_text(
        f"from callee_kernels import factor\n{head}\n@compiled\ndef scaled(x):\n    return factor() * x\n", encoding="utf-8"
    )
    for number, changed in ((2, 1_000_000_000), (3, 1_000_000_100)):
        callee = tmp_path / "callee_kernels.py"
        callee.write_text(f"{head}\n@compiled\ndef factor():\n    return {number}\n", encoding="utf-8")
        os.utime(callee, (changed, changed))
        for name in ("callee_kernels", "caller_kernels"):
            sys.modules.pop(name, None)
        importlib.invalidate_caches()
        module._changed.cache_clear()
        assert importlib.import_module("caller_kernels").scaled(5) == 5 * number
    for name in ("callee_kernels", "caller_kernels"):
        sys.modules.pop(name, None)
    module._changed.cache_clear()
