"""Charts packed into a plane: every vertex has a pixel of its own, and its coding comes back."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from surfaces import awkward_surfaces, bumpy_sheet, check_layout

from gvcodecs.mcgv.layout import chart_parameterization, packing
from gvcodecs.mcgv.layout.chart_parameterization import Atlas, parameterize
from gvcodecs.mcgv.layout.coding import (
    decode_clusters,
    decode_pixels,
    decode_slot_clusters,
    encode_clusters,
    encode_pixels,
    encode_slot_clusters,
)
from gvcodecs.mcgv.layout.packing import pack
from gvpipe.errors import InputError


@pytest.mark.parametrize("name", awkward_surfaces())
@pytest.mark.parametrize("block", [pytest.param(8, marks=pytest.mark.slow), 16])
def test_layout_invariants(name: str, block: int) -> None:
    """Every vertex has a pixel of its own inside whole blocks; charts keep to one cluster, blocks to one chart; repeatable."""
    points, faces = awkward_surfaces()[name]
    clusters = np.unique(np.random.default_rng(9).integers(0, 4, len(points)), return_inverse=True)[1].astype(np.int32)
    for labels in (np.zeros(len(points), np.int32), clusters):
        atlas = parameterize(points, faces, labels)
        assert atlas.chart.shape == (len(points),) and set(atlas.chart.tolist()) == set(range(atlas.n_charts))
        assert np.isfinite(atlas.uv).all() and ((atlas.fill > 0) & (atlas.fill <= 1)).all()
        assert len(np.unique(np.c_[atlas.chart, labels], axis=0)) == atlas.n_charts
        layout = pack(atlas, block, 1.5, None)
        check_layout(layout, atlas.chart, block)
        assert np.array_equal(layout.pixel, pack(parameterize(points, faces, labels), block, 1.5, None).pixel)
        order = np.random.default_rng(1).permutation(len(points))  # the codec's, which files have before version 3
        walked = dataclasses.replace(layout, pixel=layout.pixel[order])
        back = decode_pixels(encode_pixels(walked), order, layout.width, layout.height)
        assert np.array_equal(back.pixel, layout.pixel)
        coded = encode_slot_clusters(labels[order])
        assert np.array_equal(decode_slot_clusters(coded, order, 4), labels)
        coded = encode_clusters(labels, layout, block)
        assert np.array_equal(decode_clusters(coded, layout, block, 4), labels)


def test_given_size_fits_or_says_so() -> None:
    """From far too small to generous: an InputError that names the size, or a layout of exactly that size."""
    points, faces = bumpy_sheet(20)
    atlas = parameterize(points, faces, (points[:, 0] > 9).astype(np.int32))
    fitted = []
    for side in range(1, 9):
        for size in ((8 * side, 8 * side), (8 * side, 64), (64, 8 * side)):
            try:
                layout = pack(atlas, 8, 2.0, size)
            except InputError as exc:
                assert f"{size[0]}x{size[1]}" in str(exc) and "\n" not in str(exc)
            else:
                assert (layout.width, layout.height) == size and size[0] * size[1] >= 400
                check_layout(layout, atlas.chart, 8)
                fitted.append(size)
    assert (64, 64) in fitted and (8, 8) not in fitted and (16, 16) not in fitted


def test_points_at_one_place_of_a_chart_get_pixels_of_their_own() -> None:
    """They crowd around it."""
    uv = np.repeat(np.array([[0.0, 0], [1, 0], [0, 1]]), [1, 40, 1], axis=0)
    layout = pack(Atlas(np.zeros(42, np.int32), uv, np.array([0.5])), 8, 1.5, None)
    check_layout(layout, np.zeros(42), 8)


def test_clusters_of_many_triangles_are_cut(monkeypatch: pytest.MonkeyPatch) -> None:
    """Patches of a cluster have charts of their own, as large as the surface, and leave no point out."""
    points, faces = bumpy_sheet(30)
    points = points * 1e-3  # triangles so small that xatlas would drop them in the model's unit
    far = np.append(points, [[1000.0, 0, 0]], axis=0)
    monkeypatch.setattr(chart_parameterization, "PATCH", 400)
    atlas = parameterize(far, faces, np.zeros(len(far), np.int32))
    sizes = np.bincount(atlas.chart[:-1])
    assert 2 <= (sizes > 0).sum() <= 30
    inside = faces[(atlas.chart[faces] == atlas.chart[faces[:, :1]]).all(axis=1)]
    assert len(inside) > 0.7 * len(faces)
    lengths = np.linalg.norm(atlas.uv[inside[:, 0]] - atlas.uv[inside[:, 1]], axis=1)
    wanted = np.linalg.norm(far[inside[:, 0]] - far[inside[:, 1]], axis=1) / 1000
    assert 0.5 < np.median(lengths / wanted) < 1.5
    check_layout(pack(atlas, 16, 1.5, None), atlas.chart, 16)


def test_crowded_places_get_wider_windows() -> None:
    """Squares are counted: what has room takes near pixels, a heap wider windows, more points than pixels none."""
    grid = np.stack(np.meshgrid(np.arange(32.0), np.arange(32.0)), axis=-1).reshape(-1, 2)
    size = np.array([40, 40])
    assert packing._is_roomy(1.25 * grid, size, 1)
    heap = np.tile([[20.0, 20.0]], (200, 1))
    assert [packing._is_roomy(heap, size, half) for half in (1, 2, 4, 8)] == [False, False, False, True]
    assert not packing._is_roomy(np.tile([[20.0, 20.0]], (1601, 1)), size, 64)
    assert packing._assign(np.tile([[8.0, 8.0]], (1000, 1)), np.array([17, 17]), 8) is None
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(packing, "_is_roomy", lambda *given: True)
        assert packing._assign(heap, size, 1) is None and packing._assign(heap, size, 2) is None
    places = packing._assign(heap, size, 8)
    assert places is not None and len(np.unique(places, axis=0)) == 200 and np.abs(places - 20).max() <= 9
