"""While a kernel is compiled, Python rarely searches for garbage; afterwards as often as before."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from typing import Any

import pytest

from gvpipe.runtime.borrowing import BorrowingCompiler
from gvpipe.runtime.quick_kernels import RARELY, quick


@pytest.fixture(autouse=True)
def threshold() -> Iterator[None]:
    """Tests change that of all of Python."""
    before = gc.get_threshold()
    yield
    gc.set_threshold(*before)


def add_one(value: float) -> float:
    return value + 1.0


@pytest.mark.parametrize(("before", "meanwhile"), [(700, RARELY), (2 * RARELY, 2 * RARELY), (0, 0)])
def test_searches_are_rare_meanwhile(before: int, meanwhile: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also where compiling fails. Zero: whoever runs this wants no searches."""
    seen = []

    def fail(*_: Any) -> None:
        seen.append(gc.get_threshold())
        raise KeyError

    monkeypatch.setattr(BorrowingCompiler, "compile_extra", fail)
    gc.set_threshold(before, 7, 11)
    with pytest.raises(KeyError):
        quick(add_one)(1)
    assert seen == [(meanwhile, 7, 11)] and gc.get_threshold() == (before, 7, 11)


def test_searches_are_as_often_afterwards() -> None:
    gc.set_threshold(700, 7, 11)
    assert quick(add_one)(1.0) == 2.0
    assert gc.get_threshold() == (700, 7, 11)
