"""NumPy archives: ``vertices (F, V, 3)``, ``faces (T, 3)``, ``fps``, ``field_NAME (F, R[, C])``, and an asset's other data.

The archive is an ordinary ``.npz``; `numpy.load` reads it. Its bytes depend on the sequence alone, not on
the time of writing. It holds everything that a sequence has; `gvpipe.io.npz.asset` lists the members.

Members are deflated, but for positions and fields that hardly shrink: positions that move lose a tenth of their bytes, at 20
MB a second. Members are dated 1980, which is `zipfile`'s own default.
"""

from __future__ import annotations

import warnings
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib.npyio import NpzFile
from numpy.typing import NDArray

from gvpipe.asset.attribute import WIDTHS
from gvpipe.asset.field import Field
from gvpipe.asset.metadata import NO_METADATA, Metadata
from gvpipe.foundation.arrays import Array
from gvpipe.foundation.atomic import unnamed_path
from gvpipe.foundation.errors import InputError
from gvpipe.foundation.notes import ASSUMED_FPS, DEFAULT_FPS
from gvpipe.io.damage import reading
from gvpipe.io.mesh import as_color
from gvpipe.io.npz.asset import USUAL, asset_members, meta_units, read_asset
from gvpipe.io.npz.fields import WRITE_AGAIN, NpzFrames, write_field
from gvpipe.io.npz.odd import FIELD, is_known, odd_notes
from gvpipe.model.sequence import MeshSequence

LEVEL = 1  # of deflating: level 6 takes three to six times as long, and saves 2 % of triangles, 6 to 15 % of gridded positions
SAMPLE = 1 << 18  # bytes of positions, or of a field, that are deflated on trial
MOST_LEFT = 0.75  # part of them that is left at most where the member is deflated
LARGE = 64 << 20  # bytes of positions that are read from a temporary file, frame by frame, in place of being kept in memory


def write_npz(sequence: MeshSequence, path: Path) -> tuple[str, ...]:
    """Write the sequence, its positions as float32, or as float64 where it has an origin, which is added; frames by and by.

    Raises:
        OutputError: the file cannot be written.
    """
    statics: dict[str, NDArray[Any]] = {"faces": sequence.faces, "fps": np.array(sequence.fps, np.float64)}
    statics |= asset_members(sequence)
    # `numpy.savez` wants all frames at once, so the large members are written by hand
    descr, read = ("<f8", sequence.read_absolute) if sequence.origin.any() else ("<f4", sequence.read)
    header = {"descr": descr, "fortran_order": False, "shape": (sequence.n_frames, sequence.n_vertices, 3)}
    with unnamed_path(path) as temporary, zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED, compresslevel=LEVEL) as archive:
        positions = _large_member("vertices", _sample(read, sequence.n_frames).astype(descr))
        with archive.open(positions, "w", force_zip64=True) as file:
            np.lib.format.write_array_header_1_0(file, header)
            for start, stop in sequence.spans():
                file.write(np.ascontiguousarray(read(start, stop), descr).data)
        for name, array in statics.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as file:
                np.lib.format.write_array(file, array, allow_pickle=False)
        for name, field in sequence.fields.items():
            values = _large_member(f"field_{name}", _sample(field.read, len(field)))
            with archive.open(values, "w", force_zip64=True) as file:
                write_field(file, field)
    return ()


def read_npz(path: Path, fps: float | None = None) -> MeshSequence:
    """Read a sequence; ``fps`` overrides the file's, and 30 stands in where neither says. Fields load when they are read.

    Raises:
        InputError: not an archive, damaged, a missing array or a wrong shape.
    """
    arrays, field_names, members = _load(path)
    for key in ("vertices", "faces"):
        if key not in arrays:
            held = ", ".join(members) or "nothing"
            raise InputError(f"{path} has no array {key!r} (it holds {held}); 'vertices' and 'faces' are needed")
    given = arrays["vertices"]
    vertices, faces = given if isinstance(given, NpzFrames) else _as_vertices(given, path), arrays["faces"]
    is_assumed = fps is None and "fps" not in arrays and vertices.shape[0] > 1
    if not faces.size:
        raise InputError(f"{path}: 'faces' has no triangle; a mesh with triangles is needed")
    asset: dict[str, Any] = {}
    odd: tuple[str, ...] = ()
    if faces.ndim == 2 and faces.shape[1] == 3 and faces.dtype.kind in "iu":  # else the sequence refuses them
        arrays |= {} if "asset" in arrays else {name: _as_usual(name, arrays[name], path) for name in USUAL if name in arrays}
        asset = read_asset(arrays, faces, vertices.shape[1], path)
        odd = odd_notes(members, arrays, path)
        meta = str(arrays["meta"]) if "meta" in arrays and arrays["meta"].dtype.kind == "U" else ""
        rows = {"vertex": vertices.shape[1], "triangle": len(faces)}
        asset["fields"] = _fields(field_names, asset["fields"], meta_units(meta), rows, path)
        if meta and asset["metadata"] == NO_METADATA:
            asset["metadata"] = Metadata(texts={"meta": meta})
    return MeshSequence(
        vertices,
        faces,
        fps if fps is not None else _as_fps(arrays["fps"], path) if "fps" in arrays else DEFAULT_FPS,
        name=str(path),
        notes=(*((ASSUMED_FPS,) if is_assumed else ()), *odd),
        **asset,
    )


