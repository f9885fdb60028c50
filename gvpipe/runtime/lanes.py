"""Several numbers at once in kernels: equal computations side by side, each with the bits that it has alone.

LLVM makes vector instructions of long loops over slices. Loops of a few turns, as over a small matrix, stay scalar. So kernels
that solve many small systems put eight of them side by side, number k of all of them in one row of `LANES`, and work on rows;
kernels that move points have rows of `COORDINATES`, the last of which is unused:

- `load` and `store` move a row between a flat array and registers, `load_point` and `store_point` a row of coordinates;
- ``+``, ``-``, ``*`` and ``/`` of two rows work lane by lane, and nothing is fused;
- `same` and `same_point` make a row of one number;
- `prefetch` asks the memory for what is needed soon, and nothing waits for it.

A processor with narrower registers takes several instructions a row. `gvpipe.runtime.kernel_form` decides what a row is: a
vector (`gvpipe.runtime.vector_rows`), or an array (`gvpipe.runtime.plain_rows`).
"""

from __future__ import annotations

from gvpipe.runtime.kernel_form import Form, kernel_form
from gvpipe.runtime.plain_rows import Load, Prefetch, Same, Store

LANES, COORDINATES = 8, 4  # numbers in a row


def _make() -> tuple[tuple[Load, Store, Same], tuple[Load, Store, Same], Prefetch]:
    """Rows of `LANES`, rows of `COORDINATES`, and what asks for memory."""
    form = kernel_form()
    if form is Form.QUICK:
        from gvpipe.runtime import vector_rows

        return vector_rows.make_rows(LANES), vector_rows.make_rows(COORDINATES), vector_rows.make_prefetch()
    from gvpipe.runtime import plain_rows

    rows, points, prefetch = plain_rows.make_rows(LANES), plain_rows.make_rows(COORDINATES), plain_rows.prefetch
    if form is Form.PLAIN:
        import numba

        compile = numba.njit
        return tuple(map(compile, rows)), tuple(map(compile, points)), compile(prefetch)
    return rows, points, prefetch


(load, store, same), (load_point, store_point, same_point), prefetch = _make()
