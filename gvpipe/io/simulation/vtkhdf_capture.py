"""A capture as one temporal VTKHDF file of poly data: each shot is a part, with polygons and still numbers of its own.

`PartOffsets` says which part a step shows, and offsets where its points, cells and numbers start. Points and fields of all
frames stand one after the other. Every step of a VTKHDF file has the same arrays, so one that a shot lacks is 0 there.

Source: Kitware, VTK file formats, "VTKHDF file format", version 2.3.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from gvpipe.foundation.arrays import Array
from gvpipe.io.library.writing_process import write_by
from gvpipe.io.library.writing_worker import AskedShots
from gvpipe.io.losses import renamed_note
from gvpipe.io.simulation.hdf import import_h5py
from gvpipe.io.simulation.poly_content import PolyContent, poly_content
from gvpipe.io.simulation.vtkhdf import POLY_GROUPS, ROOT
from gvpipe.io.simulation.vtkhdf_writer import CHUNK, GROUPS, plain_columns, safe_name, start_set, write_roles, write_unit
from gvpipe.model.capture import Capture
from gvpipe.model.sequence import MeshSequence

FIELD_DATA = "FieldData"


def write_capture(capture: Capture, path: Path) -> tuple[str, ...]:
    """Write the shots with their attributes and fields; returns what the format cannot hold, a line each.

    Raises:
        InputError: h5py is missing.
        OutputError: the file cannot be written.
    """
    import_h5py(str(path))
    return write_by(__name__, "write_here", capture, path)


def write_here(shots: AskedShots, path: Path, name: str) -> tuple[str, ...]:
    """The same in this process; a file that cannot be written is left as it is."""
    h5py = import_h5py(str(path))
    with h5py.File(path, "w") as file:
        writer = CaptureWriter(h5py, start_set(file, ROOT, "PolyData"), sum(shots.lengths))
        for shot in shots:
            writer.add(shot)
        writer.finish(shots.fps)
    return tuple(dict.fromkeys(writer.notes))


class Numbers:
    """An array of all steps: rows one behind the other, and the first row of each step."""

    def __init__(self, group: Any, name: str, values: Array, n_steps: int) -> None:
        tail = values.shape[1:]
        chunk = (max(1, min(CHUNK, len(values) or CHUNK)), *tail)
        self._held = group.create_dataset(
            name, (0, *tail), values.dtype, maxshape=(None, *tail), chunks=chunk, compression="gzip", compression_opts=4,
            shuffle=True,
        )  # fmt: skip
        self.form = values.dtype, tail
        self.offsets = np.zeros(n_steps, np.int64)
        self.n_steps = 0

    @property
    def held(self) -> Any:
        """The dataset."""
        return self._held

    def append(self, values: Array, n_steps: int = 0) -> None:
        """Add rows; they are those of so many steps, all of each or, if the rows are several times as many, a run for each."""
        start = len(self._held)
        self._held.resize(start + len(values), axis=0)
        self._held[start:] = values
        self.offsets[self.n_steps : self.n_steps + n_steps] = start
        self.n_steps += n_steps


class CaptureWriter:
    """One file that takes shots, one behind the other.

    Args:
        h5py: the module.
        root: the group of the file's data set.
        n_steps: frames of all shots.
    """

    def __init__(self, h5py: Any, root: Any, n_steps: int) -> None:
        self._h5py, self._root, self._n_steps = h5py, root, n_steps
        self._points: Numbers | None = None
        self._numbers: dict[tuple[str, str], Numbers] = {}
        self._sizes: dict[str, list[int]] = {"NumberOfPoints": []}
        self._cells: dict[str, Numbers] = {}
        self._starts: dict[str, list[list[int]]] = {"CellOffsets": [], "ConnectivityIdOffsets": []}
        self._steps_of_part: list[int] = []
        self._times: list[float] = []
        self._texts: dict[str, list[tuple[str, ...]]] = {}
        self.notes: list[str] = []

    def add(self, shot: MeshSequence) -> None:
        """Write a shot."""
        content = poly_content(shot, "VTKHDF", has_units=True, parts="numbers")
        self.notes += content.notes
        self.notes += renamed_note(((name, safe_name(name)) for name in (*content.attributes, *content.fields)), "VTKHDF")
        self._sizes["NumberOfPoints"].append(shot.n_vertices)
        self._write_polygons(content)
        n_frames, before = shot.n_frames, len(self._times)
        self._steps_of_part.append(n_frames)
        self._times += shot.times.tolist()
        for name, texts in content.texts.items():
            self._texts.setdefault(name, [()] * (len(self._steps_of_part) - 1)).append(texts)
        for held in self._texts.values():
            held += [()] * (len(self._steps_of_part) - len(held))
        self._write_points(shot, before)
        for group, domain in GROUPS:
            rows = shot.n_vertices if domain == "vertex" else len(content.first)
            self._write_numbers(group, domain, content, (before, n_frames, rows))
        self._fill(before + n_frames, shot.n_vertices, len(content.first))

    def _write_polygons(self, content: PolyContent) -> None:
        nothing = np.zeros(0, np.int64)
        for name, starts in self._starts.items():
            kind = "NumberOfCells" if name == "CellOffsets" else "NumberOfConnectivityIds"
            starts.append([sum(self._sizes.get(f"{group}/{kind}", ())) for group in POLY_GROUPS])
        for group_name in POLY_GROUPS:
            held = group_name == "Polygons"
            group = self._root.require_group(group_name)
            offsets, nodes = (content.offsets, content.nodes) if held else (np.zeros(1, np.int64), nothing)
            self._sizes.setdefault(f"{group_name}/NumberOfCells", []).append(len(offsets) - 1)
            self._sizes.setdefault(f"{group_name}/NumberOfConnectivityIds", []).append(len(nodes))
            for name, values in (("Offsets", offsets), ("Connectivity", nodes)):
                key = f"{group_name}/{name}"
                if key not in self._cells:
                    self._cells[key] = Numbers(group, name, values, 0)
                self._cells[key].append(values)

    def _write_points(self, shot: MeshSequence, before: int) -> None:
        is_far = bool(shot.origin.any())
        for start, stop in shot.spans():
            block = shot.read_absolute(start, stop) if is_far else shot.read(start, stop)
            if self._points is None:
                self._points = Numbers(self._root, "Points", block.reshape(-1, 3), self._n_steps)
            for frame in block:
                self._points.append(frame, 1)

    def _write_numbers(self, group: str, domain: str, content: PolyContent, span: tuple[int, int, int]) -> None:
        """Write the numbers of a shot: of ``span``, its first step, how many there are, and the rows of each."""
        n_frames = span[1]
        for name, values in content.still(domain).items():
            held = self._held(group, name, plain_columns(values), span, content.attributes[name].unit)
            if held is not None:
                held.append(plain_columns(values), n_frames)
        for name, field in content.moving(domain).items():
            step = max(1, CHUNK // max(1, field.shape[1]))
            for first in range(0, n_frames, step):
                rows = content.rows(field, field.read(first, min(first + step, n_frames)))
                held = self._held(group, name, plain_columns(rows[0]), span, field.unit)
                for frame in rows if held is not None else ():
                    held.append(plain_columns(frame), 1)  # type: ignore[union-attr]
        write_roles(self._root.require_group(group), content, domain)

    def _held(self, group: str, name: str, values: Array, span: tuple[int, int, int], unit: str) -> Numbers | None:
        """The array of a name, filled up to the shot; None and a note if it is of another type or width than before."""
        key = group, safe_name(name)
        if key not in self._numbers:
            self._numbers[key] = Numbers(self._root.require_group(group), key[1], values, self._n_steps)
            write_unit(self._numbers[key].held, unit)
            self._complete(key, span[0])
        held = self._numbers[key]
        if held.form[1] != values.shape[1:] or not np.can_cast(values.dtype, held.form[0], "same_kind"):
            self.notes.append(f"{name} is of another kind in some shots, which VTKHDF cannot change; there it was left out")
            return None
        return held

    def _fill(self, n_steps: int, n_points: int, n_cells: int) -> None:
        """Write zeros for what a shot lacks."""
        for (group, name), held in self._numbers.items():
            missing = n_steps - held.n_steps
            if missing:
                rows = n_points if group == "PointData" else n_cells
                held.append(np.zeros((rows, *held.form[1]), held.form[0]), missing)
                self._note_zeros(name)

    def _complete(self, key: tuple[str, str], n_steps: int) -> None:
        """Write zeros for the shots before the first that has an array."""
        held = self._numbers[key]
        cells = self._sizes["Polygons/NumberOfCells"]
        done = 0
        for number, count in enumerate(self._steps_of_part):
            if done == n_steps:
                break
            rows = self._sizes["NumberOfPoints"][number] if key[0] == "PointData" else cells[number]
            held.append(np.zeros((rows, *held.form[1]), held.form[0]), count)
            self._note_zeros(key[1])
            done += count

    def _note_zeros(self, name: str) -> None:
        self.notes.append(f"{name} is 0 in shots that do not have it: every step of a VTKHDF file has the same arrays")

    def finish(self, fps: float) -> None:
        """Write sizes, steps and texts."""
        root, parts = self._root, np.repeat(np.arange(len(self._steps_of_part)), self._steps_of_part)
        for name, sizes in self._sizes.items():
            root[name] = np.array(sizes, np.int64)
        steps = root.create_group("Steps")
        steps.attrs["NSteps"] = np.int64(self._n_steps)
        times = np.array(self._times)
        is_rising = bool((np.diff(times) > 0).all())
        steps["Values"] = times if is_rising else self._times[0] + np.arange(self._n_steps) / fps
        steps["PartOffsets"] = parts.astype(np.int64)
        steps["NumberOfParts"] = np.ones(self._n_steps, np.int64)
        assert self._points is not None  # a shot has a frame
        steps["PointOffsets"] = self._points.offsets
        for name, starts in self._starts.items():
            steps[name] = np.array(starts, np.int64)[parts]
        for group, _ in GROUPS:
            offsets = steps.create_group(f"{group}Offsets")
            root.require_group(group)
            for (own, name), held in self._numbers.items():
                if own == group:
                    offsets[name] = held.offsets
        kind = self._h5py.string_dtype("ascii")  # of UTF-8 all the same: VTK reads texts of this type alone
        for name, texts in self._texts.items():
            counts = np.array([len(own) for own in texts])
            data = [text.encode() for own in texts for text in own]
            root.create_dataset(f"{FIELD_DATA}/{name}", data=data, dtype=kind)
            steps[f"{FIELD_DATA}Offsets/{name}"] = (np.cumsum(counts) - counts)[parts].astype(np.int64)
            steps[f"{FIELD_DATA}Sizes/{name}"] = np.stack([np.ones(len(parts), np.int64), counts[parts]], axis=1)
