"""Pictures that end early are kept, and noticed when they are read."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from gvpipe import io
from gvpipe.io.cut_pictures import is_cut


def picture(kind: str) -> bytes:
    stream = BytesIO()
    noise = np.random.default_rng(1).integers(0, 255, (40, 40, 3), np.uint8)
    Image.fromarray(noise).save(stream, kind)
    return stream.getvalue()


@pytest.mark.parametrize("kind", ["PNG", "JPEG", "WEBP"])
def test_every_cut_is_seen(kind: str) -> None:
    whole = picture(kind)
    assert not is_cut(whole) and not is_cut(whole + b"\0\0")
    assert all(is_cut(whole[:stop]) for stop in range(8, len(whole) - 1, 61))


def test_a_texture_that_is_cut(tmp_path: Path) -> None:
    whole = picture("PNG")
    (tmp_path / "a.obj").write_text("mtllib a.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n")
    (tmp_path / "a.mtl").write_text("newmtl a\nmap_Kd a.png\n")
    for data, n_notes in ((whole, 0), (whole[:-500], 1)):
        (tmp_path / "a.png").write_bytes(data)
        read = io.read(tmp_path / "a.obj")
        assert len(read.images) == 1 and read.images[0].data == data
        assert [note for note in read.notes if "is cut short" in note] == list(read.notes)[-n_notes:] * n_notes
