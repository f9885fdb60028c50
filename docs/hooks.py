"""What pages of the site need beside their own files: the web player's bundle, under the name ``player.js``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

PLAYER = Path(__file__).parents[1] / "gvpipe" / "web" / "bundle" / "player.js"


def on_files(files: Any, config: Any) -> Any:
    """Add the bundle to the files of the site; mkdocs calls this."""
    from mkdocs.structure.files import File

    files.append(File.generated(config, "player.js", abs_src_path=str(PLAYER)))
    return files
