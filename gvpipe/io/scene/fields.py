"""Numbers of a scene's meshes that change over time, as fields of the sequence."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gvpipe.asset.field import Field
from gvpipe.foundation.arrays import Array
from gvpipe.foundation.errors import InputError
from gvpipe.io.damage import reading
from gvpipe.io.scene.mesh import Fans


@dataclass(frozen=True)
class Sampled:
    """Numbers that change, on one mesh.

    Args:
        at: gives ``(rows,)`` or ``(rows, C)`` at a time of the file's own.
        kind: as of `gvpipe.Field`.
        domain: ``"vertex"`` or ``"polygon"``.
    """

    at: Callable[[float], Array]
    kind: str
    domain: str


class FieldFrames:
    """Values ``(F, R)`` or ``(F, R, C)`` of one name on all meshes, evaluated when sliced; 0 where it is missing.

    Slicing raises `InputError` with the name of the file, ``where``.
    """

    def __init__(
        self, name: str, found: Sequence[Sampled | None], sizes: Sequence[int], fans: Sequence[Fans], times: Array, where: str
    ) -> None:
        self._name, self._found, self._fans, self._times, self._where = name, found, fans, times, where
        present = next(each for each in found if each is not None)
        first = present.at(float(times[0]))
        self._is_polygon = present.domain == "polygon"
        self._sizes = [len(each.triangle_source) for each in fans] if self._is_polygon else list(sizes)
        tail = () if first.ndim == 1 else (first.shape[1],)
        self.shape: tuple[int, ...] = (len(times), sum(self._sizes), *tail)
        self.dtype = np.dtype(np.int32 if first.dtype.kind in "iu" else np.float32)

    def __getitem__(self, key: slice, /) -> Array:
        frames = range(*key.indices(len(self._times)))
        block = np.zeros((len(frames), *self.shape[1:]), self.dtype)
        for i, frame in enumerate(frames):
            start = 0
            for sampled, size, fans in zip(self._found, self._sizes, self._fans, strict=True):
                if sampled is not None:
                    with reading(Path(self._where), "", f"field {self._name!r} in frame {frame}"):
                        block[i, start : start + size] = self._values(sampled, frame, size, fans)
                start += size
        return block

    def _values(self, sampled: Sampled, frame: int, size: int, fans: Fans) -> Array:
        values = sampled.at(float(self._times[frame]))
        needed = size if not self._is_polygon else int(fans.triangle_source.max(initial=-1)) + 1
        if values.shape[1:] != self.shape[2:] or len(values) < needed or (not self._is_polygon and len(values) != size):
            raise InputError(f"field {self._name} has {len(values)} values in frame {frame}; {needed} are needed")
        return np.asarray(values[fans.triangle_source] if self._is_polygon else values)


def join_fields(
    found: Sequence[dict[str, Sampled]], sizes: Sequence[int], fans: Sequence[Fans], times: Array, where: str
) -> tuple[dict[str, Field], list[str]]:
    """Return the fields by name, and the names of those whose meshes disagree.

    Args:
        found: of each mesh, what changes by name.
        sizes: vertices of each mesh.
        fans: triangles of each mesh.
        times: of the frames.
        where: the file, for messages.
    """
    fields: dict[str, Field] = {}
    left: list[str] = []
    for name in dict.fromkeys(name for each in found for name in each):
        own = [each.get(name) for each in found]
        if len({(each.domain, each.kind) for each in own if each is not None}) > 1:
            left.append(name)
            continue
        kind, domain = next((each.kind, each.domain) for each in own if each is not None)
        frames = FieldFrames(name, own, sizes, fans, times, where)
        if len(frames.shape) == 2:
            kind = "" if kind != "label" else kind
        fields[name] = Field(frames, "triangle" if domain == "polygon" else "vertex", kind, name=name)
    return fields, left


def misfits(what: str, names: Iterable[Iterable[str]]) -> list[str]:
    """What is said of attributes and fields that do not fit their mesh, by mesh; ``what`` is the format's word for one."""
    return [f"{what} {name}, which does not fit its mesh" for own in names for name in own]
