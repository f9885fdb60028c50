"""What every route starts from: the base frame as the decoder will have it, and the points that move."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

import numpy as np

from gvcodecs.mcgv.base.base_lattice import base_step, choose_lattice, quantise_base, weld_step
from gvcodecs.mcgv.base.welded_points import Points
from gvcodecs.mcgv.encode_job import Job
from gvpipe.connectivity.base_mesh import EncodedMesh
from gvpipe.connectivity.welded_mesh import WeldedMesh, encode_points
from gvpipe.container.segments import cut
from gvpipe.foundation.arrays import Bool, Float64, Int32, Int64
from gvpipe.mesh.lattice import Lattice
from gvpipe.model.sequence import MeshSequence
from gvpipe.trajectory.still_vertices import encode_flags, find_still
from gvpipe.trajectory.welding import find_points

MAX_SEGMENTS = 4000  # one section each, of the 4096 that a bitstream may have
MERGED = 1 / 16  # parts of `weld_step` that vertices of one point may be apart: far below the errors that follow


@dataclass(frozen=True)
class Start:
    """What every route starts from.

    Args:
        sequence: of the P points that move, in the decoder's order.
        point: ``(V,)`` the given number of each vertex' point; sources: ``(P,)`` a given vertex of each point that moves.
        coded: the mesh's sections; faces: ``(T, 3)`` as the decoder will have them.
        still: the section of that name, empty if all points move.
        lattice: of the base frame.
        placement: of the points' pixels.
        lattice_points: ``(P, 3)`` the points on it; base: the same in model units.
        points: what joins them.
        bounds: first frame of every segment, and F.
        step: of quantisation, model units.
        moving_part: of the vertices, those that move, 0..1.
        still_error: squared error of the vertices that never move, summed over them, squared model units a frame.
        pictures: whether frames have them; without, they are their prediction.
    """

    sequence: MeshSequence
    point: Int64
    sources: Int64
    coded: EncodedMesh
    faces: Int32
    still: bytes
    lattice: Lattice
    placement: str
    lattice_points: Int32
    base: Float64
    points: Points
    bounds: list[int]
    step: float
    moving_part: float
    still_error: float
    pictures: bool = True

    @property
    def key(self) -> str:
        """The base frame's name in memos: of its lattice, and of which vertices its points are, in which order."""
        return f"{self.lattice.step} {_digest(self.sources)}"

    def moving(self) -> tuple[Int64, Int64]:
        """The given vertices ``(M,)`` that move, and the point ``(M,)`` of each."""
        number = np.full(int(self.point.max()) + 1, -1)
        number[self.point[self.sources]] = np.arange(len(self.sources))
        own = number[self.point]
        vertices = np.flatnonzero(own >= 0)
        return vertices, own[vertices]


def _digest(numbers: Int64) -> str:
    """A name for an array; two of one length may well differ: other steps merge other vertices."""
    return hashlib.blake2b(np.ascontiguousarray(numbers).data, digest_size=16).hexdigest()


def begin(job: Job, step: float, target_error: float, before: Start | None = None) -> Start:
    """Code the base frame for a quantisation step and a target error, model units, and see the sequence as the decoder will.

    A start ``before`` gives its points; what gained nothing from adaptive contexts there is not tried again.
    """
    given, settings = job.sequence, job.settings
    job.report("base", 0)
    first = given.read(0, 1)[0]
    still = job.memo("still", lambda: find_still(given))
    point = before.point if before else _weld(given, still, MERGED * weld_step(settings, first, step))
    adaptive = before.coded.is_adaptive if before else settings.is_blended
    members = np.unique(point, return_index=True)[1]
    lattice = choose_lattice(settings, first[members], min(base_step(step, given.n_frames), target_error))
    positions = quantise_base(settings, lattice, first[members])
    bases, key = job.memo("bases", dict[tuple[float, str], tuple[EncodedMesh, WeldedMesh]]), (lattice.step, _digest(point))
    if key not in bases:
        if job.is_large:  # those before would take more memory than coding one of them again takes time
            bases.clear()
        bases[key] = encode_points(positions, given.faces, point, settings.reorder, adaptive)
    coded, mesh = bases[key]
    sources = coded.permutation[mesh.members]  # the given vertex of each point
    is_still = still[sources].copy()
    if is_still.all():  # one point at least has samples
        is_still[0] = False
    moving = np.flatnonzero(~is_still)
    points = Points.moving(mesh, moving)
    base = lattice.points_at(mesh.lattice[moving])
    sequence = given.reordered(sources[moving], points.faces)
    if still.all():
        sequence = MeshSequence(np.broadcast_to(base.astype(np.float32), sequence.positions.shape), points.faces, given.fps)
    rests = is_still[mesh.point]
    off = first[coded.permutation[rests]] - lattice.points_at(mesh.lattice[mesh.point[rests]])
    return Start(
        sequence=sequence,
        point=point,
        sources=sources[moving],
        coded=coded,
        faces=mesh.faces,
        still=encode_flags(is_still) if is_still.any() else b"",
        lattice=lattice,
        placement=settings.choose_placement(len(moving)),
        lattice_points=mesh.lattice[moving],
        base=base,
        points=points,
        bounds=cut(sequence.n_frames, settings.segment, MAX_SEGMENTS),
        step=step,
        moving_part=float((~rests).mean()),
        still_error=float(np.square(off).sum()),
    )


def _weld(sequence: MeshSequence, still: Bool, tolerance: float) -> Int64:
    """``(V,)`` the point of each vertex; a vertex that stands still shares none with one that moves."""
    ids = np.column_stack([find_points(sequence, tolerance), still])
    _, first, number = np.unique(ids, axis=0, return_index=True, return_inverse=True)
    return np.asarray(np.argsort(np.argsort(first))[number.ravel()], np.int64)
