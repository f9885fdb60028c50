"""NumPy archives: ``vertices (F, V, 3)``, ``faces (T, 3)``, ``fps``, and ``uv``, ``normal``, ``color`` if present.

The archive is an ordinary compressed ``.npz``; `numpy.load` reads it. Its bytes depend on the sequence alone, not on
the time of writing.
"""

from __future__ import annotations

import zipfile
import zlib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gvpipe.arrays import Array
from gvpipe.atomic import atomic_path
from gvpipe.errors import InputError
from gvpipe.io.mesh import as_color
from gvpipe.notes import ASSUMED_FPS, DEFAULT_FPS
from gvpipe.sequence import MeshSequence

ATTRIBUTES = {"uv": (2,), "normal": (3,), "color": (3, 4)}  # name: columns that are understood


def write_npz(sequence: MeshSequence, path: Path) -> tuple[str, ...]:
    """Write the sequence as float32, or as float64 where it has an origin, which is added; some frames at a time.

    Raises:
        OutputError: the file cannot be written.
    """
    statics: dict[str, NDArray[np.generic]] = {"faces": sequence.faces, "fps": np.array(sequence.fps, np.float64)}
    statics |= {name: np.asarray(values) for name, values in sequence.attributes.items()}
    # `numpy.savez_compressed` wants all frames at once, so the one large member is written by hand
    descr, read = ("<f8", sequence.read_absolute) if sequence.origin.any() else ("<f4", sequence.read)
    header = {"descr": descr, "fortran_order": False, "shape": (sequence.n_frames, sequence.n_vertices, 3)}
    with atomic_path(path) as temporary, zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as archive:
        with archive.open(_member("vertices"), "w", force_zip64=True) as file:
            np.lib.format.write_array_header_1_0(file, header)
            for start, stop in sequence.spans():
                file.write(np.ascontiguousarray(read(start, stop), descr).data)
        for name, values in statics.items():
            with archive.open(_member(name), "w", force_zip64=True) as file:
                np.lib.format.write_array(file, values, allow_pickle=False)
    return ()


def read_npz(path: Path, fps: float | None = None) -> MeshSequence:
    """Read a sequence; ``fps`` overrides the file's, and 30 stands in where neither says.

    Raises:
        InputError: not an archive, damaged, a missing array or a wrong shape.
    """
    try:
        with open(path, "rb") as file:  # opened here because `numpy.load` leaves damaged files open
            if not zipfile.is_zipfile(file):
                raise InputError(f"{path} is not an .npz archive, or is cut short; write it again with numpy.savez")
            file.seek(0)
            with np.load(file, allow_pickle=False) as archive:
                arrays = {key: archive[key] for key in ("vertices", "faces", "fps", *ATTRIBUTES) if key in archive}
                held = ", ".join(archive.files) or "nothing"
    except InputError:
        raise
    # an archive that lies about a size or a type can raise nearly anything inside NumPy, zipfile and zlib
    except (OSError, ValueError, TypeError, KeyError, EOFError, MemoryError, NotImplementedError, RuntimeError,
            SyntaxError, OverflowError, zipfile.BadZipFile, zlib.error) as exc:  # fmt: skip
        reason = " ".join(str(exc).split())[:150]
        raise InputError(f"{path} cannot be read as .npz ({reason}); write it again with numpy.savez") from exc
    for key in ("vertices", "faces"):
        if key not in arrays:
            raise InputError(f"{path} has no array {key!r} (it holds {held}); 'vertices' and 'faces' are needed")
    is_assumed = fps is None and "fps" not in arrays and len(arrays["vertices"]) > 1
    return MeshSequence(
        _as_vertices(arrays["vertices"], path),
        arrays["faces"],
        fps if fps is not None else _as_fps(arrays["fps"], path) if "fps" in arrays else DEFAULT_FPS,
        {name: _as_attribute(name, arrays[name], path) for name in ATTRIBUTES if name in arrays},
        str(path),
        notes=(ASSUMED_FPS,) if is_assumed else (),
    )


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


def _as_attribute(name: str, values: NDArray[np.generic], path: Path) -> NDArray[np.generic]:
    widths = ATTRIBUTES[name]
    if values.ndim != 2 or values.shape[1] not in widths or values.dtype.kind not in "fiu":
        needed = " or ".join(str(width) for width in widths)
        raise InputError(
            f"{path}: {name!r} has shape {values.shape} and type {values.dtype}; (rows, {needed}) numbers are needed"
        )
    return as_color(values) if name == "color" else values.astype(np.float32)


def _member(name: str) -> zipfile.ZipInfo:
    """An archive member dated 1980 (`ZipInfo`'s own default), so that equal sequences give equal bytes."""
    info = zipfile.ZipInfo(f"{name}.npy")
    info.compress_type = zipfile.ZIP_DEFLATED
    info.external_attr = 0o600 << 16
    return info
