"""What `gvpipe bench` measured, as JSON files: written whole, and checked when they are read."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

from gvpipe.foundation.atomic import unnamed_path
from gvpipe.foundation.errors import InputError

NUMBER = int | float | None
Results = TypeVar("Results")


class WrongValue(ValueError):
    """What a file lacks or holds that results do not."""


def write_results(path: str | os.PathLike[str], values: Mapping[str, Any]) -> None:
    """Write a JSON file; raises `OutputError` if that fails."""
    with unnamed_path(path) as temporary:
        temporary.write_text(json.dumps(values, indent=1, allow_nan=False) + "\n", "utf-8")


def read_results(path: str | os.PathLike[str], parse: Callable[[Any], Results]) -> Results:
    """Mirror of `write_results`: what ``parse`` makes of the file's value; `InputError` where it raises `WrongValue`."""
    try:
        return parse(json.loads(Path(path).read_text("utf-8")))
    except OSError as exc:
        raise InputError(f"{path} cannot be read: {exc.strerror or exc}; check the path") from exc
    except UnicodeDecodeError as exc:
        raise _no_results(path, "it is no text") from exc
    except RecursionError as exc:
        raise _no_results(path, "its JSON is nested too deeply") from exc
    except json.JSONDecodeError as exc:
        raise _no_results(path, f"line {exc.lineno} is no JSON") from exc
    except WrongValue as exc:
        raise _no_results(path, str(exc)) from exc


def checked(values: Any, types: Mapping[str, Any], what: str) -> dict[str, Any]:
    """Return an object of the file, whose values under the keys of ``types`` have those types; raises `WrongValue`."""
    if not isinstance(values, dict):
        raise WrongValue(f"{what} is no object")
    for key, kind in types.items():
        if key not in values:
            raise WrongValue(f"{what} has no {key}")
        if not isinstance(values[key], kind):
            raise WrongValue(f"{what} has {key} of another type")
    return values


def _no_results(path: str | os.PathLike[str], why: str) -> InputError:
    return InputError(f"{path} is not what `gvpipe bench --json` writes: {why}; give that file, or measure again")
