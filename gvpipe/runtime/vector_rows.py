"""Rows of numbers in kernels as vectors of LLVM: what `gvpipe.runtime.lanes` hands on where kernels are quick."""

from __future__ import annotations

import operator
from typing import Any, cast

from llvmlite import ir
from numba.core import types
from numba.core.typing.templates import ConcreteTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, models, register_model

from gvpipe.runtime.plain_rows import Load, Prefetch, Same, Store

OPERATORS = {operator.add: "fadd", operator.sub: "fsub", operator.mul: "fmul", operator.truediv: "fdiv"}

READ, KEEP, DATA = 0, 3, 1  # what `prefetch` is for, in LLVM's words


class _RowType(types.Type):
    """The type of a row of ``lanes`` numbers."""

    def __init__(self, lanes: int) -> None:
        self.lanes = lanes
        super().__init__(f"Row{lanes}")


@register_model(_RowType)
class _RowModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _vector(kind.lanes))


def _vector(lanes: int) -> Any:
    return ir.VectorType(ir.DoubleType(), lanes)


def make_rows(lanes: int) -> tuple[Load, Store, Same]:
    """Teach numba rows of so many numbers; return what loads, stores and makes them."""
    row_type = _RowType(lanes)

    def load(_typing: Any, array: Any, at: Any) -> tuple[Any, Any]:
        """The row of a flat array that begins at a place."""

        def generate(context: Any, builder: Any, sig: Any, given: Any) -> Any:
            row = builder.load(_pointer(context, builder, sig, given, lanes))
            row.align = 8
            return row

        return row_type(array, types.intp), generate

    def store(_typing: Any, array: Any, at: Any, row: Any) -> tuple[Any, Any]:
        """Put a row into a flat array from a place on."""

        def generate(context: Any, builder: Any, sig: Any, given: Any) -> Any:
            builder.store(given[2], _pointer(context, builder, sig, given, lanes)).align = 8
            return context.get_dummy_value()

        return types.void(array, types.intp, row_type), generate

    def same(_typing: Any, number: Any) -> tuple[Any, Any]:
        """A row of one number."""

        def generate(context: Any, builder: Any, sig: Any, given: Any) -> Any:
            row = ir.Constant(_vector(lanes), ir.Undefined)
            for lane in range(lanes):
                row = builder.insert_element(row, given[0], ir.Constant(ir.IntType(32), lane))
            return row

        return row_type(types.float64), generate

    for function, instruction in OPERATORS.items():
        _add_operator(function, instruction, row_type)
    return cast(Load, intrinsic(load)), cast(Store, intrinsic(store)), cast(Same, intrinsic(same))


def make_prefetch() -> Prefetch:
    """What asks for the numbers about a place in an array ``(n, m)``, which is not looked at."""

    def prefetch(_typing: Any, array: Any, row: Any, column: Any) -> tuple[Any, Any]:
        def generate(context: Any, builder: Any, sig: Any, given: Any) -> Any:
            array = context.make_array(sig.args[0])(context, builder, given[0])
            columns = builder.extract_value(array.shape, 1)
            at = builder.add(builder.mul(given[1], columns), given[2])
            place = builder.bitcast(builder.gep(array.data, [at]), ir.IntType(8).as_pointer())
            number = ir.IntType(32)
            kind = ir.FunctionType(ir.VoidType(), [place.type, number, number, number])
            function = builder.module.globals.get("llvm.prefetch.p0i8") or ir.Function(
                builder.module, kind, "llvm.prefetch.p0i8"
            )
            builder.call(function, [place, *(ir.Constant(number, each) for each in (READ, KEEP, DATA))])
            return context.get_dummy_value()

        return types.void(array, types.intp, types.intp), generate

    return cast(Prefetch, intrinsic(prefetch))


def _pointer(context: Any, builder: Any, sig: Any, given: Any, lanes: int) -> Any:
    array = context.make_array(sig.args[0])(context, builder, given[0])
    return builder.bitcast(builder.gep(array.data, [given[1]]), _vector(lanes).as_pointer())


def _add_operator(function: Any, instruction: str, row_type: Any) -> None:
    """Teach numba an operator of two rows."""

    class Template(ConcreteTemplate):  # type: ignore[misc]
        cases = (signature(row_type, row_type, row_type),)

    def lower(_context: Any, builder: Any, _sig: Any, given: Any) -> Any:
        return getattr(builder, instruction)(*given)

    infer_global(function)(Template)
    lower_builtin(function, row_type, row_type)(lower)
