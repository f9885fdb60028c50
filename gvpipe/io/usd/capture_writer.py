"""A capture as one USD stage: meshes whose points, polygons and primvars are sampled in time.

Each shot is written as a stage of its own, as a sequence is, and the stages are joined attribute by attribute. What all shots
have alike is there once. What differs gets a sample at the first and one at the last frame of each shot, since USD interpolates
between samples of one length.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from gvpipe.asset.material import Image
from gvpipe.foundation.atomic import temporary_folder
from gvpipe.io.usd.writer import first_code, image_names, write_folder, write_stage
from gvpipe.model.capture import Capture

EMPTIED = ("points", "faceVertexCounts", "faceVertexIndices", "indices")  # of a mesh that a shot does not have
SHADERS = ("Shader", "Material")  # keep a value beside their samples, for programs that do not know changing materials
INDICES = ":indices"
FORM = ("interpolation", "elementSize")  # of a primvar, which all samples share


def write_capture(capture: Capture, path: Path) -> tuple[str, ...]:
    """Write a capture as .usda, .usdc, .usd (binary) or .usdz; returns what the format cannot hold.

    Raises:
        InputError: usd-core is missing, or a position is not finite.
        OutputError: the file cannot be written.
    """
    names, images = _image_names(capture)

    def make(stage: Path, textures: str) -> tuple[str, ...]:
        return _write_shots(capture, stage, path.stem, textures, names)

    return write_folder(make, images, path)


def _image_names(capture: Capture) -> tuple[list[list[str]], dict[str, Image]]:
    """A file name for each image of each shot, and the images by name; equal ones are there once."""
    by_data: dict[bytes, str] = {}
    images: dict[str, Image] = {}
    result = []
    for shot in capture.shots:
        own = []
        for plain, image in zip(image_names(shot), shot.images, strict=True):
            name, count = plain, 1
            while image.data not in by_data and name in images:
                name, count = f"{Path(plain).stem}_{count}{Path(plain).suffix}", count + 1
            name = by_data.setdefault(image.data, name)
            images.setdefault(name, image)
            own.append(name)
        result.append(own)
    return result, images


def _write_shots(capture: Capture, path: Path, name: str, textures: str, names: list[list[str]]) -> tuple[str, ...]:
    from pxr import Sdf

    said: list[str] = []
    joined: JoinedStage | None = None
    about = capture.shots[0].metadata
    with temporary_folder() as held:
        for number, (begin, shot) in enumerate(zip(capture.starts, capture.shots, strict=True)):
            start_time = about.start_time + begin / capture.fps
            placed = replace(shot, metadata=replace(shot.metadata, start_time=start_time, times=()))
            apart = Path(held) / f"shot{number}.usdc"
            apart.touch()
            said += write_stage(placed, apart, name, textures, None, names[number])
            layer = Sdf.Layer.FindOrOpen(str(apart))
            if joined is None:
                joined = JoinedStage(_new_layer(path, layer))
            joined.add(layer, first_code(start_time, capture.fps), len(shot))
            del layer
            apart.unlink()
        assert joined is not None  # a capture has a shot
        return tuple(dict.fromkeys([*said, *joined.finish()]))


def _new_layer(path: Path, first: Any) -> Any:
    """A layer with the settings of the first stage, and none of its prims."""
    from pxr import Sdf

    path.unlink(missing_ok=True)  # the library makes the file
    args = {"format": "usdc"} if path.suffix.lower() == ".usd" else {}
    layer = Sdf.Layer.CreateNew(str(path), args=args)
    layer.TransferContent(first)
    for prim in list(layer.rootPrims):
        del layer.rootPrims[prim.name]
    return layer


@dataclass
class Track:
    """The values of one attribute: of each shot that has it a list of times and values; one without a time stands still."""

    held: dict[int, list[tuple[float | None, Any]]] = field(default_factory=dict)


class JoinedStage:
    """One layer that takes the stages of shots, one behind the other."""

    def __init__(self, layer: Any) -> None:
        self._layer = layer
        self._tracks: dict[Any, Track] = {}
        self._spans: list[tuple[float, float]] = []
        self._notes: list[str] = []
        self._refused: set[tuple[int, str]] = set()  # shots, and indices of what is left out in them

    def add(self, layer: Any, start: float, n_frames: int) -> None:
        """Take a shot, which starts at a time code."""
        from pxr import Sdf

        number = len(self._spans)
        self._spans.append((start, start + n_frames - 1))

        def visit(path: Any) -> None:
            spec = layer.GetObjectAtPath(path)
            if path.IsPrimPath():
                if not self._layer.GetPrimAtPath(path):
                    made = Sdf.CreatePrimInLayer(self._layer, path)
                    for key in spec.ListInfoKeys():
                        made.SetInfo(key, spec.GetInfo(key))
            elif path.IsPropertyPath():
                self._take(layer, spec, number)

        paths: list[Any] = []
        layer.Traverse(Sdf.Path.absoluteRootPath, paths.append)
        for path in sorted(paths, key=lambda each: (each.IsPropertyPath(), each.pathElementCount, str(each))):
            visit(path)

    def _take(self, layer: Any, spec: Any, number: int) -> None:
        """Take one property."""
        from pxr import Sdf

        path = spec.path
        if (number, str(path)) in self._refused:
            return
        known = self._layer.GetPropertyAtPath(path)
        if not isinstance(spec, Sdf.AttributeSpec):
            if not known:
                Sdf.CopySpec(layer, path, self._layer, path)
            elif known.targetPathList.GetAppliedItems() != spec.targetPathList.GetAppliedItems():
                shown = path.GetPrimPath().name
                self._notes.append(f"USD binds a material for all frames; that of {shown} is the first shot's")
            return
        if not known:
            Sdf.CopySpec(layer, path, self._layer, path)
            known = self._layer.GetPropertyAtPath(path)
            for time in self._layer.ListTimeSamplesForPath(path):
                self._layer.EraseTimeSample(path, time)
            known.ClearDefaultValue()
        elif known.typeName != spec.typeName or any(known.GetInfo(key) != spec.GetInfo(key) for key in FORM):
            self._refused.add((number, f"{path}{INDICES}"))
            name = path.name.removeprefix("primvars:")
            self._notes.append(f"{name} is of another kind in some shots, which USD cannot change; there it was left out")
            return
        times = layer.ListTimeSamplesForPath(path)
        held: list[tuple[float | None, Any]] = [(time, layer.QueryTimeSample(path, time)) for time in times]
        if not held and spec.HasDefaultValue():
            held = [(None, spec.default)]
        if held:
            self._tracks.setdefault(path, Track()).held[number] = held

    def finish(self) -> list[str]:
        """Write the values and save; returns notes."""
        for path, track in self._tracks.items():
            self._write(path, track)
        self._layer.startTimeCode = self._spans[0][0]
        self._layer.endTimeCode = self._spans[-1][1]
        self._layer.Save()
        return self._notes

    def _write(self, path: Any, track: Track) -> None:
        name, kind = path.name, self._layer.GetPrimAtPath(path.GetPrimPath()).typeName
        first = next(iter(track.held.values()))[0][1]
        is_shape = name in EMPTIED or name == "normals" or name.startswith("primvars:")
        is_everywhere = len(track.held) == len(self._spans) or not is_shape
        is_still = all(rows[0][0] is None and rows[0][1] == first for rows in track.held.values())
        spec = self._layer.GetPropertyAtPath(path)
        if is_everywhere and is_still:
            spec.default = first
            return
        if kind in SHADERS:
            spec.default = first
        nothing = _nothing(name, first)
        previous: Any = None
        for number, (start, stop) in enumerate(self._spans):
            rows = track.held.get(number)
            if rows is None:
                if is_shape and previous is not nothing:
                    self._layer.SetTimeSample(path, start, nothing)
                    previous = nothing
                continue
            for time, value in rows:
                self._layer.SetTimeSample(path, start if time is None else time, value)
            previous = rows[-1][1]
            self._layer.SetTimeSample(path, stop, previous)


def _nothing(name: str, value: Any) -> Any:
    """What an attribute is in shots that do not have it."""
    from pxr import Sdf

    return type(value)() if name in EMPTIED else Sdf.ValueBlock()
