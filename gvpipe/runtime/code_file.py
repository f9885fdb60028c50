"""A file of machine code: one kernel, for one tuple of argument types, without a pickle.

The file is the SHA-256 of the rest, three lengths (8 bytes each, little-endian), and then:

1. JSON: names and types as text, see `pack`;
2. the machine code, as LLVM makes it for the linker;
3. LLVM's bitcode, which only kernels that call this one need.

Types of arguments are in the file as text, to be compared with those that the caller has. The type of the result is written by
`text_of_type`. Environments are the objects of Python that machine code refers to; those of kernels hold types of numbers.
"""

from __future__ import annotations

import functools
import hashlib
import importlib
import json
import re
import struct
import sys
from typing import Any, NamedTuple

import numpy as np
from llvmlite import binding
from numba.core import types, typing
from numba.core.compiler import CompileResult
from numba.core.environment import Environment, lookup_environment
from numba.core.funcdesc import PythonFunctionDescriptor
from numba.core.types.containers import BaseNamedTuple, BaseTuple

HEAD = struct.Struct("<QQQ")
DIGEST = 32  # bytes of a SHA-256
NUMBERS = {str(kind): kind for kind in (types.none, types.boolean, *types.number_domain)}
IMPORTED = ("gvpipe.", "gvcodecs.", "numba.", "numpy.")  # packages of modules that a file may load
TEXTS = ("modname", "qualname", "unique_name", "env_name", "mangled_name")  # of numba's description of a function
NUMBER_TYPE = re.compile(r"[<>|=]?[biufc?][0-9]{0,2}")  # NumPy parses much more
PLAIN = ("native", "inline", "noalias", "uid")


class Unstorable(ValueError):
    """A compile result that has what a file does not hold."""


class Code(NamedTuple):
    """The parts of a file."""

    described: dict[str, Any]
    code: bytes
    bitcode: bytes


def pack(result: Any) -> bytes:
    """The file of a compile result; raises `Unstorable`."""
    library, described, environment, signature, is_object_mode, lifted, _, reload, environments = result._replace(
        type_annotation=""
    )._reduce()
    if is_object_mode or lifted or reload or described.kws or described.global_dict is not None:
        raise Unstorable(described.qualname)
    name, kind, (code, bitcode) = library
    if kind != "object":
        raise Unstorable(kind)
    text = json.dumps(
        {
            "symbols": _defined(result.library._get_module_for_linking()),
            "library": name,
            "types": [spelt(each) for each in signature.args],
            "result": text_of_type(signature.return_type),
            "function": {key: getattr(described, key) for key in (*TEXTS, *PLAIN)},
            "arguments": list(described.args),
            "tags": list(described.abi_tags),
            "environment": _environment_text(environment),
            "environments": [_environment_text(each) for each in environments],
        }
    ).encode()
    data = HEAD.pack(len(text), len(code), len(bitcode)) + text + code + bitcode
    return bytes(hashlib.sha256(data).digest() + data)


def unpack(data: bytes) -> Code:
    """The parts of a file; raises `ValueError` for a damaged one."""
    body = memoryview(data)[DIGEST:]
    if hashlib.sha256(body).digest() != data[:DIGEST]:
        raise ValueError("a file of machine code is damaged")
    n_text, n_code, n_bitcode = HEAD.unpack_from(body)
    if HEAD.size + n_text + n_code + n_bitcode != len(body):
        raise ValueError("a file of machine code has another length than it says")
    code = HEAD.size + n_text
    described = json.loads(bytes(body[HEAD.size : code]))
    return Code(described, bytes(body[code : code + n_code]), bytes(body[code + n_code :]))


def rebuild(target_context: Any, arguments: tuple[Any, ...], parts: Code) -> Any:
    """The compile result of a file, for the types of arguments that it was made for.

    numba reads the bitcode of each, which takes longer than all the rest. Only kernels that are compiled later, and call this
    one, need it. So it is read then.

    Raises:
        ValueError, KeyError, TypeError, AttributeError, ImportError: the file does not fit.
    """
    described = parts.described
    if described["types"] != [spelt(each) for each in arguments]:
        raise ValueError("it is the code for other arguments")
    signature = typing.signature(type_of_text(described["result"]), *arguments)
    library = described["library"], "object", (parts.code, _nothing())
    environments = tuple(_environment(*each) for each in described["environments"])
    given = library, _function(described, signature), _environment(*described["environment"]), signature
    known = target_context.codegen()._engine._defined_symbols
    new = set(described["symbols"]) - known
    known |= new  # numba looks there for the kernel's address
    try:
        result = CompileResult._rebuild(target_context, *given, False, (), "", [], environments)
    except BaseException:
        known -= new
        raise
    result.library._get_module_for_linking = functools.cache(lambda: binding.parse_bitcode(parts.bitcode))
    return result


