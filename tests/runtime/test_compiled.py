"""A file of machine code that is stale, damaged or another's costs time, and never a result."""

from __future__ import annotations

import importlib
import importlib.util
import logging
import os
import shutil
import sys
import time
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from numba.core import config

from gvpipe.runtime import announcements, claims, machine_code
from gvpipe.runtime.compiled import compiled

KERNELS = """
from {home} import Pair
from callees import SCALE, factor
from gvpipe.runtime.compiled import compiled

@compiled
def total(pair):
    return pair.a + pair.b

@compiled
def double(value):
    return 2 * value

@compiled
def scaled(value):
    return SCALE * factor() * value
"""
PAIR = "from typing import NamedTuple\nclass Pair(NamedTuple):\n    a: float\n    b: float\n"
CALLEES = "from gvpipe.runtime.compiled import compiled\nSCALE = {scale}\n@compiled\ndef factor():\n    return {factor}\n"
MODULES = ("pairs", "elsewhere", "callees", "some_kernels")


@pytest.fixture
def kernels(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """``kernels("pairs")`` loads kernels as a new process would; their `Pair` is of the module of that name."""
    folder = tmp_path / "code"
    folder.mkdir()
    monkeypatch.setattr(machine_code, "own_folder", lambda: folder)
    monkeypatch.setattr(machine_code, "INSTALLED", tmp_path / "installed")

    def load(home: str = "pairs", *, clone: str = "clone", scale: int = 1, factor: int = 1) -> ModuleType:
        forget()
        shutil.rmtree(tmp_path / clone, ignore_errors=True)
        (tmp_path / clone).mkdir()
        monkeypatch.syspath_prepend(str(tmp_path / clone))
        for name, text in (
            (home, PAIR),
            ("callees", CALLEES.format(scale=scale, factor=factor)),
            ("some_kernels", KERNELS.format(home=home)),
        ):
            (tmp_path / clone / f"{name}.py").write_text(text, encoding="utf-8")
        importlib.invalidate_caches()
        return importlib.import_module("some_kernels")

    def forget() -> None:
        for name in MODULES:
            sys.modules.pop(name, None)

    monkeypatch.setattr(sys, "dont_write_bytecode", True)  # of modules that change within a second
    yield load
    forget()


def files(kernel: Any) -> list[Path]:
    """Files of a kernel's machine code."""
    return sorted(Path(kernel.stats.cache_path).glob(f"some_kernels.{kernel.py_func.__name__}-*.nbc"))


def hits(kernel: Any) -> int:
    return sum(kernel.stats.cache_hits.values())


def test_code_comes_from_files(kernels: Any) -> None:
    assert kernels().double(2) == 4
    again = kernels().double
    assert again(3) == 6 and hits(again) == 1


def test_kernels_that_call_loaded_ones(kernels: Any) -> None:
    """Their callee's bitcode is read from its file when they are compiled."""
    assert kernels().double(2) == 4
    double = kernels().double
    assert double(3) == 6 and hits(double) == 1

    @compiled
    def double_and_one(value: int) -> int:
        return int(double(value)) + 1

    assert double_and_one(4) == 9 and double(5) == 10 and hits(double) == 1


def test_one_folder_serves_all_clones(kernels: Any) -> None:
    """Neither a path nor a time is part of a file's name."""
    assert kernels().scaled(2) == 2
    other = kernels(clone="another").scaled
    assert other(3) == 3 and hits(other) == 1


@pytest.mark.parametrize("changed", [{"scale": 5}, {"factor": 5}])
def test_what_a_kernel_names_has_changed(kernels: Any, changed: dict[str, int]) -> None:
    """Machine code holds constants and callees, which may come from another file."""
    assert kernels().scaled(2) == 2
    kernel = kernels(**changed).scaled
    assert kernel(2) == 10 and hits(kernel) == 0


def test_classes_that_have_moved(kernels: Any) -> None:
    """The code for ``pairs.Pair`` names a class that is gone."""
    old = kernels("pairs")
    assert old.total(old.Pair(1.0, 2.0)) == 3
    new = kernels("elsewhere")
    assert new.total(new.Pair(1.0, 2.5)) == 3.5 and hits(new.total) == 0
    again = kernels("elsewhere")
    assert again.total(again.Pair(1.0, 2.5)) == 3.5 and hits(again.total) == 1


@pytest.mark.parametrize(
    "damage",
    [lambda data: b"", lambda data: data[:-9], lambda data: b"\x80" + data, lambda data: data[:99] + b"?" + data[100:]],
    ids=["empty", "cut", "shifted", "flipped"],
)
def test_damaged_files(kernels: Any, damage: Any) -> None:
    assert kernels().double(2) == 4
    kernel = kernels().double
    (path,) = files(kernel)
    path.write_bytes(damage(path.read_bytes()))
    assert kernel(3) == 6 and hits(kernel) == 0
    again = kernels().double
    assert again(4) == 8 and hits(again) == 1  # mended


def test_the_code_of_other_types(kernels: Any) -> None:
    kernel = kernels().double
    assert kernel(2) == 4
    (of_integers,) = files(kernel)
    assert kernel(0.5) == 1.0
    (of_floats,) = set(files(kernel)) - {of_integers}
    of_floats.write_bytes(of_integers.read_bytes())
    mixed = kernels().double
    assert mixed(0.75) == 1.5 and hits(mixed) == 0


def test_other_settings_of_the_compiler(kernels: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    assert kernels().double(2) == 4
    monkeypatch.setattr(config, "BOUNDSCHECK", 1)
    machine_code._surroundings.cache_clear()
    kernel = kernels().double
    assert kernel(3) == 6 and hits(kernel) == 0
    machine_code._surroundings.cache_clear()


def test_a_file_that_cannot_be_replaced(kernels: Any) -> None:
    kernel = kernels().double
    assert kernel(2) == 4
    (path,) = files(kernel)
    path.unlink()
    path.mkdir()
    kernel = kernels().double
    assert kernel(3) == 6
    assert {each.name for each in path.parent.iterdir()} == {path.name, claims.NAME}  # nothing is left half written


def test_no_folder_takes_files(kernels: Any, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture) -> None:
    monkeypatch.setattr(machine_code, "own_folder", lambda: None)
    monkeypatch.setattr(announcements, "why_none", lambda: "none is there")
    announcements._announce.cache_clear()
    with caplog.at_level(logging.INFO, logger="gvpipe.runtime.compiled"):
        assert kernels().double(2) == 4
    assert caplog.messages == [announcements.ONCE, announcements.EVERY_TIME.format("none is there")]


def test_a_file_that_does_not_load_is_said(kernels: Any, caplog: pytest.LogCaptureFixture) -> None:
    """Else a machine whose files never load would compile in every run, and nobody would know why."""
    kernel = kernels().double
    assert kernel(2) == 4
    (path,) = files(kernel)
    path.write_bytes(b"no code")
    announcements._announce.cache_clear()
    announcements._announce_damaged.cache_clear()
    with caplog.at_level(logging.INFO, logger="gvpipe.runtime.compiled"):
        assert kernels().double(3) == 6
    damaged, once = caplog.messages
    assert damaged.startswith("a file of machine code does not load (ValueError: ") and once == announcements.ONCE
    again = kernels().double
    assert again(3) == 6 and hits(again) == 1  # the file was replaced


def test_functions_without_a_file() -> None:
    assert compiled(eval("lambda value: value + 1"))(2) == 3


def test_compiling_is_logged_once(kernels: Any, caplog: pytest.LogCaptureFixture) -> None:
    """At level INFO, so that a library's user sees nothing unasked; loading code from files is not logged."""
    for wanted in ([announcements.ONCE], []):
        announcements._announce.cache_clear()
        caplog.clear()
        with caplog.at_level(logging.INFO, logger="gvpipe.runtime.compiled"):
            loaded = kernels()
            assert (loaded.double(2), loaded.total(loaded.Pair(1.0, 2.0))) == (4, 3)
        assert caplog.messages == wanted


def test_code_of_the_installation(kernels: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """It is found where the user's folder has none: for this processor, and for the portable one if that can stand in."""
    kernel = kernels().double
    assert kernel(2) == 4
    (made,) = files(kernel)
    (signature,) = kernel.signatures
    portable = kernel._cache._name(signature, (machine_code._portable()[0], ""))
    (tmp_path / "installed").mkdir()
    for name, stands_in, found in ((made.name, False, 1), (portable, True, 1), (portable, False, 0)):
        monkeypatch.setattr(machine_code, "stands_in", lambda value=stands_in: value)
        shutil.move(files(kernel)[0], tmp_path / "installed" / name)
        again = kernels().double
        assert again(3) == 6 and hits(again) == found
        if found:
            assert files(kernel) == []
            shutil.move(tmp_path / "installed" / name, made)


def test_the_portable_processor_stands_in_for_none_that_is_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(config, "CPU_NAME", "generic")
    assert not machine_code.stands_in.__wrapped__()


@pytest.mark.usefixtures("kernels")  # so that nothing is loaded
def test_constants_make_no_versions() -> None:
    @compiled
    def scaled(value: Any, factors: Any, shift: int = 0) -> Any:
        return value * factors[0] + factors[1] + shift

    @compiled
    def calls(n: int) -> Any:
        return scaled(1, (2, n)) + scaled(n, (n, 3)) + scaled(4, (5, 6), shift=7)

    assert calls(10) == 12 + 103 + 33
    assert len(scaled.signatures) == 2  # type: ignore[attr-defined]  # with a default, and without


def test_files_that_nobody_reads_go(kernels: Any) -> None:
    kernel = kernels().double
    assert kernel(2) == 4
    (path,) = files(kernel)
    old, stale = path.with_name("some_kernels.double-0.nbc"), time.time() - 100 * machine_code.DAY
    old.write_bytes(b"")
    os.utime(old, (stale, stale))
    os.utime(path, (stale, stale))
    assert kernels().double(2) == 4  # it is read, so it stays
    assert kernel(0.5) == 1.0
    assert not old.exists() and path in files(kernel) and len(files(kernel)) == 2
