"""Many rigid bodies as one mesh whose parts move: robots, mechanisms, bodies of a physics engine."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from gvpipe.asset.part import Part
from gvpipe.foundation.arrays import Float32, Float64, Int32
from gvpipe.foundation.errors import InputError
from gvpipe.recording.arrays import as_array


class RigidParts:
    """Bodies that stay as they are, each a named part of one mesh, in ``faces`` and ``parts`` of a recording.

    Args:
        bodies: by name, each a pair of vertices ``(V, 3)`` and triangles ``(T, 3)``, or an object with ``vertices`` and
            ``faces``, as trimesh's.

    Raises:
        InputError: there is none, or one is no mesh.

    Examples:
        >>> corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
        >>> robot = RigidParts({"arm": (corners, [[0, 1, 2]]), "hand": (corners, [[0, 1, 2]])})
        >>> raised = np.eye(4)
        >>> raised[2, 3] = 5
        >>> robot.positions({"hand": raised})[[0, 3]].tolist()
        [[0.0, 0.0, 0.0], [0.0, 0.0, 5.0]]
        >>> [part.name for part in robot.parts]
        ['arm', 'hand']
    """

    def __init__(self, bodies: Mapping[str, Any]) -> None:
        if not bodies:
            raise InputError("there are no bodies; give meshes by name")
        self._rest: dict[str, Float64] = {}
        faces, parts, n_vertices, n_triangles = [], [], 0, 0
        for name, body in bodies.items():
            given = body if isinstance(body, tuple | list) else (getattr(body, "vertices", None), getattr(body, "faces", None))
            points, triangles = (as_array(each, f"body {name!r}") for each in given)
            if points.ndim != 2 or points.shape[1] != 3 or triangles.ndim != 2 or triangles.shape[1] != 3:
                shapes = f"{points.shape} and {triangles.shape}"
                raise InputError(f"body {name!r} has shapes {shapes}; vertices (V, 3) and triangles (T, 3) are needed")
            if triangles.min(initial=0) < 0 or triangles.max(initial=0) >= len(points):
                raise InputError(f"body {name!r} has a triangle with a vertex outside of 0..{len(points) - 1}")
            self._rest[name] = points.astype(np.float64)
            faces.append(triangles.astype(np.int64) + n_vertices)
            ends = n_vertices + len(points), n_triangles + len(triangles)
            parts.append(Part(name, (n_vertices, ends[0]), (n_triangles, ends[1])))
            n_vertices, n_triangles = ends
        self.faces: Int32 = np.concatenate(faces).astype(np.int32)
        self.parts = tuple(parts)

    def positions(self, transforms: Mapping[str, Any]) -> Float32:
        """All vertices, ``(V, 3)``, where each body is moved by its matrix ``(4, 4)``; one that is not named stays at rest.

        Raises:
            InputError: there is no such body, or a matrix of another shape.
        """
        for name in transforms:
            if name not in self._rest:
                raise InputError(f"there is no body {name!r}; there are {', '.join(map(repr, self._rest))}")
        moved = []
        for name, points in self._rest.items():
            if name in transforms:
                matrix = as_array(transforms[name], f"the transform of {name!r}")
                if matrix.shape != (4, 4):
                    raise InputError(f"the transform of {name!r} has shape {matrix.shape}; (4, 4) is needed")
                points = points @ matrix[:3, :3].T + matrix[:3, 3]
            moved.append(points)
        result: Float32 = np.concatenate(moved).astype(np.float32)
        return result
