"""What ``gvpipe encode-all`` recorded of the files in a folder: a manifest beside them, of JSON Lines.

A manifest is a convenience here: of a line that is none, and of a file that has changed since, nothing is recorded.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from gvpipe.foundation.isolation.plain_files import open_plain

NAME = "manifest.jsonl"
MAX_BYTES = 1 << 30
ERRORS = ("kg", "rmse", "rmse_diag", "max", "max_diag")


@dataclass(frozen=True)
class Recorded:
    """Descriptions of files in a folder, by path below it, each with the bytes of its file; and the settings of the run."""

    folder: Path
    descriptions: Mapping[str, tuple[int, dict[str, Any]]] = field(default_factory=dict)
    settings: Mapping[str, Any] = field(default_factory=dict)

    def of(self, path: Path, n_bytes: int) -> dict[str, Any]:
        """What is recorded of a file of so many bytes; empty if nothing is."""
        size, found = self.descriptions.get(path.relative_to(self.folder).as_posix(), (-1, {}))
        return found if size == n_bytes else {}


def read_recorded(folder: Path) -> Recorded:
    """Read the manifest of a folder; nothing is recorded where there is none."""
    try:
        with open_plain(folder / NAME, follows=False) as file:
            lines = file.read(MAX_BYTES).splitlines()
    except OSError:
        return Recorded(folder)
    descriptions: dict[str, tuple[int, dict[str, Any]]] = {}
    settings: dict[str, Any] = {}
    for line in lines:
        try:
            entry = json.loads(line)
        except (ValueError, RecursionError):
            continue
        if isinstance(entry, dict) and isinstance(entry.get("output"), str) and isinstance(entry.get("bytes"), int):
            found = entry.get("description")
            descriptions[entry["output"]] = entry["bytes"], found if isinstance(found, dict) else {}
            settings = entry["settings"] if isinstance(entry.get("settings"), dict) else settings
            if isinstance(entry.get("decided"), str) and entry["decided"]:
                settings = {**settings, "decided": entry["decided"]}
    return Recorded(folder, descriptions, settings)
