"""What a notebook shows of sequences and players."""

from __future__ import annotations

import base64
import io
import re
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

import gvpipe
from gvpipe.model.sequence import MeshSequence


def test_html(sequence: MeshSequence, video: Path, frames: Any) -> None:
    """A picture that shows something, and the numbers."""
    text = frames._repr_html_()
    (data,) = re.findall(r'src="data:image/png;base64,([^"]+)"', text)
    picture = np.asarray(Image.open(io.BytesIO(base64.b64decode(data))))
    assert picture.shape == (240, 240, 3)
    drawn = (picture != picture[0, 0]).any(axis=2).mean()
    assert 0.05 < drawn < 0.9
    for words in ("<td", "72", "128", "11 at 25 per second, 0.44 s"):
        assert words in text
    size = f"{video.stat().st_size} bytes"
    assert (size in text and "mcgv version 1" in text) == isinstance(frames, gvpipe.Player)


def test_html_of_what_cannot_be_painted_or_is_gone(video: Path) -> None:
    points = MeshSequence(np.zeros((2, 3, 3)), np.zeros((0, 3), np.int32), name="<b>points & co</b>")
    text = points._repr_html_()
    assert "<img" not in text and "&lt;b&gt;points &amp; co&lt;/b&gt;" in text and "<td" in text
    player, size = gvpipe.open(video), video.stat().st_size
    video.unlink()
    assert "<img" in player._repr_html_() and f"{size} bytes" in player._repr_html_()


def test_showing_loads_no_renderer(sequence: MeshSequence) -> None:
    import subprocess
    import sys

    heavy = {"gvpipe.rendering", "PIL", "gvpipe.notebook", "IPython"}
    program = f"import sys; from gvpipe import MeshSequence, Player; print({heavy} & set(sys.modules))"
    assert subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout == "set()\n"
