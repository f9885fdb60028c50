"""Charts packed into a plane: every vertex has a pixel of its own, and its coding comes back."""

from __future__ import annotations

import numpy as np
import pytest
from surfaces import awkward_surfaces, bumpy_sheet, check_layout

from gvcodecs.mcgv.layout import chart_parameterization
from gvcodecs.mcgv.layout.chart_groups import share_blocks
from gvcodecs.mcgv.layout.chart_parameterization import Atlas, parameterize
from gvcodecs.mcgv.layout.coding import (
    decode_clusters,
    decode_pixels,
    decode_slot_clusters,
    encode_clusters,
    encode_pixels,
    encode_slot_clusters,
)
from gvcodecs.mcgv.layout.packing import distinct_pixels, pack
from gvpipe.foundation.errors import InputError


@pytest.mark.parametrize("name", awkward_surfaces())
@pytest.mark.parametrize("block", [pytest.param(8, marks=pytest.mark.slow), 16])
def test_layout_invariants(name: str, block: int) -> None:
    """Every vertex has a pixel of its own inside whole blocks; charts keep to one cluster, blocks to one chart; repeatable."""
    points, faces = awkward_surfaces()[name]
    clusters = np.unique(np.random.default_rng(9).integers(0, 4, len(points)), return_inverse=True)[1].astype(np.int32)
    for labels in (np.zeros(len(points), np.int32), clusters):
        atlas = parameterize(points, faces, labels)
        assert atlas.chart.shape == (len(points),) and set(atlas.chart.tolist()) == set(range(atlas.n_charts))
        assert np.isfinite(atlas.uv).all() and (atlas.uv >= 0).all()
        assert len(np.unique(np.c_[atlas.chart, labels], axis=0)) == atlas.n_charts
        check_layout(pack(atlas, block, 1.5, None), atlas.chart, block)
        shared = share_blocks(atlas, labels, block**2)
        assert len(np.unique(np.c_[shared.chart, labels], axis=0)) == shared.n_charts <= atlas.n_charts
        layout = pack(shared, block, 1.0, None)
        check_layout(layout, shared.chart, block)
        again = share_blocks(parameterize(points, faces, labels), labels, block**2)
        assert np.array_equal(layout.pixel, pack(again, block, 1.0, None).pixel)
        back = decode_pixels(encode_pixels(layout), len(points), layout.width, layout.height)
        assert np.array_equal(back.pixel, layout.pixel)
        assert np.array_equal(decode_slot_clusters(encode_slot_clusters(labels), len(labels), 4), labels)
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
    layout = pack(Atlas(np.zeros(42, np.int32), uv), 8, 1.5, None)
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


def test_distinct_places_stay() -> None:
    """Points that want different pixels get them, near enough or exactly, in a rectangle that they fill or not."""
    grid = np.stack(np.meshgrid(np.arange(32), np.arange(24)), axis=-1).reshape(-1, 2)
    rng = np.random.default_rng(2)
    for share in (1.0, 0.5, 0.01):
        chosen = rng.permutation(grid)[: int(share * len(grid))]
        near = chosen + rng.uniform(-0.49, 0.49, chosen.shape)
        assert np.array_equal(distinct_pixels(near, np.array([32, 24])), chosen)


def test_crowded_points_get_the_pixels_around_them() -> None:
    """A heap fills the pixels of a square beside it, and points elsewhere stay where they are."""
    wanted = np.append(np.full((64, 2), 16.2), [[2.0, 3], [30, 30]], axis=0)
    places = distinct_pixels(wanted, np.array([32, 32]))
    assert len(np.unique(places, axis=0)) == 66 and ((places >= 0) & (places < 32)).all()
    assert np.abs(places[:64] - 16).max() <= 8 and places[64:].tolist() == [[2, 3], [30, 30]]
    full = distinct_pixels(np.zeros((60, 2)), np.array([12, 5]))
    assert len(np.unique(full, axis=0)) == 60 and full.max(axis=0).tolist() == [11, 4]
    sheet = np.stack(np.meshgrid(np.arange(40) * 0.5, np.arange(40) * 0.5), axis=-1).reshape(-1, 2)  # four points a pixel
    spread = distinct_pixels(sheet + 10, np.array([40, 40]))
    assert len(np.unique(spread, axis=0)) == 1600
    assert np.corrcoef(spread[:, 0], sheet[:, 0])[0, 1] > 0.9 and np.corrcoef(spread[:, 1], sheet[:, 1])[0, 1] > 0.9


def test_small_charts_of_a_cluster_share_blocks() -> None:
    """Groups have at most a block's room and one cluster; their charts lie apart; large charts are as they were."""
    rng = np.random.default_rng(4)
    sizes = np.array([3, 90, 40, 300, 12, 100, 1, 64, 30, 70])
    cluster = np.array([0, 0, 0, 0, 0, 1, 1, 1, 1, 1])
    chart = np.repeat(np.arange(10), sizes).astype(np.int32)
    uv = rng.uniform(0, 1, (len(chart), 2)) * rng.uniform(0.1, 9, (10, 2))[chart]
    uv -= np.array([uv[chart == k].min(axis=0) for k in range(10)])[chart]
    shared = share_blocks(Atlas(chart, uv), cluster[chart], 128)
    joined = [sorted(set(chart[shared.chart == k].tolist())) for k in range(shared.n_charts)]
    assert sorted(joined) == [[0, 1, 4], [2], [3], [5, 6], [7], [8, 9]]
    assert np.array_equal(shared.uv[chart == 3], uv[chart == 3])
    for group in joined:
        boxes = [(shared.uv[chart == k].min(axis=0), shared.uv[chart == k].max(axis=0)) for k in group]
        for i, (low, high) in enumerate(boxes):
            assert all((low > other_high).any() or (high < other_low).any() for other_low, other_high in boxes[:i])
    assert share_blocks(Atlas(chart, uv), np.arange(10)[chart], 128).n_charts == 10
