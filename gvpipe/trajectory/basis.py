"""Principal trajectories of a sequence, how many of them pay, and their coding.

A sequence is a matrix of trajectories, ``(V, 3F)``. Its mean trajectory and the leading eigenvectors of its 3F x 3F
autocorrelation span a space in which a vertex is a short feature vector.

One step D serves everything. With eigenvalues l_k (energy over all vertices) the matrix is a product of coefficients of column
energy l_k and of basis vectors of energy 1; the basis is scaled by sqrt(l_k) before it is quantised with D, so that an error
of D in either factor costs the same (reverse water-filling). Both factors are coded as feature vectors (`coefficient_coding`):
the coefficients along the surface, the basis along time (`temporal_neighbours`). The mean is one more column, of scale sqrt(V).

A caller may let the basis err more (``coarseness``): the scales are smaller, and the decoder need not know.

Components are kept while they pay: l_k > THRESHOLD (V + 3F) D^2. D is such that the error comes to what is wanted, also
where a component leaves. After coding, coefficients are fitted anew to the decoded basis, so that what its errors span is not
lost.

Basis stream: [varint] components R; [varint] bytes of the scales, scales [integers]: differences of round(8 log2(sqrt(l_k) /
D)), then the vectors. Source: Vasa and Skala 2010, section 3.2; the paper's basis coder (COBRA) predicts along time from frames
before alone.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from gvpipe.container.cursor import Cursor, pack_block, varint
from gvpipe.entropy.integers import decode_integers, encode_integers
from gvpipe.foundation.arrays import Float64, Floats, Int64
from gvpipe.foundation.budget import UNLIMITED, Budget
from gvpipe.foundation.elementary import exp2, log, log2
from gvpipe.trajectory.coefficient_coding import MAX_VALUES, decode_vectors, encode_vectors, stream_flags
from gvpipe.trajectory.gram import descending_eigenvectors, gram_of_columns, is_tall, product, smaller_gram
from gvpipe.trajectory.temporal_neighbours import temporal_order
from gvpipe.trajectory.trellis import FINDS_NOISES

THRESHOLD = 0.2
NEGLIGIBLE = 0.01  # part of the error that all components left out may add
ROUNDING = 1e-13  # of the total energy: eigenvalues below are noise
MAX_COMPONENTS = 1 << 14
BYTES_PER_VALUE, SECONDS_PER_VALUE = 40, 0.3e-6  # of a basis or of coefficients: residuals twice, numbers, copies
BYTES_PER_ROW = 520  # of a basis, a coordinate of a frame: its causal neighbours, while they are found
MAX_SCALE = 8 * 64  # scales run from 2**-64 to 2**64 steps
PER_OCTAVE = 8
ROOTS = np.array([math.isqrt(math.isqrt(math.isqrt(1 << (8 * 60 + i)))) / 2**60 for i in range(PER_OCTAVE)])  # 2 ** (i / 8)
PER_STEP_OCTAVE = 1024  # steps are 0.07 % apart
BLOCK = 1024  # vertices rebuilt at a time
LARGE_BLOCK = 1 << 16  # vertices centred at a time
RIDGE, LEAST = 1e-9, 1e-12  # on the diagonal of a basis' Gram matrix: a vector of a tiny segment may decode to zero
LEAST_OUTSIDE = 0.2  # part of a basis' errors that is taken to lie outside its span, at least


@dataclass(frozen=True)
class Principal:
    """Exact principal trajectories of a segment.

    Args:
        mean: ``(3F,)`` trajectory, model units, frame by frame, x y z.
        energies: ``(K,)`` descending, squared model units, over all vertices.
        vectors: ``(3F, K)`` orthonormal.
        rest: energy of what is in no component.
    """

    mean: Float64
    energies: Float64
    vectors: Float64
    rest: float


@dataclass(frozen=True)
class Basis:
    """A decoded basis: ``mean (3F,)`` and ``vectors (3F, R)``, which are nearly orthonormal."""

    mean: Float64
    vectors: Float64


@dataclass(frozen=True)
class Reduced:
    """Trajectories in the space of a coded basis.

    Args:
        step: D, model units.
        basis: its bytes.
        coefficients: ``(V, R)``, still to be coded, model units.
        decoded: the basis, as the decoder will have it.
    """

    step: float
    basis: bytes
    coefficients: Float64
    decoded: Basis


def reduce_trajectories(
    trajectories: Float64,
    error: float,
    n_components: int = 0,
    basis_ratio: float = 1.0,
    point_cost: float = THRESHOLD,
    entry_cost: float = THRESHOLD,
    noise: float = 1.0,
    most: int = MAX_COMPONENTS,
    n_axes: int = 3,
    penalty: float | None = None,
    flags: int = 0,
    coarseness: float = 1.0,
    point_noise: float | None = None,
) -> Reduced:
    """Choose the step and the components of ``trajectories (V, 3F)``, and code their basis.

    Args:
        trajectories: model units.
        error: squared error to leave, about, summed over all coordinates, model units squared.
        n_components: most components; 0: as many as pay.
        basis_ratio: step of the basis, in steps of the coefficients.
        point_cost, entry_cost: of a component (`count_components`).
        noise: squared error of decoded coefficients, in that of rounding them to the step.
        most: components, whatever pays.
        n_axes: coordinates of a frame; 3 in all formulas here stands for it.
        penalty: of a bit of the basis, on a trellis (`gvpipe.trajectory.coefficient_coding`); ``noise`` is the basis', too.
        flags: of its stream (`gvpipe.trajectory.trellis`).
        coarseness: of the basis, which its scales hide from the decoder: errors of its entries, in steps.
        point_noise: as ``noise``, of the coefficients alone.
    """
    n_points, n_coordinates = trajectories.shape
    principal = find_principal(trajectories, error)
    basis_noise = (basis_ratio * coarseness) ** 2 * (1.0 if penalty is None else noise)
    left = ((noise if point_noise is None else point_noise) * n_points + basis_noise * n_coordinates) / 12
    step, kept = choose_step(
        principal, error, lambda step: min(most, count_components(principal, n_points, step, point_cost, entry_cost)), left
    )
    kept = min(n_components, most, len(principal.energies)) or kept
    data, basis = encode_basis(principal, kept, n_points, step * basis_ratio, n_axes, penalty, flags, coarseness)
    return Reduced(step, data, fit_coefficients(trajectories, basis), basis)


def find_principal(trajectories: Float64, error: float, *, is_centred: bool = True) -> Principal:
    """Return the principal trajectories of ``(V, 3F)`` that matter where a squared ``error``, model units, is left anyway.

    From the smaller of the two Gram matrices, and only the eigenvectors wanted: on 2010 hardware the paper's full decomposition
    took minutes, this takes a fraction of a second for 400 frames. Not centred, their mean is left in, and 0 stands for it.
    """
    mean = trajectories.mean(axis=0) if is_centred else np.zeros(trajectories.shape[1])
    tall = is_tall(trajectories)
    if tall:  # by blocks: a copy of a million vertices' trajectories is large
        blocks = (trajectories[rows] - mean for rows in row_blocks(len(trajectories)))
        gram = np.sum([gram_of_columns(block) for block in blocks], axis=0)
    else:
        gram = smaller_gram(trajectories - mean)
    total = float(np.trace(gram))
    least = max(NEGLIGIBLE * error / len(gram), ROUNDING * total)
    if not total > least:
        return Principal(mean, np.zeros(0), np.zeros((len(mean), 0)), total)
    energies, vectors = descending_eigenvectors(gram, least)
    if not tall:
        vectors = product((trajectories - mean).T, vectors) / np.sqrt(energies)
    return Principal(mean, energies, np.ascontiguousarray(vectors), max(0.0, total - float(energies.sum())))


def count_components(
    principal: Principal, n_points: int, step: float, point_cost: float = THRESHOLD, entry_cost: float = THRESHOLD
) -> int:
    """How many components pay at this step, for V points.

    A component pays while its energy exceeds, in squared steps, what its V coefficients and 3F basis entries cost:
    ``V * point_cost + 3F * entry_cost``.
    """
    n_coordinates = len(principal.mean)
    n_paying = int((principal.energies > (point_cost * n_points + entry_cost * n_coordinates) * step * step).sum())
    return min(n_paying, MAX_COMPONENTS, MAX_VALUES // max(n_points, n_coordinates) - 1)


def expected_error(principal: Principal, n_kept: int, step: float, left: float) -> float:
    """Squared error, summed over all coordinates, that coding R components with this step leaves, model units squared.

    Of a component ``left`` squared steps, but no more than its energy (reverse water-filling); of the mean as of any.
    """
    each = left * step * step
    kept, dropped = principal.energies[:n_kept], principal.energies[n_kept:]
    return float(each + np.minimum(kept, each).sum() + dropped.sum() + principal.rest)


def choose_step(principal: Principal, error: float, count: Callable[[float], int], left: float) -> tuple[float, int]:
    """Return the step, model units, that leaves about the squared ``error``, and how many components to keep.

    ``count`` returns how many pay at a step. Where one leaves, the error jumps, and no step leaves what lies between:
    then the step is chosen for either number of components, and taken is the one that lies nearer to the jump.
    """

    def is_met(step: float, n_kept: int) -> bool:
        return expected_error(principal, n_kept, step, left) <= error

    jump = _coarsest(lambda step: is_met(step, count(step)))
    counts = {count(jump), count(jump * exp2(1 / PER_STEP_OCTAVE))}
    choices = [(_coarsest(functools.partial(is_met, n_kept=n)), n) for n in sorted(counts)]
    return min(choices, key=lambda choice: abs(log(choice[0] / jump)))


def _coarsest(is_fine: Callable[[float], bool]) -> float:
    """The largest step that is fine, by bisection in whole 1 / PER_STEP_OCTAVE octaves: eigenvalues' last bits count little."""
    low, high = -PER_STEP_OCTAVE * 130, PER_STEP_OCTAVE * 128  # float32 positions reach 2**128
    while high - low > 1:
        middle = (low + high) // 2
        if is_fine(exp2(middle / PER_STEP_OCTAVE)):
            low = middle
        else:
            high = middle
    return exp2(low / PER_STEP_OCTAVE)


