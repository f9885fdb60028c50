"""Which ``mcgv`` bitstreams the web player decodes."""

from __future__ import annotations

from gvpipe.container.bitstream import Bitstream
from gvpipe.media.video import PROFILES

VERSION = 5  # the highest that gvpipe/web/src/mcgv reads


def browser_obstacle(bitstream: Bitstream) -> str:
    """Return what of an ``mcgv`` bitstream keeps browsers from playing it, in a few words; ``""`` if they play it."""
    header = bitstream.header
    if bitstream.version > VERSION:
        return f"{bitstream.codec}, version {bitstream.version}"
    if header.get("pictures") is False or header.get("profile") in PROFILES:
        return ""
    return f"{bitstream.codec}, profile {header.get('profile')}"
