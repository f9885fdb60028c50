"""The dual of a triangle mesh: one vertex per triangle, and triangles between those that meet at a vertex.

The triangles around an interior vertex form a closed fan. Their dual vertices are a polygon, which a strip from side to side
triangulates; a strip adds few triangles to any one of them. Around other vertices the fan is open, and the strip is as well.
Everything is an integer.
"""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Int32


def dual_triangles(faces: Int32, n_vertices: int) -> Int32:
    """Return triangles ``(n, 3) int32`` over the T triangles of ``faces (T, 3)``, wound as they are.

    Examples:
        >>> fan = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1]], np.int32)
        >>> dual_triangles(fan, 5).tolist()
        [[0, 1, 3], [1, 2, 3]]
    """
    from gvpipe.fields.dual_kernels import find_dual

    dual: Int32 = find_dual(np.ascontiguousarray(faces, np.int32), n_vertices)
    return dual