def spelt(kind: Any) -> str:
    """An argument's type as text; named tuples with their modules."""
    if isinstance(kind, BaseNamedTuple):
        fields = ", ".join(map(spelt, kind))
        return f"{kind.instance_class.__module__}.{kind.instance_class.__qualname__}({fields})"
    return f"({', '.join(map(spelt, kind))})" if isinstance(kind, BaseTuple) else str(kind)


def _function(described: dict[str, Any], signature: Any) -> Any:
    """numba's description of a function, which only its compiler makes."""
    made = object.__new__(PythonFunctionDescriptor)
    for key in (*TEXTS, *PLAIN):
        setattr(made, key, described["function"][key])
    made.args, made.kws, made.abi_tags = tuple(described["arguments"]), (), tuple(described["tags"])
    made.restype, made.argtypes = signature.return_type, signature.args
    made.typemap = made.calltypes = made.global_dict = made.doc = None
    return made


def text_of_type(kind: Any) -> Any:
    """A type as JSON: a number's name, or a list whose first entry says what it is."""
    if str(kind) in NUMBERS:
        return str(kind)
    if isinstance(kind, types.Array) and type(kind) is types.Array:
        return ["array", text_of_type(kind.dtype), kind.ndim, kind.layout, kind.mutable, kind.aligned]
    if isinstance(kind, BaseNamedTuple):
        made = kind.instance_class
        return ["named", made.__module__, made.__qualname__, [text_of_type(each) for each in kind]]
    if isinstance(kind, BaseTuple):
        return ["tuple", [text_of_type(each) for each in kind]]
    if type(kind).__module__ == "gvpipe.runtime.vector_rows":
        return ["row", kind.lanes]
    raise Unstorable(str(kind))


def type_of_text(text: Any) -> Any:
    """The type that a text says."""
    if isinstance(text, str):
        return NUMBERS[text]
    match text:
        case ["array", dtype, int(ndim), "C" | "F" | "A" as layout, bool(mutable), bool(aligned)]:
            of: Any = types.Array  # numba's annotations list the layouts
            return of(type_of_text(dtype), ndim, layout, readonly=not mutable, aligned=aligned)
        case ["tuple", list(parts)]:
            return BaseTuple.from_types(tuple(map(type_of_text, parts)))
        case ["named", str(module), str(name), list(parts)]:
            return BaseTuple.from_types(tuple(map(type_of_text, parts)), _class(module, name))
        case ["row", int(lanes)]:
            return _class("gvpipe.runtime.vector_rows", "_RowType")(lanes)
    raise ValueError(f"{text!r} is no type")


def _class(module: str, name: str) -> Any:
    """A class of a module that is loaded, or is one of ours."""
    found: Any = _module(module)
    for part in name.split("."):
        found = getattr(found, part)
    if not isinstance(found, type):
        raise TypeError(f"{module}.{name} is no class")
    return found


def _module(name: str) -> Any:
    if name not in sys.modules and not f"{name}.".startswith(IMPORTED):
        raise ImportError(f"module {name} is not loaded")
    return importlib.import_module(name)


def _environment_text(environment: Any) -> list[Any]:
    constants = [each.str if isinstance(each, np.dtype) else None for each in environment.consts]
    module = environment.globals.get("__name__")
    if None in constants or not isinstance(module, str):
        raise Unstorable(environment.env_name)
    return [environment.env_name, module, constants]


def _environment(name: str, module: str, constants: list[str]) -> Any:
    """The environment of that name; a new one if there is none yet."""
    found = lookup_environment(name)
    if found is None:
        if not all(NUMBER_TYPE.fullmatch(each) for each in constants):
            raise ValueError(f"environment {name!r} has constants that are no types of numbers")
        found = Environment(_module(module).__dict__)
        found.consts[:] = [np.dtype(each) for each in constants]
        found.env_name = name
        Environment._memo[name] = found
    return found


def _defined(module: Any) -> list[str]:
    """The names that a module defines."""
    return [each.name for kind in (module.functions, module.global_variables) for each in kind if not each.is_declaration]


@functools.cache
def _nothing() -> bytes:
    """The bitcode of a module without functions."""
    return bytes(binding.parse_assembly("").as_bitcode())
