"""What stays of a player in a saved notebook: a still, and the player as one page that starts at a click.

Viewers that run no scripts, such as GitHub's, show the still. nbconvert's pages and notebooks that are opened without a kernel
play. The player is not started by itself: a notebook may have many, and browsers draw few at a time.
"""

from __future__ import annotations

import base64
import html

from gvpipe.foundation.errors import GvpipeError
from gvpipe.foundation.text import escaped
from gvpipe.model.notebook import png
from gvpipe.notebook.prepared import Prepared, show_bytes
from gvpipe.web.export import page_text
from gvpipe.web.page_view import PageView

MOST_EMBEDDED = 4 << 20  # bytes of a file that a notebook holds unless it is told to
LEFT_OUT = "the player is not in this notebook; run the cell"
# JupyterLab says above it that there is no widget
STYLE = """.jp-OutputArea-child:has(+ .jp-OutputArea-child [data-gvpipe="ID"]) .jupyter-widgets:not(:has(geometry-video)) {
  display: none
}"""
SCRIPT = """(() => {
  const holder = document.querySelector('[data-gvpipe="ID"]');
  const button = holder.querySelector("button");
  button.hidden = false;
  button.addEventListener("click", () => {
    const frame = document.createElement("iframe");
    frame.srcdoc = holder.querySelector("[data-page]").dataset.page;
    frame.allowFullscreen = true;
    frame.style.cssText = "width: 100%; height: HEIGHTpx; border: 0";
    holder.replaceChildren(frame);
  });
})();"""


def picture(prepared: Prepared) -> bytes | None:
    """A PNG still of the first frame; None for a mesh that cannot be painted."""
    try:
        return png(prepared.player.sequence())
    except GvpipeError:
        return None


def is_embedded(prepared: Prepared, embed: bool | None) -> bool:
    """Whether a saved notebook holds the player and the file; None: if that is small."""
    return prepared.source.size <= MOST_EMBEDDED if embed is None else embed


def saved_html(
    prepared: Prepared, view: PageView, up: str, identifier: str, still: bytes | None, height: int, embed: bool | None
) -> str:
    """HTML of a still with its numbers, and of a button that starts the player where scripts run.

    Args:
        prepared: the geometry video.
        view: how it opens.
        up: the axis that stands upright.
        identifier: of the widget, which hides this while it is there.
        still: a PNG picture.
        height: of the player, pixels.
        embed: as for `is_embedded`.
    """
    parts, words = [], [prepared.described()]
    if still is not None:
        text = base64.b64encode(still).decode("ascii")
        parts.append(
            f'<img style="display: block" alt="first frame of {_safe(prepared.name)}" src="data:image/png;base64,{text}">'
        )
    if is_embedded(prepared, embed):
        page = page_text(prepared.name, prepared.data(), up, view)
        words.append(f"player and file, {show_bytes(len(page))} in this notebook; embed=False leaves them out")
        parts.append(f'<button hidden type="button" data-page="{html.escape(page)}">&#9654; Play</button>')
        parts.append(f"<script>{SCRIPT.replace('ID', identifier).replace('HEIGHT', str(height))}</script>")
    else:
        words.append(LEFT_OUT)
    lines = "".join(f"<div>{_safe(each)}</div>" for each in words)
    style = f"<style>{STYLE.replace('ID', identifier)}</style>"
    return f'<div data-gvpipe="{identifier}">{style}{lines}{"".join(parts)}</div>'


def _safe(text: str) -> str:
    return html.escape(escaped(text))
