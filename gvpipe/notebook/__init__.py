"""Geometry videos in notebooks: the player as a widget, in step with its traits.

Built on anywidget (extra ``notebook``), which nothing else of gvpipe imports.
"""

from __future__ import annotations

from gvpipe.notebook.showing import show

__all__ = ["show"]
