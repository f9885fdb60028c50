"""Frames in, bytes out, one clip at a time; and bytes in, frames out.

For sources that have no end yet (simulations, capture) and sinks that cannot wait for it. Encoder and reader hold one clip. The
clips are coded as those of a file (`clip`), of exactly N frames each but for the last. What only the whole sequence tells is
missing: every vertex is coded by itself, still or not, and the step follows from quality and frame 0's diagonal alone::

    stream = "gvpdct\\r\\n", [u16] version, [u32 x 3] V, T, bytes of order, [u64] bytes of mesh, [5 x float64] frames per
             second, lattice of the base frame (origin, step), mesh, order, clips, [u32] 0
    clip   = [u32] frames, [u32] CRC-32 of the data, [u64] bytes, data
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator

import numpy as np

from gvcodecs.pdct.clip import decode_clip
from gvcodecs.pdct.dictionary import BaseFrame
from gvcodecs.pdct.encoder import ClipCoder, Pdct
from gvcodecs.pdct.header import surface_of
from gvcodecs.pdct.reader import BYTES_PER_POINT, SECONDS_PER_POINT
from gvpipe.connectivity.base_mesh import keep_mesh
from gvpipe.connectivity.lattice_field import read_lattice
from gvpipe.connectivity.welded_mesh import WeldedMesh, decode_points
from gvpipe.container.json_object import JsonObject
from gvpipe.container.segments import MAX_SEGMENT
from gvpipe.foundation.arrays import Float32, Floats, Int32, Integers
from gvpipe.foundation.budget import Budget
from gvpipe.foundation.errors import CorruptFile, InputError, NewerVersion, NotGeometryVideo, TruncatedFile
from gvpipe.model.sequence import check_finite

MAGIC = b"gvpdct\r\n"
VERSION = 1
HEAD = struct.Struct("<HIIIQ5d")
CLIP = struct.Struct("<IIQ")
END = struct.pack("<I", 0)


class StreamEncoder:
    """Codes frames that come one by one; each call returns the bytes that are complete, often none.

    The first clip's bytes come with its last frame; the head, which tells the mesh, with the first frame.

    Args:
        faces: ``(T, 3)`` triangles.
        settings: of the codec; ``clip`` (or ``segment``) is the frames per clip.
        fps: frames per second.
    """

    def __init__(self, faces: Integers, settings: Pdct | None = None, fps: float = 30.0) -> None:
        self._faces, self._fps = np.asarray(faces, np.int32).reshape(-1, 3), float(fps)
        self._settings = settings or Pdct()
        self._coder: ClipCoder | None = None
        self._frames: list[Float32] = []
        self._count = 0
        self._is_closed = False

    def add(self, frame: Floats) -> bytes:
        """Take the next frame, ``(V, 3)``, model units.

        Raises:
            InputError: the frame has another shape than those before, or a coordinate is not finite.
        """
        if self._is_closed:
            raise InputError("the stream is finished; open another for more frames")
        positions = np.array(frame, np.float32)
        if positions.ndim != 2 or positions.shape[1] != 3 or not len(positions):
            raise InputError(f"frame {self._count} has shape {positions.shape}; (vertices >= 1, 3) is needed")
        check_finite(positions[None], "stream", self._count)
        head = b""
        if self._coder is None:
            if self._faces.size and not 0 <= self._faces.min() <= self._faces.max() < len(positions):
                raise InputError(f"triangles name vertices up to {self._faces.max()}; there are {len(positions)}")
            self._coder = self._settings.start_live(positions, self._faces, self._fps)
            head = _head(self._coder)
        elif len(positions) != self._coder.bitstream.n_vertices:
            raise InputError(f"frame {self._count} has {len(positions)} vertices, the first {self._coder.bitstream.n_vertices}")
        self._frames.append(positions)
        self._count += 1
        return head + (self._flush() if len(self._frames) == self._settings.clip_frames else b"")

    def finish(self) -> bytes:
        """Return what is left: the last, shorter clip and the end mark."""
        if self._is_closed:
            raise InputError("the stream is finished already")
        if self._coder is None:
            raise InputError("a stream needs at least one frame")
        self._is_closed = True
        return (self._flush() if self._frames else b"") + END

    def _flush(self) -> bytes:
        assert self._coder is not None
        data = self._coder.encode(np.stack(self._frames))
        head = CLIP.pack(len(self._frames), zlib.crc32(data), len(data))
        self._frames = []
        return head + data


def _head(coder: ClipCoder) -> bytes:
    mesh, order, start = coder.mesh.mesh, coder.mesh.order, coder.bitstream
    lattice = (*coder.lattice.origin, coder.lattice.step)
    numbers = HEAD.pack(VERSION, start.n_vertices, start.n_triangles, len(order), len(mesh), start.fps, *lattice)
    return MAGIC + numbers + mesh + order


class StreamReader:
    """Frames of a stream whose bytes come in pieces of any size.

    `feed` the bytes, and iterate over what it returns: the frames that have become complete, ``(V, 3) float32``, model units.

    The bytes that have come so far limit what the mesh and each clip may cost (`gvpipe.foundation.budget`).

    Args:
        unlimited: let them take whatever memory and work they ask for.
    """

    def __init__(self, *, unlimited: bool = False) -> None:
        self._is_unlimited, self._n_bytes = unlimited, 0
        self._buffer = bytearray()
        self._mesh: WeldedMesh | None = None
        self._surface: BaseFrame | None = None
        self._clips = 0
        self.fps = 0.0  # frames per second, once the head is there
        self.is_finished = False

    @property
    def faces(self) -> Int32 | None:
        """``(T, 3) int32`` triangles; None until the head is there."""
        return None if self._mesh is None else self._mesh.faces

    def feed(self, data: bytes) -> Iterator[Float32]:
        """Take the next bytes, and yield the frames that they complete; iterate to the end before feeding more.

        Raises:
            NotGeometryVideo: the stream does not start as one.
            NewerVersion: this gvpipe is too old for it.
            CorruptFile: a checksum differs or a part does not decode.
            OverBudget: the mesh or a clip takes more than so many bytes may.
        """
        self._buffer += data
        self._n_bytes += len(data)
        if self._surface is None and not self._read_head():
            return
        while not self.is_finished:
            frames = self._read_clip()
            if frames is None:
                return
            yield from frames
        if self._buffer:
            raise CorruptFile("the stream goes on after its end mark; get it again from its source")

    def close(self) -> None:
        """Raise `TruncatedFile` unless the stream came to its end."""
        if not self.is_finished:
            raise TruncatedFile(f"the stream ends within clip {self._clips}; get it again from its source")

    def _budget(self, n_vertices: int, n_triangles: int) -> Budget:
        """What the bytes so far may cost, and the mesh takes of it."""
        budget = Budget(None if self._is_unlimited else self._n_bytes)
        keep_mesh(budget, n_vertices, n_triangles)
        budget.keep(f"{n_vertices} points", BYTES_PER_POINT * n_vertices, SECONDS_PER_POINT * n_vertices)
        return budget

    def _read_head(self) -> bool:
        if self._buffer[: len(MAGIC)] != MAGIC[: len(self._buffer)]:
            raise NotGeometryVideo("the stream does not start as a pdct stream; check its source")
        start = len(MAGIC) + HEAD.size
        if len(self._buffer) < start:
            return False
        version, n_vertices, n_triangles, bytes_order, bytes_mesh, fps, *base = HEAD.unpack_from(self._buffer, len(MAGIC))
        if version > VERSION:
            raise NewerVersion(f"the stream has version {version}, this gvpipe reads up to {VERSION}; upgrade gvpipe")
        lattice = read_lattice(JsonObject({"base": base}, "head"))
        if not 0 < fps <= 100_000:
            raise CorruptFile(f"the stream has {fps} frames per second; get it again from its source")
        if len(self._buffer) < start + bytes_mesh + bytes_order:
            return False
        self._budget(n_vertices, n_triangles)
        mesh = bytes(self._buffer[start : start + bytes_mesh])
        order = bytes(self._buffer[start + bytes_mesh : start + bytes_mesh + bytes_order])
        decoded = decode_points(mesh, order, n_vertices, n_triangles)
        if (len(decoded.point), len(decoded.faces)) != (n_vertices, n_triangles):
            raise CorruptFile("the mesh has other vertices and triangles than the head says; get the stream again")
        del self._buffer[: start + bytes_mesh + bytes_order]
        self._mesh, self._surface, self.fps = decoded, surface_of(decoded, lattice), fps
        return True

    def _read_clip(self) -> Float32 | None:
        """The next clip's frames ``(n, V, 3)``, none at the end mark, None if the clip is not complete."""
        assert self._surface is not None and self._mesh is not None
        if self._buffer[: len(END)] == END:
            self.is_finished = True
            del self._buffer[: len(END)]
            return np.zeros((0, 0, 3), np.float32)
        if len(self._buffer) < CLIP.size:
            return None
        n_frames, checksum, size = CLIP.unpack_from(self._buffer)
        if n_frames > MAX_SEGMENT:
            raise CorruptFile(f"clip {self._clips} of the stream has {n_frames} frames; get it again from its source")
        if len(self._buffer) < CLIP.size + size:
            return None
        data = bytes(self._buffer[CLIP.size : CLIP.size + size])
        if zlib.crc32(data) != checksum:
            raise CorruptFile(f"clip {self._clips} of the stream has a wrong checksum; get it again from its source")
        del self._buffer[: CLIP.size + size]
        self._clips += 1
        budget = self._budget(len(self._surface.base), len(self._mesh.faces))
        frames = decode_clip(data, n_frames, self._surface, f"clip.{self._clips - 1}", budget)
        return np.ascontiguousarray(frames[:, self._mesh.point])
