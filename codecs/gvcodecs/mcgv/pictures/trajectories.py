"""Trajectory images: a segment's vertices as a few numbers each, and those numbers as pictures (``transform="klt"``).

What: the vertices' displacements from the base frame are trajectories, ``(V, 3n)``. Their principal trajectories (a temporal
Karhunen-Loeve transform, `gvpipe.trajectory.basis`) turn a vertex into R coefficients. The blend (`skinning`) predicts them: a
cluster's affine motion is four coefficients per principal trajectory, and a point takes the weighted mean of its clusters'.
What is left is painted into planes, one per principal trajectory, three to a picture, coded as intra pictures of H.264.

Why: consecutive frames are alike, coefficients of orthonormal trajectories are not, so that nothing is coded twice. One step D
serves basis, transforms and planes (reverse water-filling): an error costs the same wherever it is made.

Departure: Mamou, Zaharia and Preteux ("Multi-Chart Geometry Video", 2007) predict frames and code their residuals. A transform
of residuals would leave twelve numbers per cluster and frame to code; predicting coefficients takes 4 K R per segment.

Stream, section ``trajectories.N`` of segment N, whose step and R stand in the header::

    [varint] length, basis
    [varint] length, transforms: rows of `gvpipe.trajectory.coefficient_coding`, (4K, R), none predicted from another
    [varint] n, [varint] length, [integers] n gaps between the outliers' places, [integers] n values, steps

A plane has a number of levels per step. Coefficients that it cannot hold are *outliers*: their pixels are at its limit and
count for nothing, and they are sent apart; the place of component c of slot s is ``s R + c``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from gvcodecs.mcgv.motion.skinning import BlendFit
from gvcodecs.mcgv.motion.skinning_coding import decode_coefficients, encode_coefficients
from gvpipe.container.cursor import Cursor, pack_block, varint
from gvpipe.entropy.integers import decode_integers, encode_integers
from gvpipe.foundation.arrays import Float64
from gvpipe.foundation.budget import UNLIMITED, Budget
from gvpipe.foundation.errors import InputError
from gvpipe.trajectory.basis import Basis, decode_basis, reduce_trajectories
from gvpipe.trajectory.sparse_rows import multiply

PLANES = 3  # to a picture
MAX_OUTLIER = 1 << 38  # steps


@dataclass(frozen=True)
class CodedSegment:
    """A segment as it is coded.

    Args:
        step: D, model units.
        section: ``trajectories.N``.
        left: ``(R, P)`` what the planes are to hold, steps.
    """

    step: float
    section: bytes
    left: Float64


def count_pictures(n_components: int) -> int:
    """Pictures of a segment: one at least, so that no video is empty."""
    return max(1, -(-n_components // PLANES))


def encode_segment(trajectories: Float64, fit: BlendFit, largest: float, error: float) -> CodedSegment:
    """Code a segment but for its pictures.

    Args:
        trajectories: ``(P, 3n)`` the points' displacements from the base frame, model units.
        fit: of their blend.
        largest: magnitude that planes hold, steps.
        error: squared error to leave, about, summed over all coordinates, model units squared.
    """
    reduced = reduce_trajectories(trajectories, error)
    step, head, coefficients = reduced.step, reduced.basis, reduced.coefficients
    rows, transforms = encode_coefficients(fit.fit(coefficients), step)
    left = (coefficients - multiply(fit.matrix, transforms)) / step
    section = pack_block(head) + pack_block(rows) + _encode_outliers(left, largest)
    return CodedSegment(step, section, np.ascontiguousarray(left.T))


def decode_segment(
    cursor: Cursor,
    samples: Float64,
    step: float,
    matrix: sparse.csr_array,
    n_frames: int,
    budget: Budget = UNLIMITED,
) -> tuple[Basis, Float64]:
    """Mirror of `encode_segment`: the basis, and the vertices' coefficients ``(R, V)``, model units.

    Args:
        cursor: over the section.
        samples: ``(R, V)`` what the planes hold, steps; changed where vertices are outliers.
        step: D, model units.
        matrix: ``(P, 4K)`` of the blend.
        n_frames: of the segment.
        budget: of the file.

    Raises:
        CorruptFile: the section is not what the encoder writes.
    """
    n_components, n_vertices = samples.shape
    head = cursor.block()
    rows = cursor.block()
    basis = decode_basis(head, n_frames, n_vertices, step, cursor.name, budget=budget)
    if basis.vectors.shape[1] != n_components:
        raise cursor.corrupt(f"{basis.vectors.shape[1]} components where the header says {n_components}")
    transforms = decode_coefficients(rows, matrix.shape[1] // 4, n_components, step, cursor.name)
    _decode_outliers(cursor, samples)
    samples *= step
    samples += multiply(matrix, transforms).T
    return basis, samples


def _encode_outliers(left: Float64, largest: float) -> bytes:
    """For ``left (V, R)``, steps."""
    places = np.flatnonzero(np.abs(left) > largest)
    values = np.rint(left.ravel()[places])
    if np.abs(values).max(initial=0) >= MAX_OUTLIER:
        raise InputError("the vertices move too far for the quality asked for; ask for a lower one")
    gaps = encode_integers(np.diff(places, prepend=0))
    return varint(len(places)) + pack_block(gaps) + encode_integers(values.astype(np.int64))


def _decode_outliers(cursor: Cursor, samples: Float64) -> None:
    count = cursor.varint(samples.size, "the number of outliers")
    gaps = decode_integers(cursor.block(), count, name=cursor.name)
    places = np.cumsum(gaps)
    wrong = (gaps < 0) | (gaps >= samples.size) | (places >= samples.size)
    if wrong.any() or (gaps[1:] == 0).any():
        raise cursor.corrupt("an outlier's place is out of range")
    values = decode_integers(cursor.rest(), count, name=cursor.name)
    vertices, components = np.divmod(places, max(1, len(samples)))
    samples[components, vertices] = values
