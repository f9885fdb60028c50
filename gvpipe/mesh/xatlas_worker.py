"""The process that runs xatlas: meshes come in, their charts go out, as pickles.

It ends without xatlas's destructor, which can wait for its own threads for ever (`xatlas_process` says more). It is run as a
file and imports NumPy and xatlas alone, so that it starts in a tenth of a second of processor time.
"""

from __future__ import annotations

import os
import pickle
import sys
import traceback
from typing import Any

MAX_COST = 8.0  # xatlas' limit for growing a chart (its default is 2): fewer, larger charts cost fewer blocks
TEXELS_PER_UNIT = 64.0  # only a scale, where others pack the charts

Mesh = tuple[Any, ...]  # positions (n, 3) float32, triangles (m, 3) uint32; other arguments of `charts_of`
Charts = tuple[Any, Any, Any, Any]  # of one mesh, see `charts_of`
_atlases: list[Any] = []  # they stay until the process ends, so that none is destroyed


def main() -> None:
    """Answer one request."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # nothing but the answer may reach it
    pickle.dump([charts_of(*mesh) for mesh in pickle.load(sys.stdin.buffer)], answers, protocol=5)
    answers.flush()


def charts_of(positions: Any, triangles: Any, texels_per_unit: float = TEXELS_PER_UNIT, padding: int = 0) -> Charts:
    """Charts of a mesh, by an atlas of its own: of two meshes in one, the second may free what the first's thread reads.

    Returns the vertex ``(k,)`` of each place, triangles ``(t, 3)`` of places, the places ``(k, 2) float64`` in the mesh's unit,
    and the chart ``(k,) uint32`` of each place. Charts are packed into one picture, ``padding`` texels apart.
    """
    import xatlas

    atlas = xatlas.Atlas()
    _atlases.append(atlas)
    atlas.add_mesh(positions, triangles)
    options, packing = xatlas.ChartOptions(), xatlas.PackOptions()
    options.max_cost = MAX_COST
    packing.texels_per_unit = texels_per_unit
    packing.padding = padding
    packing.rotate_charts = False
    atlas.generate(options, packing)
    vertex, corners, places = atlas.get_mesh(0)
    places = places.astype("f8") * (atlas.width, atlas.height) / atlas.texels_per_unit
    return vertex, corners, places, atlas.get_mesh_vertex_assignment(0)[1]


if __name__ == "__main__":
    try:
        main()
    except BaseException:
        traceback.print_exc()
        sys.stderr.flush()
        os._exit(1)
    os._exit(0)
