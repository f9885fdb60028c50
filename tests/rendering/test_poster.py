"""The poster is a grey picture of the mesh that lasts."""

from __future__ import annotations

import io

import av
import numpy as np
import pytest

from gvpipe.model.sequence import MeshSequence
from gvpipe.rasterizer.camera import framing
from gvpipe.rasterizer.renderer import Renderer
from gvpipe.rendering.poster import SIZE, make_poster, paint


def test_poster_is_a_grey_picture_of_the_mesh_that_lasts(sequence: MeshSequence) -> None:
    first = sequence.read(0, 1)[0]
    data = make_poster(first, sequence.faces, 25.0, 11)
    with av.open(io.BytesIO(data), "r") as film:
        (picture,) = film.decode(video=0)
        track = film.streams.video[0]
        assert track.duration is not None and track.time_base is not None
        assert track.duration * track.time_base == pytest.approx(11 / 25)
    luma = picture.to_ndarray()[:SIZE].astype(int)  # the Y plane of yuv420p
    assert np.abs(luma - paint(first, sequence.faces)).mean() < 4
    camera = framing(sequence, [0])
    seen = Renderer(sequence.faces, first, (SIZE, SIZE), samples=1).visible(first, camera) >= 0
    assert 0.1 < seen.mean() < 0.9
    assert np.abs(luma[~seen] - luma[0, 0]).mean() < 6 and (luma[seen] < luma[0, 0] - 15).mean() > 0.9
