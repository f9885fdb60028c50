"""Functions that load their module when they are first called: a file needs the modules of its own format alone."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from importlib import import_module
from typing import Any


def late(module: str, name: str) -> Callable[..., Any]:
    """A function that calls what ``gvpipe.io.MODULE`` has by that name."""
    return partial(_call, f"{__package__}.{module}", name)


def _call(module: str, name: str, *arguments: Any) -> Any:
    return getattr(import_module(module), name)(*arguments)
