"""Kernels that refuse every index that is out of bounds, and every negative one, which would count from the end.

numba checks the upper bound when ``NUMBA_BOUNDSCHECK`` is 1. Before that check it adds an array's length to a negative index.
So what lies below 0 by a mistake reads another row in silence. Here the addition is left out: then numba's check finds it.
Indices that the code writes as constants (``x[-1]``) are meant, and keep their sense; so do slices.

Machine code of these kernels is kept apart from that of the others.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).resolve().parent.parent / "build" / "fuzz" / "strict-kernels"


def refuse_bad_indices() -> None:
    """Compile all kernels from here on with such checks; call it before any kernel's module is imported."""
    os.environ.update(NUMBA_BOUNDSCHECK="1", NUMBA_CACHE_DIR=str(FOLDER))
    FOLDER.mkdir(parents=True, exist_ok=True)

    from numba.core import config, types
    from numba.np import arrayobj

    config.reload_config()

    def keep(context: Any, builder: Any, kind: Any, index: Any, size: Any) -> Any:
        if kind.signed and not _is_constant(index):
            return context.cast(builder, index, kind, types.intp)
        return wrap(context, builder, kind, index, size)

    wrap = arrayobj.fix_integer_index
    arrayobj.fix_integer_index = keep


def _is_constant(index: Any) -> bool:
    """Whether an LLVM value is a constant, or an item of a tuple that was put there as one."""
    from llvmlite import ir
    from llvmlite.ir.instructions import ExtractValue, InsertValue

    if isinstance(index, ExtractValue):
        holder = index.operands[0]
        while isinstance(holder, InsertValue) and holder.indices != index.indices:
            holder = holder.operands[0]
        if isinstance(holder, InsertValue):
            index = holder.operands[1]
    return isinstance(index, ir.Constant)
