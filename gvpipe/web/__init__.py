"""The web player: geometry videos in a browser, as a page of one file or as a module for others' pages.

``bundle/`` holds what browsers run, built from ``src/`` (see `docs/player.md`): ``geometry-video.js``, the reader, and
``player.js``, the reader with the element ``<geometry-video>``. `export` puts the latter and a file into one page.
"""

from __future__ import annotations

from gvpipe.web.export import ExportReport, export_html

__all__ = ["ExportReport", "export_html"]
