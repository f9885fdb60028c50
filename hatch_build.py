"""Build hook: a wheel that holds machine code (`gvpipe warmup --installed`) is for one system and one version of Python."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class MachineCodeHook(BuildHookInterface):  # type: ignore[misc,type-arg]  # hatchling is there while a wheel is built
    """Tag the wheel after what it holds; without machine code it is for all systems."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Called before the wheel is written; ``version`` is "editable" or "standard"."""
        if version == "standard" and any(Path(self.root, "gvpipe", "runtime", "kernels").glob("*.nbc")):
            build_data["pure_python"] = False
            build_data["infer_tag"] = True
