"""Compiled kernels of gvpipe as WebAssembly: python tools/build_wasm.py writes gvpipe/web/src/wasm/.

`KERNELS` lists the functions with ``@compiled`` that the web player calls, and the types of their arguments. The functions
themselves know nothing of it:

1. numba makes LLVM's intermediate code of each, unoptimised, so that nothing in it depends on this machine;
2. names and constants that belong to this process are taken out;
3. llvmlite links all into one module, optimises it and makes an object file for wasm32 with SIMD;
4. ``wasm-ld`` of PyPI's package ``ziglang`` makes ``kernels.wasm`` of it. Allocation stays an import.

``signatures.js`` says how to call them. Extra ``wasm`` pins the compilers' versions, since others write other bytes.
``--check`` compares the bytes with the files that are there.
"""

from __future__ import annotations

import argparse
import importlib.metadata
import json
import os
import re
import subprocess
import sys
import tempfile
import tomllib
import warnings
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

TARGET = Path(__file__).parents[1] / "gvpipe" / "web" / "src" / "wasm"
PROJECT = Path(__file__).parents[1] / "pyproject.toml"
ENVIRONMENT = {"NUMBA_OPT": "0", "NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""}  # as `compile_kernel` needs it

INTS, LONGS, FLOATS, BYTES, FLAGS = (
    "int32[1]",
    "int64[1]",
    "float64[1]",
    "uint8[1]",
    "bool[1]",
)  # element type and dimensions of an array
TRIANGLES, ROWS, NUMBERS, SCALAR = "int32[2]", "float64[2]", "int64[2]", "int64"
CAUSAL = ("gvpipe.trajectory.causal_order.CausalOrder", [INTS, INTS, INTS, FLOATS, FLOATS, INTS, INTS, "bool"])
HIERARCHY = ("gvpipe.mesh.hierarchy_kernels.Hierarchy", [INTS] * 6)
RESIDUALS = ("gvpipe.trajectory.contexts.Residuals", [NUMBERS, NUMBERS, NUMBERS])
INPUTS = ("gvpipe.trajectory.contexts.ContextInputs", [INTS] * 5 + [LONGS] * 4)
STREAM = ("gvpipe.entropy.block_kernels.BlockStream", ["uint64[1]", "uint32[1]", "uint64[2]", LONGS])
TRELLIS = ("gvpipe.entropy.learning_kernels.LearningStream", ["uint64[1]", "uint32[1]", NUMBERS])
VECTORS = ("gvpipe.trajectory.prediction_kernels.VectorCoding", [CAUSAL, "float64", NUMBERS, ROWS, ROWS, FLOATS, "float64"])
MIXING = (
    "gvpipe.entropy.decision_kernels.Mixing",
    ["uint32[2]", NUMBERS, LONGS, LONGS, LONGS, LONGS],
)
ENTRIES = ("gvpipe.mesh.entry_kernels.EntryOrder", [LONGS, LONGS, NUMBERS])
LISTS = ("gvpipe.connectivity.visit_kernels.NeighbourLists", [LONGS, INTS])
VISITS = ("gvpipe.connectivity.visit_kernels.CodedVisits", [LONGS] * 3)
SEAMS = ("gvpipe.connectivity.seam_corners.SeamCorners", [LONGS] * 4)
SERIAL = ("gvpipe.entropy.serial_kernels.SerialCoder", [STREAM, LONGS, LONGS, LONGS, "bool"])
PLACED = ("gvpipe.attributes.match_kernels.Entries", [ENTRIES, LONGS, SCALAR, SCALAR])
CORNERS = ("gvpipe.attributes.sharing_kernels.Corners", [TRIANGLES, LONGS, LONGS])
POSITIONS = "float32[2]"
GRAPH = ("gvpipe.mesh.graph_kernels.Graph", [LONGS, INTS])
SPARSE = ("gvpipe.trajectory.product_kernels.Rows", [LONGS, INTS, FLOATS])
LOWER = ("gvcodecs.laplacian.operator_kernels.Lower", [LONGS, INTS, FLOATS, FLOATS])
FACTORS = ("gvcodecs.laplacian.factor_kernels.Factors", [LONGS, INTS, FLOATS, FLOATS])
DELTA_ORDER = ("gvcodecs.laplacian.delta_kernels.DeltaOrder", [INTS] * 3)
MEMBERS = ("gvcodecs.pdct.shape_kernels.Members", [LONGS] * 3)
SHAPE = ("gvcodecs.pdct.shape_kernels.Shape", [ROWS, ROWS, FLOATS])
LOCAL_FRAMES = ("gvcodecs.pdct.shape_kernels.LocalFrames", ["float64[3]", "float64[3]"])
POSES = (
    "gvpipe.connectivity.cell_poses.Poses",
    ["int64[4]", NUMBERS, "int64[3]", LONGS, "int64[3]", "int64[3]", NUMBERS],
)
CELLS = ("gvpipe.connectivity.cell_kernels.Source", [LONGS, NUMBERS, NUMBERS, LONGS])
DELTA_LAYOUT = ("gvcodecs.pdct.delta_kernels.Layout", [LONGS] * 3)
LEARNING = ("gvcodecs.pdct.delta_kernels.Learning", [NUMBERS, NUMBERS, NUMBERS, LONGS, LONGS, LONGS, NUMBERS, NUMBERS, LONGS])
DELTAS = ("gvcodecs.pdct.delta_kernels.DeltaStream", ["uint64[1]", "uint32[1]", BYTES, LONGS])
WORDS = ["uint64[1]", "uint32[1]"]  # a range decoder's state and its words
KERNELS: dict[str, list[Any]] = {  # arguments: arrays in C order, scalars, NamedTuples of both, and tuples as lists
    "gvpipe.mesh.hierarchy_kernels.build_order": [TRIANGLES, SCALAR, SCALAR],
    "gvpipe.mesh.graph_kernels.label_components": [GRAPH],
    "gvpipe.mesh.graph_kernels.link_vertices": [TRIANGLES, SCALAR],
    "gvpipe.mesh.hierarchy_kernels.proper_triangles": [TRIANGLES],
    "gvpipe.mesh.hierarchy_kernels.triangles_left": [TRIANGLES, SCALAR, SCALAR],
    "gvpipe.mesh.traversal.traverse": [TRIANGLES, INTS, SCALAR],
    "gvpipe.mesh.entry_kernels.order_by_corners": [TRIANGLES, LONGS, SCALAR],
    "gvpipe.mesh.entry_kernels.order_by_edges": [LONGS],
    "gvpipe.connectivity.visit_kernels.decode_ranks": [*WORDS, "uint64[1]", VISITS],
    "gvpipe.connectivity.visit_kernels.sort_neighbours": [NUMBERS, NUMBERS, NUMBERS],
    "gvpipe.connectivity.visit_kernels.traverse_visits": [LISTS, SCALAR, VISITS, "bool"],
    "gvpipe.connectivity.order_kernels.code_visits": [LISTS, LONGS, SCALAR, MIXING, LONGS, BYTES, "bool", LONGS],
    "gvpipe.connectivity.candidate_kernels.code_by_candidates": [
        LISTS,
        LONGS,
        SCALAR,
        MIXING,
        MIXING,
        LONGS,
        BYTES,
        "bool",
        LONGS,
    ],
    "gvpipe.connectivity.fitted_kernels.code_fitted": [ENTRIES, TRIANGLES, LONGS, MIXING, LONGS, BYTES, "bool", NUMBERS],
    "gvpipe.connectivity.position_kernels.code_positions": [ENTRIES, MIXING, LONGS, BYTES, "bool", NUMBERS],
    "gvpipe.connectivity.cell_kernels.code_cells": [
        SERIAL,
        POSES,
        CELLS,
        NUMBERS,
        LONGS,
        [SCALAR] * 3,
        "bool",
        "bool",
    ],
    "gvpipe.connectivity.edge_seam_kernels.visit_corners": [SEAMS, LONGS, LONGS, LONGS, SCALAR],
    "gvpipe.attributes.linear_kernels.code_linear": [
        SERIAL,
        PLACED,
        ("gvpipe.attributes.linear_kernels.Linear", [SCALAR, "bool", TRIANGLES, LONGS, POSITIONS]),
        NUMBERS,
        ROWS,
    ],
    "gvpipe.attributes.octahedral_kernels.corner_normals": [TRIANGLES, POSITIONS, LONGS, SCALAR],
    "gvpipe.attributes.octahedral_kernels.code_octahedral": [
        SERIAL,
        PLACED,
        ("gvpipe.attributes.octahedral_kernels.Octahedral", [SCALAR, SCALAR, ROWS]),
        NUMBERS,
    ],
    "gvpipe.attributes.part_kernels.code_parts": [SERIAL, LONGS, LONGS, LONGS, SCALAR],
    "gvpipe.attributes.polygon_kernels.code_polygons": [
        SERIAL,
        ("gvpipe.attributes.fan_kernels.Soup", [TRIANGLES, LONGS, LONGS]),
        ("gvpipe.attributes.polygon_kernels.Fans", [LONGS] * 5),
    ],
    "gvpipe.attributes.sharing_kernels.code_sharing": [SERIAL, CORNERS, SCALAR, LONGS],
    "gvcodecs.mcgv.motion.weight_kernels.fill_weights": [
        ("gvcodecs.mcgv.base.causal_neighbours.CausalNeighbours", [LONGS, LONGS]),
        SCALAR,
        ("gvcodecs.mcgv.motion.weight_kernels.WeightNumbers", [LONGS] * 3),
        ("gvcodecs.mcgv.motion.weight_kernels.Listed", [LONGS] * 3),
        ("gvcodecs.mcgv.motion.skinning.Weights", ["int32[2]", "int32[2]"]),
    ],
    "gvcodecs.laplacian.anchor_kernels.select_anchors": [SCALAR, "bool", HIERARCHY, CAUSAL, INTS, INTS, FLAGS],
    "gvcodecs.laplacian.delta_kernels.order_deltas": ["bool", HIERARCHY, INTS, FLAGS],
    "gvcodecs.laplacian.delta_kernels.weigh_deltas": [DELTA_ORDER, GRAPH, ROWS, SCALAR, SCALAR],
    "gvpipe.mesh.elimination_kernels.order_unknowns": [LONGS, INTS, SCALAR, SCALAR],
    "gvpipe.mesh.elimination_kernels.factor_pattern": [LONGS, INTS, SCALAR],
    "gvcodecs.laplacian.factor_kernels.factorise": [LOWER, LONGS, INTS],
    "gvcodecs.laplacian.factor_kernels.solve_columns": [FACTORS, INTS, ROWS, ROWS, SCALAR, SCALAR],
    "gvcodecs.laplacian.laplace_kernels.fineness": [ROWS, GRAPH, "float64"],
    "gvcodecs.laplacian.laplace_kernels.laplace_rows": [ROWS, TRIANGLES, GRAPH, SCALAR],
    "gvcodecs.laplacian.laplace_kernels.scale_rows": [SPARSE, FLOATS, FLAGS],
    "gvcodecs.laplacian.laplace_kernels.thin_rows": [SPARSE],
    "gvcodecs.laplacian.operator_kernels.add_rows": [ROWS, INTS, "float64", ROWS],
    "gvcodecs.laplacian.operator_kernels.multiply_transposed": [SPARSE, INTS, ROWS],
    "gvcodecs.laplacian.operator_kernels.normal_matrix": [SPARSE, SPARSE, FLOATS, INTS, SCALAR],
    "gvcodecs.laplacian.operator_kernels.normal_pattern": [SPARSE, SPARSE],
    "gvcodecs.laplacian.operator_kernels.transpose": [SPARSE],
    "gvcodecs.mcgv.motion.blend_kernels.find_energies": [ROWS, "int32[2]", ROWS, SCALAR],
    "gvcodecs.mcgv.motion.blend_kernels.invert_factors": ["float64[3]"],
    "gvcodecs.mcgv.motion.blend_kernels.blend_rows": [ROWS, "int32[2]", ROWS, "float64[3]"],
    "gvcodecs.pdct.delta_kernels.start_learning": [DELTA_LAYOUT],
    "gvcodecs.pdct.delta_kernels.decode_deltas": [DELTA_LAYOUT, LEARNING, DELTAS, "int64[3]"],
    "gvcodecs.pdct.shape_kernels.find_members": [LONGS, LONGS, NUMBERS],
    "gvcodecs.pdct.shape_kernels.lay_out": [MEMBERS],
    "gvcodecs.pdct.shape_kernels.find_base_seeds": [ROWS, NUMBERS, FLOATS, NUMBERS],
    "gvcodecs.pdct.shape_kernels.find_frames": ["float64[3]", FLOATS],
    "gvcodecs.pdct.shape_kernels.shape_members": [ROWS, MEMBERS, LOCAL_FRAMES, "float64"],
    "gvcodecs.pdct.shape_kernels.rebuild_positions": [MEMBERS, SHAPE, LOCAL_FRAMES, "int64[3]", "float64", "float32[3]"],
    "gvcodecs.pdct.shape_kernels.place_seeds": [NUMBERS, "int64[3]", FLOATS, "float32[3]"],
    "gvpipe.fields.dual_kernels.find_dual": [TRIANGLES, SCALAR],
    "gvpipe.fields.residual_kernels.decode_rows": [
        ("gvpipe.fields.residual_kernels.Residuals", [NUMBERS, SCALAR, FLAGS, CAUSAL]),
        ("gvpipe.fields.residual_kernels.Forecast", [LONGS, LONGS, LONGS, LONGS]),
        MIXING,
        LONGS,
        BYTES,
        SCALAR,
        SCALAR,
    ],
    "gvpipe.fields.prediction_kernels.predict_rows": [
        (
            "gvpipe.fields.prediction_kernels.FieldCoding",
            [CAUSAL, SCALAR, FLAGS, SCALAR, "float64", ROWS, NUMBERS, ROWS, ROWS, "float64[3]"],
        ),
        SCALAR,
        SCALAR,
    ],
    "gvpipe.trajectory.causal_kernels.keep_ranks": [CAUSAL, FLAGS],
    "gvpipe.trajectory.context_kernels.decode_residuals": [RESIDUALS, INPUTS, STREAM, SCALAR, SCALAR],
    "gvpipe.trajectory.kalman_kernels.predict_kalman": [VECTORS, SCALAR, SCALAR],
    "gvpipe.trajectory.prediction_kernels.predict_lsp": [VECTORS, SCALAR, SCALAR],
    "gvpipe.trajectory.prediction_kernels.predict_navg": [VECTORS, SCALAR, SCALAR],
    "gvpipe.trajectory.prediction_kernels.predict_rbf": [VECTORS, SCALAR, SCALAR, "float64"],
    "gvpipe.trajectory.trellis_kernels.code_residuals": [RESIDUALS, INPUTS, TRELLIS, SCALAR, SCALAR, "bool"],
    "gvpipe.trajectory.spatial_kernels.weigh_hierarchy": [HIERARCHY, "bool"],
    "gvpipe.trajectory.spatial_kernels.weigh_parallelograms": [TRIANGLES, SCALAR],
    "gvpipe.trajectory.spatial_kernels.weigh_traversal": [TRIANGLES, SCALAR],
    "gvpipe.trajectory.still_kernels.fit_still": [ROWS, FLOATS, ROWS],
    "gvpipe.trajectory.product_kernels.multiply": [SPARSE, ROWS],
    "gvpipe.trajectory.product_kernels.weighted_sums": [ROWS, ROWS],
}

TRIPLE = "wasm32-unknown-unknown"
LAYOUT = "e-m:e-p:32:32-p10:8:8-p20:8:8-i64:64-i128:128-n32:64-S128-ni:1:10:20"
FEATURES = "+simd128,+bulk-memory,+nontrapping-fptoint,+sign-ext,+mutable-globals"
LINK = ["--no-entry", "--strip-all", "--allow-undefined", "--export=__heap_base", "-z", "stack-size=65536"]
REPLACED = [  # of the intermediate code
    (r",? align \d+", ""),  # of 64-bit pointers
    (r"(@numba\.dynamic\.globals\.\S+ = )linkonce global ptr inttoptr \(i64 \d+ to ptr\)", r"\1internal global ptr null"),
    (r"(@\S+ = )common ", r"\1internal "),
    (r"@sqrt\(", "@llvm.sqrt.f64("),
    (r"\n  store ptr @\.const\.picklebuf[^\n]*", ""),  # texts of exceptions
]


def main() -> None:
    """Write the files, or compare them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="compare with the files that are there, and write none")
    is_check = parser.parse_args().check
    if os.environ.get("PYTHONHASHSEED") != "0":  # numba goes through sets, whose order would change the bytes
        sys.exit(subprocess.run([sys.executable, *sys.argv], env={**os.environ, "PYTHONHASHSEED": "0"}).returncode)
    check_versions()
    with tempfile.TemporaryDirectory() as folder:
        os.environ.update(ENVIRONMENT, NUMBA_CACHE_DIR=folder)  # before numba loads; what is cached elsewhere is optimised
        files = build(Path(folder))
    for name, data in files.items():
        if not is_check:
            TARGET.mkdir(exist_ok=True)
            (TARGET / name).write_bytes(data)
        elif (TARGET / name).read_bytes() != data:
            sys.exit(f"{TARGET / name} is not what the kernels compile to; run python tools/build_wasm.py")
    print(", ".join(f"{name} {len(data)} bytes" for name, data in files.items()))


def check_versions() -> None:
    """Stop where another version of a compiler is installed than extra ``wasm`` names."""
    for requirement in tomllib.loads(PROJECT.read_text("utf-8"))["project"]["optional-dependencies"]["wasm"]:
        name, wanted = requirement.split("==")
        try:
            found = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            found = "missing"
        if found != wanted:
            sys.exit(f"{name} is {found}; {wanted} is needed: pip install -e '.[wasm]'")


def build(folder: Path) -> dict[str, bytes]:
    """The files by name; ``folder`` takes what is made on the way."""
    codes, signatures = [], {}
    for path, arguments in KERNELS.items():
        code, signatures[name_of(path)] = compile_kernel(path, arguments)
        codes.append(code)
    made, linked = folder / "kernels.o", folder / "kernels.wasm"
    made.write_bytes(make_object(codes, list(signatures)))
    exports = [f"--export={name}" for name in signatures]
    subprocess.run([sys.executable, "-m", "ziglang", "wasm-ld", *LINK, *exports, made, "-o", linked], check=True)
    lines = [f"  {name}: {json.dumps(signature)}," for name, signature in signatures.items()]
    text = "\n".join(
        [
            "// Made by tools/build_wasm.py: arguments of each kernel with NamedTuples unpacked, and what it returns.",
            "export const SIGNATURES = {",
            *lines,
            "};\n",
        ]
    )
    return {"kernels.wasm": linked.read_bytes(), "signatures.js": text.encode()}


def name_of(path: str) -> str:
    """A kernel's name alone."""
    return path.rpartition(".")[2]


def load(path: str) -> Any:
    """What a path with dots names."""
    module, _, name = path.rpartition(".")
    return getattr(import_module(module), name)


def compile_kernel(path: str, arguments: list[Any]) -> tuple[str, dict[str, list[str]]]:
    """A kernel's intermediate code, and its signature for JavaScript."""
    from numba.core import compiler, registry
    from numba.core.errors import NumbaWarning

    target = registry.cpu_target
    flags = compiler.Flags()
    flags.nrt, flags.no_cpython_wrapper, flags.no_cfunc_wrapper = True, True, True
    types = tuple(numba_type(argument) for argument in arguments)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", NumbaWarning)  # that unoptimised code is not cached
        made = compiler.compile_extra(target.typing_context, target.target_context, load(path).py_func, types, None, flags, {})
    code = made.library.get_llvm_str().replace(made.fndesc.llvm_func_name, name_of(path))
    code = re.sub(r'target triple = ".*"', f'target triple = "{TRIPLE}"', code)
    code = re.sub(r'target datalayout = ".*"', f'target datalayout = "{LAYOUT}"', code)
    for pattern, replacement in REPLACED:
        code = re.sub(pattern, replacement, code)
    given = [each for argument in arguments for each in unpacked(argument)]
    return code, {"given": given, "returned": list(returned(made.signature.return_type))}


def numba_type(argument: Any) -> Any:
    """numba's type of an argument of `KERNELS`."""
    from numba import types

    if isinstance(argument, list):
        return types.Tuple([numba_type(field) for field in argument])
    if not isinstance(argument, str):
        path, fields = argument
        return types.NamedTuple([numba_type(field) for field in fields], load(path))
    name, _, dimensions = argument.rstrip("]").partition("[")
    element = types.boolean if name == "bool" else getattr(types, name)
    return types.Array(element, int(dimensions), "C") if dimensions else element


def unpacked(argument: Any) -> Iterator[str]:
    """The arrays and scalars of an argument."""
    if isinstance(argument, str):
        yield argument
    else:
        for field in argument if isinstance(argument, list) else argument[1]:
            yield from unpacked(field)


def returned(kind: Any) -> Iterator[str]:
    """The arrays and scalars of a result, spelt as in `KERNELS`."""
    from numba import types

    if isinstance(kind, types.BaseTuple):
        for each in kind.types:
            yield from returned(each)
    elif isinstance(kind, types.Array):
        yield f"{kind.dtype}[{kind.ndim}]"
    elif kind != types.none:
        yield str(kind)


def make_object(codes: list[str], exported: list[str]) -> bytes:
    """The object file of all kernels' intermediate code."""
    import llvmlite.binding as llvm

    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    whole, *others = [llvm.parse_assembly(code) for code in codes]
    for other in others:
        whole.link_in(other)
    for function in whole.functions:
        if not function.is_declaration and function.name not in exported:
            function.linkage = llvm.Linkage.internal
    for variable in whole.global_variables:
        if not variable.is_declaration:
            variable.linkage = llvm.Linkage.internal
    machine = llvm.Target.from_triple(TRIPLE).create_target_machine(features=FEATURES, opt=3)
    options = llvm.create_pipeline_tuning_options(speed_level=3)
    options.loop_vectorization = options.slp_vectorization = True
    options.loop_unrolling = False  # pages would be 10 kB larger, and no file decodes faster
    llvm.create_pass_builder(machine, options).getModulePassManager().run(whole, llvm.create_pass_builder(machine, options))
    return bytes(machine.emit_object(whole))


if __name__ == "__main__":
    main()
