"""What the process that runs ufbx answers: tuples of plain values, so that it need not load NumPy.

The other process makes arrays of `Numbers`, `gvpipe.io.fbx.meshes` and `gvpipe.io.fbx.materials` make the rest.
"""

from __future__ import annotations

from typing import NamedTuple


class Take(NamedTuple):
    """An animation of the file; times in seconds."""

    name: str
    start: float
    stop: float


class Numbers(NamedTuple):
    """Bytes of numbers; the code is that of `struct`, such as ``"d"``."""

    code: str
    data: bytes


class Placed(NamedTuple):
    """How a node's evaluated positions go to the world; each matrix is the 12 numbers of four columns.

    Args:
        to_world: of the node's geometry.
        is_local: whether positions are those of the geometry, not yet of the world.
        bound: where several nodes show one skinned mesh, the matrices from the geometry to its first bone and from that to
            the world, when the mesh was bound; otherwise None.
    """

    to_world: tuple[float, ...]
    is_local: bool
    bound: tuple[tuple[float, ...], tuple[float, ...]] | None


class Posed(NamedTuple):
    """One mesh at a time: rows of three coordinates, where they go, and whether it is hidden then."""

    positions: Numbers
    placed: Placed
    is_hidden: bool


class Table(NamedTuple):
    """Values, and the index of one for each corner."""

    name: str
    values: Numbers
    indices: Numbers


class Mesh(NamedTuple):
    """A node's mesh: faces are pairs of first corner and number of corners, ``materials`` the ids of what it shows.

    Normals are those at the time that was asked for.
    """

    name: str
    parent: str
    n_vertices: int
    faces: Numbers
    corners: Numbers
    groups: Numbers
    materials: tuple[int, ...]
    uv: list[Table]
    colors: list[Table]
    normals: Table | None
    placed: Placed


class Picture(NamedTuple):
    """How a map shows a picture; ``key`` names that, the rest is where it may lie, how it wraps, and its set of coordinates."""

    key: str
    name: str
    relative: str
    wrap: tuple[int, int]
    uv_set: str


class Map(NamedTuple):
    """A value of a material, None if it has none, and the picture in its place, or None."""

    value: tuple[float, float, float, float] | None
    picture: Picture | None


class Shown(NamedTuple):
    """A material: ``maps`` by ufbx's names of its physically based model."""

    id: int
    name: str
    maps: dict[str, Map]
    is_double_sided: bool


class Described(NamedTuple):
    """What an FBX file holds beside motion.

    Args:
        meshes: of the nodes that show one.
        n_hidden: nodes whose mesh is hidden, which were left out.
        materials: of the scene.
        contents: pictures inside the file, by key.
        fps, unit, up, creator: of the scene; the unit in metres.
        others: how many there are of each kind of thing that is not read.
    """

    meshes: list[Mesh]
    n_hidden: int
    materials: list[Shown]
    contents: dict[str, bytes]
    fps: float
    unit: float
    up: str
    creator: str
    others: dict[str, int]
