"""Functions of XDMF's DataItems: arithmetic over other items, ``$0 + 2 * $1``, and ``JOIN($0 ; $1 ; $2)``.

Source: XDMF, "XDMF model and format", ItemType Function.
"""

from __future__ import annotations

import ast
import operator
import re
from collections.abc import Callable

import numpy as np

from gvpipe.foundation.arrays import Array

LONGEST = 1000  # characters
MOST_JOINED = 16  # arrays
ARGUMENT = re.compile(r"\$(\d+)")
OPERATORS: dict[type[ast.operator], Callable[[Array, Array], Array]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
}  # fmt: skip
CALLS: dict[str, Callable[[Array], Array]] = {
    "ABS": np.abs, "SQRT": np.sqrt, "SIN": np.sin, "COS": np.cos, "TAN": np.tan, "ASIN": np.arcsin, "ACOS": np.arccos,
    "ATAN": np.arctan, "EXP": np.exp, "LOG": np.log,
}  # fmt: skip


def evaluate(text: str, arguments: list[Array]) -> Array:
    """The value of a function, in float64.

    Args:
        text: as the file has it.
        arguments: what ``$0``, ``$1``, ... are; all of one shape, or single numbers.

    Raises:
        ValueError: it is none that is read, or its arguments do not fit each other.
    """
    arguments = [each.astype(np.float64) for each in arguments]
    plain = ARGUMENT.sub(r"_\1", text.replace(";", ",")).strip()
    refused = ValueError(
        f"a DataItem's function is {text[:40]!r}; sums, products, JOIN, {', '.join(CALLS)} of $0, $1, ... are read"
    )
    if len(plain) > LONGEST:
        raise refused
    try:
        with np.errstate(all="ignore"):
            return np.asarray(_value(ast.parse(plain, mode="eval").body, arguments))
    except (SyntaxError, ValueError, KeyError, TypeError, IndexError, OverflowError, RecursionError) as exc:
        raise refused from exc


def _value(node: ast.expr, arguments: list[Array]) -> Array:
    if isinstance(node, ast.Constant):
        if type(node.value) not in (int, float):
            raise TypeError("a constant is no number")
        return np.asarray(float(node.value))  # type: ignore[arg-type]  # it is one
    if isinstance(node, ast.Name):
        return arguments[int(node.id.removeprefix("_"))]
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.UAdd):
        value = _value(node.operand, arguments)
        return -value if isinstance(node.op, ast.USub) else value
    if isinstance(node, ast.BinOp):
        left, right = _value(node.left, arguments), _value(node.right, arguments)
        if left.shape != right.shape and 1 not in (left.size, right.size):
            raise TypeError("two arrays are of different shapes")
        return OPERATORS[type(node.op)](left, right)
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and not node.keywords:
        values = [_value(each, arguments) for each in node.args]
        if node.func.id.upper() == "JOIN":
            if len(values) > MOST_JOINED:
                raise TypeError("too many arrays are joined")
            return np.stack([each.reshape(-1) for each in values], axis=1)
        if len(values) == 1:
            return CALLS[node.func.id.upper()](values[0])
    raise TypeError(type(node).__name__)