def _load(path: Path) -> tuple[dict[str, Any], list[str], list[str]]:
    """The arrays that are understood, names of fields, which are not loaded, and names of all members.

    ``vertices`` of more than `LARGE` bytes are not loaded either, if they need no more than to be read.
    """
    # opened here because `numpy.load` leaves damaged files open
    with reading(path, ".npz", remedy=WRITE_AGAIN), open(path, "rb") as file:
        if not zipfile.is_zipfile(file):
            raise InputError(f"{path} is not an .npz archive, or is cut short; {WRITE_AGAIN}")
        file.seek(0)
        with np.load(file, allow_pickle=False) as archive:
            if len(set(archive.files)) < len(archive.files):
                raise InputError(f"{path} has two members of one name; {WRITE_AGAIN}")
            large = _large_vertices(path, archive)
            arrays: dict[str, Any] = {key: _array(archive, key) for key in archive.files if is_known(key) and key not in large}
            arrays |= large
            fields = [key.removeprefix(FIELD) for key in archive.files if key.startswith(FIELD) and key != FIELD]
            return arrays, fields, list(archive.files)


def _large_vertices(path: Path, archive: NpzFile) -> dict[str, NpzFrames]:
    """The member ``vertices``, frame 0 of it read, where its positions are many and float32; else nothing."""
    sizes = {entry.filename: entry.file_size for entry in archive.zip.infolist()} if archive.zip else {}
    if sizes.get("vertices.npy", 0) <= LARGE:
        return {}
    frames = NpzFrames(path, "vertices")
    if frames.dtype != np.float32 or len(frames.shape) != 3 or frames.shape[2] != 3 or not frames.shape[0]:
        return {}
    frames[0:1]  # from now on it lies in a temporary file, whatever becomes of the archive
    return {"vertices": frames}


def _array(archive: NpzFile, key: str) -> NDArray[Any]:
    """A member; NumPy gives the bytes of one that is no array. Raises `ValueError`."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # of arrays that Python 2 wrote
        values = archive[key]
    if not isinstance(values, np.ndarray):
        raise ValueError(f"its member {key!r} is no array")
    return values


def _fields(
    names: list[str], described: dict[str, Any], units: dict[str, str], rows: dict[str, int], path: Path
) -> dict[str, Field]:
    """The fields, not loaded yet; what the description does not name is guessed from the shape."""
    made: dict[str, Field] = {}
    for name in names:
        values, label = NpzFrames(path, f"field_{name}"), f"{path}: field {name!r}"
        one = described.get(name)
        if one is None:
            domain = "triangle" if values.shape[1] == rows["triangle"] != rows["vertex"] else "vertex"
            made[name] = Field(values, domain, unit=units.get(name, ""), name=label)
            continue
        unit, limits = one.get("unit", ""), one.get("range")
        is_pair = isinstance(limits, list) and [type(limit) for limit in limits] == [float, float]
        if not isinstance(unit, str) or not (limits is None or is_pair):
            raise InputError(f"{label} has unit {unit!r} and range {limits!r}; a text and two numbers are needed")
        limits = (limits[0], limits[1]) if limits else None
        made[name] = Field(values, one.get("domain", "vertex"), one.get("kind", ""), unit, limits, label)
    return made


def _as_vertices(vertices: NDArray[np.generic], path: Path) -> Array:
    if vertices.ndim != 3 or vertices.shape[2] != 3 or vertices.dtype.kind not in "fiu":
        raise InputError(
            f"{path}: 'vertices' has shape {vertices.shape} and type {vertices.dtype}; (frames, vertices, 3) numbers are needed"
        )
    return vertices


def _as_fps(fps: NDArray[np.generic], path: Path) -> float:
    if fps.size != 1 or fps.dtype.kind not in "fiu":
        raise InputError(f"{path}: 'fps' has shape {fps.shape} and type {fps.dtype}; one number is needed")
    return float(fps.reshape(-1)[0])


def _as_usual(name: str, values: NDArray[np.generic], path: Path) -> NDArray[np.generic]:
    """An array of an archive without a description: colours of any type become bytes."""
    widths = WIDTHS[name]
    if values.ndim != 2 or values.shape[1] not in widths or values.dtype.kind not in "fiu":
        needed = " or ".join(str(width) for width in widths)
        raise InputError(
            f"{path}: {name!r} has shape {values.shape} and type {values.dtype}; (rows, {needed}) numbers are needed"
        )
    return as_color(values) if name == "color" else values.astype(np.float32)


def _sample(read: Callable[[int, int], Array], n_frames: int) -> Array:
    """Frames of `SAMPLE` bytes, or the second one: the first of a geometry video may be on a grid where the others are not."""
    first = min(1, n_frames - 1)
    frame = read(first, first + 1)
    stop = min(n_frames, first + SAMPLE // frame.nbytes)
    return read(first, stop) if stop > first + 1 else frame


def _large_member(name: str, sample: NDArray[Any]) -> str | zipfile.ZipInfo:
    """An archive member, deflated if a sample of it shrinks enough, and else stored."""
    member, raw = f"{name}.npy", sample.tobytes()[:SAMPLE]
    return member if len(zlib.compress(raw, LEVEL)) <= MOST_LEFT * len(raw) else zipfile.ZipInfo(member)
