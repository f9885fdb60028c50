"""Least squares with a sparse operator: the normal equations, factored as L D L^T.

The order of elimination follows from the triangles in integers (`gvpipe.mesh.elimination_kernels`), and with it the size of the
factor. On surfaces it grows as P log P entries, and the work as P sqrt(P): 70 entries and 4200 products a point for 10,000
points, 130 and 22,000 for 100,000. On triangles that connect points at random it grows as P^2 and P^3. So work is counted
before it begins: it has a limit, and a file's budget has to have room for it.

Factors are plain arrays, sums run in one order (`factor_kernels`): the solution has the same bits on every machine.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gvpipe.foundation.arrays import Float64, Int32, Int64
from gvpipe.foundation.budget import ALLOW, UNLIMITED, Budget
from gvpipe.foundation.errors import OverBudget

if TYPE_CHECKING:
    from gvcodecs.laplacian.factor_kernels import Factors
    from gvpipe.trajectory.product_kernels import Rows

COLUMNS = 32  # solved at once: more do not fit the cache
FREE_PRODUCTS = 1 << 27  # that any system may take
STEPS = 3 << 26  # of an encoder's search for an order: a second, of the two that any file may take
PRODUCTS = 512  # that P points may take beside, times P sqrt(P): 7 times what a square grid of 100,000 points needs
NO_LIMIT = 1 << 62
BYTES_PER_PAIR, SECONDS_PER_PAIR = 20, 15e-9  # of points that a row couples
BYTES_PER_ENTRY, SECONDS_PER_ENTRY = 12, 20e-9  # of a factor
SECONDS_PER_PRODUCT = 1.4e-9
SECONDS_PER_STEP = 6e-9  # of the search for an order; 4 on an idle machine
SECONDS_PER_SOLVED = 0.5e-9  # of an entry, times columns


class Fill(NamedTuple):
    """What a factor costs.

    Args:
        entries: below the diagonal, of 12 bytes each.
        products: of two entries, that factoring takes.
        steps: of the search for the order of elimination.
    """

    entries: int
    products: int
    steps: int


class TooMuchFill(OverBudget):
    """A factor would take more products than its number of points allows."""


class Singular(ArithmeticError):
    """The normal equations have no single solution."""


def most_products(n_points: int) -> int:
    """How many products a factor over P points may take."""
    return FREE_PRODUCTS + PRODUCTS * n_points * math.isqrt(n_points)


def count_fill(operator: Rows, limit: int) -> Fill:
    """What factoring the normal equations of ``operator (P, P)`` costs; what was counted so far, if it passes a limit."""
    from gvcodecs.laplacian.operator_kernels import transpose

    return _eliminate(operator, transpose(operator), limit, NO_LIMIT if limit == NO_LIMIT else STEPS)[2]


class NormalEquations:
    """The factored system ``L^T L + diag(held)``.

    Args:
        operator: ``(P, P)`` L, by rows, columns ascending.
        held: ``(P,)`` added to the diagonal.
        budget: of the file; without a limit, factors may take whatever they take.

    Raises:
        TooMuchFill: the factor takes more than `most_products`.
        OverBudget: it takes more than the file may.
        Singular: an unknown is held by nothing.
    """

    def __init__(self, operator: Rows, held: Float64, budget: Budget = UNLIMITED) -> None:
        from gvcodecs.laplacian.factor_kernels import factorise
        from gvcodecs.laplacian.operator_kernels import normal_matrix, transpose
        from gvpipe.mesh.elimination_kernels import factor_pattern

        self._rows, self._budget = operator, budget
        n_pairs, what = int(np.square(np.diff(operator.starts)).sum()), f"factoring over {len(held)} points"
        budget.ask(what, BYTES_PER_PAIR * n_pairs, SECONDS_PER_PAIR * n_pairs)
        transposed = transpose(self._rows)
        limit = most_products(len(held)) if budget.is_limited else NO_LIMIT
        most_steps = int(budget.seconds_left / SECONDS_PER_STEP) if budget.is_limited else NO_LIMIT
        self._order, columns, self.fill = _eliminate(self._rows, transposed, limit, most_steps)
        if self.fill.products > limit:
            most = f"{len(held)} points may take {limit} products"
            raise TooMuchFill(
                f"its triangles couple points at random: factoring takes too long, {most}; encode it as pca, or {ALLOW}"
            )
        budget.keep(what, seconds=SECONDS_PER_STEP * self.fill.steps)
        work = SECONDS_PER_PAIR * n_pairs + SECONDS_PER_ENTRY * self.fill.entries + SECONDS_PER_PRODUCT * self.fill.products
        budget.ask(what, BYTES_PER_PAIR * n_pairs + BYTES_PER_ENTRY * self.fill.entries)
        budget.keep(what, BYTES_PER_ENTRY * self.fill.entries, work)
        matrix = normal_matrix(self._rows, transposed, held, self._order, len(columns) // 2)
        pattern = factor_pattern(matrix.starts, matrix.rows, self.fill.entries)
        factors, at = factorise(matrix, *pattern)
        if at >= 0:
            raise Singular(f"no equation holds point {self._order[at]}")
        self._factors: Factors = factors

    def ask_to_solve(self, n_columns: int) -> None:
        """Check that the file may take the work of so many solutions; raises `OverBudget`."""
        seconds = SECONDS_PER_SOLVED * n_columns * (self.fill.entries + len(self._order))
        self._budget.ask(f"{n_columns} solutions over {len(self._order)} points", seconds=seconds)

    def multiply(self, vectors: Float64) -> Float64:
        """The operator times ``vectors (P, R)``."""
        from gvpipe.trajectory.product_kernels import multiply

        return multiply(self._rows, np.ascontiguousarray(vectors))

    def multiply_transposed(self, points: Int32, vectors: Float64) -> Float64:
        """The operator's transpose times vectors that are zero but at ``points (D,)``: ``(D, R)`` to ``(P, R)``."""
        from gvcodecs.laplacian.operator_kernels import multiply_transposed

        return multiply_transposed(self._rows, points, np.ascontiguousarray(vectors))

    def solve(self, right: Float64) -> Float64:
        """Turn right-hand sides ``(P, R)`` into solutions, in place, and return them."""
        from gvcodecs.laplacian.factor_kernels import solve_columns

        n_columns = right.shape[1]
        for first in range(0, n_columns, COLUMNS):
            solve_columns(self._factors, self._order, right, right, first, min(first + COLUMNS, n_columns))
        return right


def _eliminate(rows: Rows, transposed: Rows, limit: int, most_steps: int) -> tuple[Int32, Int32, Fill]:
    """Order of elimination ``(P,)``, the normal matrix' columns beside its diagonal, and the factor's cost."""
    from gvcodecs.laplacian.operator_kernels import normal_pattern
    from gvpipe.mesh.elimination_kernels import order_unknowns

    starts: Int64
    starts, columns = normal_pattern(rows, transposed)
    order, entries, products, steps = order_unknowns(starts, columns, limit, most_steps)
    return order, columns, Fill(entries, products, steps)
