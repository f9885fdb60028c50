"""Arguments of kernels without a count of their references.

numba counts references of arrays, up and down, atomically, wherever one is taken out of a tuple or passed on. Loops over tuples
of arrays spend up to two thirds of their time on that. Whoever calls a kernel keeps its arguments until it returns, so that
they need no count: here their arrays belong to nobody, and numba leaves their counts out.

A kernel that returns arrays counts, since what it returns may be an argument. So loops that take time belong into kernels that
return numbers, or nothing, and fill arrays that they are given.

Source: numba's documentation, "Customizing the Compiler", and its class `numba.core.lowering.Lower`.
"""

from __future__ import annotations

from typing import Any

from numba.core import cgutils
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import register_pass
from numba.core.lowering import Lower
from numba.core.typed_passes import BaseNativeLowering, NativeLowering
from numba.core.types import Array, Boolean, Number
from numba.core.types.containers import BaseTuple
from numba.core.types.misc import NoneType


class _Borrow(Lower):  # type: ignore[misc]
    """From numba's typed code to LLVM's."""

    def extract_function_arguments(self) -> list[Any]:
        """The arguments, as the body of the function takes them."""
        given: list[Any] = super().extract_function_arguments()
        if not _has_array(self.fndesc.restype):
            kinds = self.fndesc.argtypes
            self.fnargs = [self._without_owner(kind, value) for kind, value in zip(kinds, given, strict=True)]
        return list(self.fnargs)

    def _without_owner(self, kind: Any, value: Any) -> Any:
        """A value of numba's type ``kind`` whose arrays belong to nobody."""
        if isinstance(kind, BaseTuple):
            parts = [self._without_owner(part, self.builder.extract_value(value, i)) for i, part in enumerate(kind)]
            return self.context.make_tuple(self.builder, kind, parts)
        if isinstance(kind, Array):
            array = self.context.make_array(kind)(self.context, self.builder, value)
            array.meminfo, array.parent = (cgutils.get_null_value(owner.type) for owner in (array.meminfo, array.parent))
            return array._getvalue()
        return value


def _has_array(kind: Any) -> bool:
    """Whether a value of numba's type ``kind`` may hold arrays."""
    if isinstance(kind, BaseTuple):
        return any(_has_array(part) for part in kind)
    return not isinstance(kind, Number | Boolean | NoneType)


@register_pass(mutates_CFG=True, analysis_only=False)
class _BorrowingLowering(BaseNativeLowering):  # type: ignore[misc]
    _name = "borrowing_lowering"

    @property
    def lowering_class(self) -> type[_Borrow]:
        return _Borrow


class BorrowingCompiler(CompilerBase):  # type: ignore[misc]
    """numba's compiler, but that arguments are borrowed."""

    def define_pipelines(self) -> list[Any]:
        """The steps of compiling."""
        steps = DefaultPassBuilder.define_nopython_pipeline(self.state)
        if NativeLowering not in (step for step, _ in steps.passes):
            raise NotImplementedError(
                "this version of numba has no NativeLowering"
            )  # kernels would count, and nobody would know
        steps.passes = [(_BorrowingLowering if step is NativeLowering else step, why) for step, why in steps.passes]
        steps.finalize()
        return [steps]
