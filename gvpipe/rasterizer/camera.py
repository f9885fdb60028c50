"""Where a picture is taken from.

Right-handed world, perspective picture. Azimuth 0 looks at the front, which faces +z when y is up (glTF's convention). A
growing azimuth takes the camera to the object's left-hand side (+x), elevation lifts it. With z up the front faces -y, with x
up it faces +z: the same picture, the axes renamed by a rotation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from gvpipe.foundation.arrays import Float32, Float64, Int32
from gvpipe.foundation.errors import InputError

VIEWS = {  # azimuth and elevation, degrees
    "three-quarter": (35.0, 18.0),
    "front": (0.0, 0.0),
    "right": (-90.0, 0.0),
    "left": (90.0, 0.0),
    "back": (180.0, 0.0),
    "top": (0.0, 90.0),
    "bottom": (0.0, -90.0),
}
# columns: where the world's x, y and z go in a frame whose y is up and whose front is +z
UP_AXES = {
    "x": np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
    "y": np.eye(3),
    "z": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]),
}
MARGIN = 0.06  # of half the picture, left free around what is framed
SAMPLED_FRAMES = 64  # frames looked at to frame a motion
TURN_VIEWS = 24  # azimuths looked at to frame a whole turn: between two of them a width changes by less than the margin


class Animation(Protocol):
    """What is framed: a `gvpipe.MeshSequence`, or what has as much of it."""

    @property
    def name(self) -> str: ...

    @property
    def faces(self) -> Int32: ...

    def __len__(self) -> int: ...

    def read(self, start: int, stop: int) -> Float32: ...


@dataclass(frozen=True)
class Camera:
    """A perspective camera that looks at ``target`` from ``distance`` away.

    Args:
        target: the point in the middle of the picture, model units.
        distance: from the eye to the target, model units, above 0.
        azimuth: degrees.
        elevation: degrees.
        up: the world's axis that is up in the picture, ``"x"``, ``"y"`` or ``"z"``.
        field_of_view: of the picture's height, degrees, between 1 and 120.

    Raises:
        InputError: a value out of its range.
    """

    target: tuple[float, float, float] = (0.0, 0.0, 0.0)
    distance: float = 5.0
    azimuth: float = VIEWS["three-quarter"][0]
    elevation: float = VIEWS["three-quarter"][1]
    up: str = "y"
    field_of_view: float = 28.0

    def __post_init__(self) -> None:
        numbers = [*self.target, self.distance, self.azimuth, self.elevation, self.field_of_view]
        if len(self.target) != 3 or not np.isfinite(numbers).all():
            raise InputError(f"the camera holds {numbers}; a target of three numbers and finite numbers are needed")
        if self.distance <= 0:
            raise InputError(f"the camera's distance is {self.distance}; a number above 0 is needed")
        if not 1 <= self.field_of_view <= 120:
            raise InputError(f"the camera's field of view is {self.field_of_view}; 1 to 120 degrees are possible")
        if self.up not in UP_AXES:
            raise InputError(f"the up axis is {self.up!r}; x, y or z is needed")

    @property
    def rotation(self) -> Float64:
        """``(3, 3)``: rows are the picture's right, its up and the way back to the eye, in world axes."""
        azimuth, elevation = np.radians([self.azimuth, self.elevation])
        right = np.array([np.cos(azimuth), 0.0, -np.sin(azimuth)])
        back = np.array([np.sin(azimuth) * np.cos(elevation), np.sin(elevation), np.cos(azimuth) * np.cos(elevation)])
        rows: Float64 = np.stack([right, np.cross(back, right), back]) @ UP_AXES[self.up]
        return rows


def parse_view(text: str) -> tuple[float, float]:
    """Return azimuth and elevation, degrees, of a view's name or of ``"AZIMUTH,ELEVATION"``.

    Raises:
        InputError: neither.
    """
    if text in VIEWS:
        return VIEWS[text]
    try:
        azimuth, elevation = (float(part) for part in text.split(","))
    except ValueError as exc:
        message = f"view {text!r}: one of {', '.join(VIEWS)} or AZIMUTH,ELEVATION in degrees is needed"
        raise InputError(message) from exc
    return azimuth, elevation


