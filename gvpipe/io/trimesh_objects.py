"""Frames of a sequence as meshes of trimesh."""

from __future__ import annotations

import io
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from gvpipe.foundation.arrays import Array
from gvpipe.model.capture import one_frame
from gvpipe.model.sequence import MeshSequence

if TYPE_CHECKING:
    import trimesh


def to_trimesh(source: Any, frame: int = 0) -> trimesh.Trimesh:
    """One frame as a ``trimesh.Trimesh``, whose vertices and triangles keep their order.

    Attributes and fields are ``vertex_attributes`` and ``face_attributes``. Colours of vertices are drawn, else texture
    coordinates of vertices, with the picture of the only material. trimesh has no place for parts and numbers per corner.

    Args:
        source: a `gvpipe.Player`, `gvpipe.CapturePlayer`, `gvpipe.MeshSequence` or `gvpipe.Capture`.
        frame: its number; negative ones count from the end.

    Raises:
        IndexError: there is no such frame.

    Examples:
        >>> from gvpipe import MeshSequence
        >>> corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
        >>> heat = np.array([[1, 2, 3], [4, 5, 6]], np.float32)
        >>> mesh = to_trimesh(MeshSequence([corners, corners], [[0, 1, 2]], fields={"heat": heat}), 1)
        >>> mesh, mesh.vertex_attributes["heat"].tolist()
        (<trimesh.Trimesh(vertices.shape=(3, 3), faces.shape=(1, 3))>, [4.0, 5.0, 6.0])
    """
    library: Any = import_module("trimesh")
    one = one_frame(source, frame)
    numbers = {key: np.asarray(each) for key, each in one.attributes.items()}
    numbers |= {key: each.read(0, 1)[0] for key, each in one.fields.items()}
    kinds = {key: (each.domain, each.kind) for group in (one.attributes, one.fields) for key, each in group.items()}

    def of(domain: str) -> dict[str, Array]:
        held = {key: values for key, values in numbers.items() if kinds[key][0] == domain}
        return {key: values[:, 0] if values.shape[1] == 1 else values for key, values in held.items()}

    mesh: trimesh.Trimesh = library.Trimesh(
        one.read_absolute(0, 1)[0],
        one.faces,
        vertex_colors=next((numbers[key] for key, what in kinds.items() if what == ("vertex", "color")), None),
        vertex_attributes=of("vertex"),
        face_attributes=of("triangle"),
        process=False,
    )
    uv = next((numbers[key] for key, what in kinds.items() if what == ("vertex", "uv")), None)
    if uv is not None and mesh.visual is not None and not mesh.visual.defined:
        mesh.visual = library.visual.TextureVisuals(uv, image=_picture(one))
    return mesh


def _picture(one: MeshSequence) -> Any:
    """The picture of the only material, as Pillow opens it; None where there is none."""
    texture = one.materials[0].base_color_texture if len(one.materials) == 1 else None
    if texture is None or one.images[texture.image].size is None:
        return None
    from PIL import Image

    return Image.open(io.BytesIO(one.images[texture.image].frame(0).data))
