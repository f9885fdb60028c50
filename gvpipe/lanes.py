"""Eight numbers at once in kernels: as many equal computations side by side, with the bits that each has alone.

LLVM makes vector instructions of long loops over slices. Loops of a few turns, as over a small matrix, stay scalar. So kernels
that solve many small systems put eight of them side by side, number k of all of them in one row of `LANES`, and work on rows:

- `load` and `store` move a row between a flat array and registers;
- ``+``, ``-``, ``*`` and ``/`` of two rows work lane by lane, and nothing is fused;
- `same` makes a row of one number.

A processor with narrower registers takes several instructions a row.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any, cast

import numpy as np
from llvmlite import ir
from numba.core import config, types
from numba.core.typing.templates import ConcreteTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, models, register_model

from gvpipe.arrays import Float64

LANES = 8
ROW = ir.VectorType(ir.DoubleType(), LANES)
OPERATORS = {operator.add: "fadd", operator.sub: "fsub", operator.mul: "fmul", operator.truediv: "fdiv"}


class _RowType(types.Type):
    def __init__(self) -> None:
        super().__init__("Row")


row_type = _RowType()


@register_model(_RowType)
class _RowModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, ROW)


def _load(_typing: Any, array: Any, at: Any) -> tuple[Any, Any]:
    """The row of a flat array that begins at a place."""

    def generate(context: Any, builder: Any, sig: Any, given: Any) -> Any:
        row = builder.load(_pointer(context, builder, sig, given))
        row.align = 8
        return row

    return row_type(array, types.intp), generate


def _store(_typing: Any, array: Any, at: Any, row: Any) -> tuple[Any, Any]:
    """Put a row into a flat array from a place on."""

    def generate(context: Any, builder: Any, sig: Any, given: Any) -> Any:
        builder.store(given[2], _pointer(context, builder, sig, given)).align = 8
        return context.get_dummy_value()

    return types.void(array, types.intp, row_type), generate


def _same(_typing: Any, number: Any) -> tuple[Any, Any]:
    """A row of one number."""

    def generate(context: Any, builder: Any, sig: Any, given: Any) -> Any:
        row = ir.Constant(ROW, ir.Undefined)
        for lane in range(LANES):
            row = builder.insert_element(row, given[0], ir.Constant(ir.IntType(32), lane))
        return row

    return row_type(types.float64), generate


def _pointer(context: Any, builder: Any, sig: Any, given: Any) -> Any:
    array = context.make_array(sig.args[0])(context, builder, given[0])
    return builder.bitcast(builder.gep(array.data, [given[1]]), ROW.as_pointer())


def _add_operator(function: Any, instruction: str) -> None:
    """Teach numba an operator of two rows."""

    class Template(ConcreteTemplate):  # type: ignore[misc]
        cases = (signature(row_type, row_type, row_type),)

    def lower(_context: Any, builder: Any, _sig: Any, given: Any) -> Any:
        return getattr(builder, instruction)(*given)

    infer_global(function)(Template)
    lower_builtin(function, row_type, row_type)(lower)


def _load_plain(array: Float64, at: int) -> Float64:
    return array[at : at + LANES].copy()


def _store_plain(array: Float64, at: int, row: Float64) -> None:
    array[at : at + LANES] = row


def _same_plain(number: float) -> Float64:
    return np.full(LANES, number)


is_plain = config.DISABLE_JIT  # kernels are Python then
load = cast(Callable[[Float64, int], Float64], _load_plain if is_plain else intrinsic(_load))
store = cast(Callable[[Float64, int, Float64], None], _store_plain if is_plain else intrinsic(_store))
same = cast(Callable[[float], Float64], _same_plain if is_plain else intrinsic(_same))
for _function, _instruction in OPERATORS.items():
    _add_operator(_function, _instruction)