def encode_basis(
    principal: Principal,
    n_components: int,
    n_points: int,
    step: float,
    n_axes: int = 3,
    penalty: float | None = None,
    flags: int = 0,
    coarseness: float = 1.0,
) -> tuple[bytes, Basis]:
    """Code the mean and the first R principal trajectories; return the bytes and what the decoder will have.

    ``penalty`` and ``flags`` are those of `gvpipe.trajectory.coefficient_coding.encode_vectors`, ``coarseness`` that of
    `reduce_trajectories`.
    """
    levels = np.rint(PER_OCTAVE * log2(np.sqrt(principal.energies[:n_components]) / (step * coarseness))).astype(np.int64)
    levels = np.clip(levels, -MAX_SCALE, MAX_SCALE)
    scales = _scales(levels, n_points, step)
    columns = np.column_stack([principal.mean, principal.vectors[:, :n_components]]) * scales  # (3F, 1 + R)
    order = temporal_order(len(columns) // n_axes, n_axes, bool(flags & FINDS_NOISES))
    data, decoded = encode_vectors(columns, _basis_step(step, columns.shape), order, penalty=penalty, flags=flags)
    head = encode_integers(np.diff(levels, prepend=0))
    decoded /= scales
    return varint(n_components) + pack_block(head) + data, Basis(decoded[:, 0], decoded[:, 1:])


def decode_basis(
    data: bytes,
    n_frames: int,
    n_points: int,
    step: float,
    name: str,
    n_axes: int = 3,
    *,
    budget: Budget = UNLIMITED,
) -> Basis:
    """Mirror of `encode_basis`.

    Raises:
        CorruptFile: the bytes are not what it writes.
        OverBudget: the basis and the coefficients of ``n_points`` take more than the file may.
    """
    cursor = Cursor(data, name)
    n_components = cursor.varint(min(MAX_COMPONENTS, n_axes * n_frames), "the number of components")
    n_values = (n_points + n_axes * n_frames) * (n_components + 1)
    what = f"section {name!r}, {n_components} trajectories over {n_frames} frames for {n_points} points,"
    memory = BYTES_PER_VALUE * n_values + BYTES_PER_ROW * n_axes * n_frames
    budget.ask(what, memory, SECONDS_PER_VALUE * n_values)
    head = cursor.block()
    levels = np.cumsum(decode_integers(head, n_components, name=name))
    if (np.abs(levels) > MAX_SCALE).any():
        raise cursor.corrupt("a scale is out of range")
    if n_axes * n_frames * (n_components + 1) > MAX_VALUES:
        raise cursor.corrupt(f"{n_components} components over {n_frames} frames")
    coarse_step = _basis_step(step, (n_axes * n_frames, n_components + 1))
    rest = cursor.rest()
    order = temporal_order(n_frames, n_axes, bool(stream_flags(rest, name) & FINDS_NOISES))
    decoded = decode_vectors(rest, n_components + 1, coarse_step, order, name)
    decoded /= _scales(levels, n_points, step)
    return Basis(decoded[:, 0], decoded[:, 1:])


def fit_coefficients(trajectories: Float64, basis: Basis) -> Float64:
    """Return the coefficients ``(V, R)`` that bring ``trajectories (V, 3F)`` closest, given the decoded basis."""
    from gvpipe.trajectory.product_kernels import solve_definite

    if not basis.vectors.shape[1]:
        return np.zeros((len(trajectories), 0))
    gram = gram_of_columns(basis.vectors)
    gram[np.diag_indices_from(gram)] *= 1 + RIDGE
    gram[np.diag_indices_from(gram)] += LEAST
    turned, fitted = basis.vectors.T, np.empty((len(trajectories), len(gram)))
    for rows in row_blocks(len(trajectories)):  # as many copies of a million vertices' coefficients would be large
        right = product(turned, (trajectories[rows] - basis.mean).T)
        solve_definite(gram.copy(), right)
        fitted[rows] = right.T
    return fitted


def squared_errors(trajectories: Floats, basis: Basis, coefficients: Float64) -> Float64:
    """Squared errors ``(V,)``, summed over frames, of ``trajectories (V, 3F)`` from a basis and ``coefficients (V, R)``."""
    result, turned = np.empty(len(trajectories)), np.ascontiguousarray(basis.vectors.T)
    for first in range(0, len(result), BLOCK):
        block = slice(first, first + BLOCK)
        left = trajectories[block] - basis.mean - product(coefficients[block], turned)
        result[block] = np.square(left).sum(axis=1)
    return result


def row_blocks(n_rows: int, size: int = LARGE_BLOCK) -> Iterator[slice]:
    """Rows of a tall matrix, of which copies are made one after the other, ``size`` at a time; one block at least."""
    for first in range(0, max(n_rows, 1), size):
        yield slice(first, first + size)


def _scales(levels: Int64, n_points: int, step: float) -> Float64:
    """Scales of the mean's column and of the others."""
    octaves, parts = np.divmod(levels, PER_OCTAVE)
    return np.concatenate([[np.sqrt(n_points)], step * np.ldexp(ROOTS[parts], octaves.astype(np.int32))])


def _basis_step(step: float, shape: tuple[int, ...]) -> float:
    """The basis' own step, for ``(3F, 1 + R)``: coarser, since coefficients fitted anew absorb errors in its span."""
    return float(step / np.sqrt(max(LEAST_OUTSIDE, 1 - shape[1] / shape[0])))
