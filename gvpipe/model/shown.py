"""What plays as the last line of a notebook's cell."""

from __future__ import annotations

from importlib import import_module
from typing import Any


class ShownInNotebooks:
    """A sequence or a player that notebooks show: Jupyter asks for its media types, marimo for an object in its place."""

    def _repr_html_(self) -> str:
        raise NotImplementedError

    def _repr_mimebundle_(self, include: object = None, exclude: object = None) -> dict[str, Any]:
        from gvpipe.model.notebook import mimebundle

        return mimebundle(self)

    def _display_(self) -> object:
        from gvpipe.model.notebook import INTERACTIVE

        return import_module(INTERACTIVE).player_or_still(self, self._repr_html_())
