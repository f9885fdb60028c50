"""Surfaces for the layouts of mcgv, awkward ones among them, and what every layout promises."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from gvcodecs.mcgv.layout.layout import Layout


def bumpy_sheet(n: int = 9, seed: int = 0) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """A sheet of n^2 vertices with random bumps, so that no neighbourhood is flat."""
    x, y = np.meshgrid(np.arange(float(n)), np.arange(float(n)))
    random = np.random.default_rng(seed)
    points = np.stack([x.ravel(), y.ravel(), random.normal(0, 1, n * n)], axis=1)
    a = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    return points, np.concatenate([np.stack([a, a + 1, a + n + 1], 1), np.stack([a, a + n + 1, a + n], 1)]).astype(np.int32)


def awkward_surfaces() -> dict[str, tuple[NDArray[np.float64], NDArray[np.int32]]]:
    points, faces = bumpy_sheet(12)
    random = np.random.default_rng(8)
    soup = random.normal(size=(90, 3))
    fan = np.array([[0, i, i + 1] for i in range(1, 40)], np.int32)
    return {
        "sheet": (points, faces),
        "unreferenced": (np.vstack([points, random.normal(size=(30, 3))]), faces),
        "soup": (soup, np.arange(90, dtype=np.int32).reshape(30, 3)),
        "non-manifold": (soup[:42], np.vstack([fan, fan[:, ::-1], [[0, 1, 41]]]).astype(np.int32)),
        "degenerate": (np.vstack([points, points[:5]]), np.vstack([faces, [[0, 0, 1], [144, 145, 146]]]).astype(np.int32)),
        "one triangle": (soup[:3], np.array([[0, 1, 2]], np.int32)),
        "a point": (soup[:1], np.zeros((0, 3), np.int32)),
        "all in one place": (np.zeros((20, 3)), np.arange(18, dtype=np.int32).reshape(6, 3)),
        "a line": (np.outer(np.arange(20.0), [1, 0, 0]), np.array([[i, i + 1, i + 2] for i in range(18)], np.int32)),
        "tiny": (points * 1e-20, faces),
        "huge and far": (points * 1e20 + 1e24, faces),
    }


def check_layout(layout: Layout, chart: NDArray[Any], block: int) -> None:
    assert layout.width % block == layout.height % block == 0
    assert len(np.unique(layout.pixel)) == len(layout.pixel) == len(chart)
    assert layout.pixel.min() >= 0 and layout.pixel.max() < layout.width * layout.height
    y, x = np.divmod(layout.pixel, layout.width)
    owner: dict[tuple[int, int], int] = {}
    for by, bx, c in zip((y // block).tolist(), (x // block).tolist(), chart.tolist(), strict=True):
        assert owner.setdefault((by, bx), c) == c


def affine_maps(n: int, seed: int = 1) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """``(n, 3, 3)`` matrices (as x A) and ``(n, 3)`` translations."""
    random = np.random.default_rng(seed)
    return np.eye(3) + random.normal(0, 0.4, (n, 3, 3)), random.normal(0, 3, (n, 3))