def framing(
    sequence: Animation | list[Animation],
    frames: Sequence[int] | None = None,
    view: str | tuple[float, float] = "three-quarter",
    up: str = "y",
    aspect: float = 1.0,
    turntable: bool = False,
    *,
    follow: bool = False,
) -> Camera:
    """Return a camera that holds the whole motion in the picture, with a small margin.

    Four planes bound what a camera sees; each is pushed out until the vertices that triangles use, in at most 64 frames, lie
    inside. The planes' slopes are known beforehand, so that one pass over the frames finds target and distance.

    Args:
        sequence: what moves; of several, all that they show together.
        frames: the frames that are to be seen; by default all.
        view: a name of `VIEWS`, or azimuth and elevation in degrees.
        aspect: width / height of the picture.
        turntable: whether the camera will go once around.
        follow: whether the camera will go with the mesh' `middle`; the one returned is frame 0's.

    Raises:
        InputError: the sequence has no triangles; an unknown view or axis.
    """
    azimuth, elevation = parse_view(view) if isinstance(view, str) else view
    turns = 360.0 / TURN_VIEWS * np.arange(TURN_VIEWS) if turntable else np.zeros(1)
    cameras = [Camera(azimuth=azimuth + turn, elevation=elevation, up=up) for turn in turns]
    rotations = np.stack([camera.rotation for camera in cameras])  # (A, 3, 3), A azimuths
    slope_y = np.tan(np.radians(cameras[0].field_of_view) / 2) * (1 - MARGIN)
    slope_x = slope_y * aspect
    # an eye at z sees what has |x| <= slope_x (z - z of the point): planes of equal x / slope_x + z, and so on
    x, y, z = np.diag([1 / slope_x, 1 / slope_y, 1.0])
    normals = np.stack([x + z, z - x, y + z, z - y, z, -z]) @ rotations  # (A, 6, 3)
    shown = sequence if isinstance(sequence, list) else [sequence]
    reaches = [_reach(each, range(len(each)) if frames is None else frames, normals.reshape(-1, 3), follow) for each in shown]
    reach = np.max(reaches, axis=0).reshape(-1, 6)
    middle = np.stack(
        [(reach[:, 0] - reach[:, 1]) * slope_x, (reach[:, 2] - reach[:, 3]) * slope_y, reach[:, 4] - reach[:, 5]], axis=1
    )
    # a turntable turns about one point: opposite views err in opposite ways, which the mean takes away
    target = np.einsum("ai,aij->j", middle / 2, rotations) / len(turns)
    distance = float((reach[:, :4] - normals[:, :4] @ target).max())
    smallest = 1e-6 * float(np.abs(target).max())  # all at one point: any distance will do
    if follow:
        target = target + middle_of(shown[0].read(0, 1)[0], used_vertices(shown[0]))
    tx, ty, tz = target.tolist()
    return Camera((tx, ty, tz), max(distance, smallest) or 1.0, azimuth, elevation, up)


def sampled(frames: Sequence[int]) -> list[int]:
    """At most 64 of the frames, spread evenly, the first and the last among them."""
    picks = np.unique(np.linspace(0, len(frames) - 1, SAMPLED_FRAMES).round().astype(int))
    return [frames[i] for i in picks]


def used_vertices(sequence: Animation) -> Int32:
    """The vertices that triangles use, in order.

    Raises:
        InputError: there are no triangles.
    """
    if not len(sequence.faces):
        raise InputError(f"{sequence.name} has no triangles, so there is nothing to draw; give a mesh with triangles")
    return np.unique(sequence.faces)


def middle_of(positions: Float32, used: Int32) -> Float64:
    """``(3,)`` mean of the vertices that triangles use; moves evenly where a bounding box' centre would twitch."""
    mean: Float64 = positions[used].mean(axis=0, dtype=np.float64)
    return mean


def _reach(sequence: Animation, frames: Sequence[int], normals: Float64, follow: bool) -> Float64:
    """How far the vertices reach along each of ``normals (n, 3)``, from the origin or from their middle: ``(n,)``."""
    used = used_vertices(sequence)
    reach = np.full(len(normals), -np.inf)
    for frame in sampled(frames):
        positions = sequence.read(frame, frame + 1)[0]
        points = positions[used].astype(np.float64)
        if follow:
            points -= middle_of(positions, used)
        reach = np.maximum(reach, (points @ normals.T).max(axis=0))
    return reach
