"""The public interface as text: python tools/list_interface.py writes tests/public_interface.txt.

A line for each name of `gvpipe.__all__`, `gvpipe.errors`, `gvpipe.codec` and `gvpipe.testing` with its signature, and for each
public attribute and method of its classes. A test compares it with what there is, so that no name and
no argument changes unnoticed.
"""

from __future__ import annotations

import argparse
import dataclasses
import inspect
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gvpipe
import gvpipe.codec
import gvpipe.errors
import gvpipe.testing

TARGET = Path(__file__).parents[1] / "tests" / "public_interface.txt"


def main() -> None:
    """Write the list."""
    argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter).parse_args()
    TARGET.write_text(listed(), "utf-8")


def listed() -> str:
    """The list, a line each."""
    return "\n".join(_lines()) + "\n"


def _lines() -> Iterator[str]:
    for module, names in (
        (gvpipe, sorted(gvpipe.__all__)),
        (gvpipe.errors, sorted(name for name in vars(gvpipe.errors) if name[0].isupper())),
        (gvpipe.codec, sorted(name for name in vars(gvpipe.codec) if name[0].isupper())),
        (gvpipe.testing, sorted(name for name in gvpipe.testing.__all__ if name != "PROMISES")),
    ):
        for name in names:
            value = getattr(module, name)
            yield f"{module.__name__}.{name}{_signature(value)}"
            if inspect.isclass(value):
                yield from (f"{module.__name__}.{name}.{member}" for member in _members(value))


def _members(made: type[Any]) -> list[str]:
    """Public attributes and methods that gvpipe gives a class; of methods with their arguments."""
    own: dict[str, str] = {}
    fields = {field.name for field in dataclasses.fields(made)} if dataclasses.is_dataclass(made) else set[str]()
    for base in reversed([base for base in made.__mro__ if base.__module__.startswith("gvpipe.")]):
        for name, value in vars(base).items():
            if not name.startswith("_") and name not in fields:
                inner = value.__func__ if isinstance(value, classmethod | staticmethod) else value
                own[name] = name + (_signature(inner) if inspect.isfunction(inner) else "")
    return sorted(own.values())


def _signature(value: Any) -> str:
    """Names, kinds and defaults of arguments, without types, whose spelling differs between versions of Python."""
    try:
        found = inspect.signature(value)
    except (TypeError, ValueError):
        return ""
    bare = [each.replace(annotation=each.empty) for each in found.parameters.values()]
    return re.sub(r" object at 0x\w+", "", str(found.replace(parameters=bare, return_annotation=found.empty)))


if __name__ == "__main__":
    main()
