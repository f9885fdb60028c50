"""The JavaScript module that anywidget runs: ``widget.js`` with the web player's bundle in it.

The bundle is deflated. A page inflates it once, however many players it shows.
"""

from __future__ import annotations

import base64
import functools
import zlib
from importlib.resources import files


@functools.cache
def module_text() -> str:
    """The module, about 0.7 MB of text."""
    player = (files("gvpipe.web") / "bundle" / "player.js").read_bytes()
    text = (files("gvpipe.notebook") / "widget.js").read_text("utf-8")
    return text.replace("$$PLAYER$$", base64.b64encode(zlib.compress(player, 9)).decode("ascii"))
