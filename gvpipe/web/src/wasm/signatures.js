// Made by tools/build_wasm.py: arguments of each kernel with NamedTuples unpacked, and what it returns.
export const SIGNATURES = {
  build_order: {"given": ["int32[2]", "int64", "int64"], "returned": ["int32[1]", "int32[1]", "int32[1]", "int32[1]", "int32[1]", "int32[1]"]},
  triangles_left: {"given": ["int32[2]", "int64", "int64"], "returned": ["int32[2]"]},
  find_dual: {"given": ["int32[2]", "int64"], "returned": ["int32[2]"]},
  decode_rows: {"given": ["int64[2]", "int64", "bool[1]", "int32[1]", "int32[1]", "int32[1]", "float64[1]", "float64[1]", "int32[1]", "int32[1]", "bool", "int64[1]", "int64[1]", "int64[1]", "int64[1]", "int64[2]", "uint8[2]", "int64[2]", "int64[1]", "int64[1]", "int64[1]", "int64[1]", "int64[1]", "uint8[1]", "int64", "int64"], "returned": ["bool"]},
  predict_rows: {"given": ["int32[1]", "int32[1]", "int32[1]", "float64[1]", "float64[1]", "int32[1]", "int32[1]", "bool", "int64", "bool[1]", "int64", "float64", "int64[2]", "float64[2]", "float64[2]", "float64[3]", "int64", "int64"], "returned": []},
  keep_ranks: {"given": ["int32[1]", "int32[1]", "int32[1]", "float64[1]", "float64[1]", "int32[1]", "int32[1]", "bool", "bool[1]"], "returned": ["int32[1]", "int32[1]", "int32[1]", "float64[1]", "float64[1]", "int32[1]", "int32[1]", "bool"]},
  decode_residuals: {"given": ["int64[2]", "int64[1]", "int64[1]", "int64[1]", "int64[1]", "int64[1]", "int64[1]", "int64[1]", "int64[1]", "uint64[1]", "uint32[1]", "uint64[2]", "int64[1]", "int64[1]", "int64", "int64"], "returned": ["int64"]},
  predict_kalman: {"given": ["int32[1]", "int32[1]", "int32[1]", "float64[1]", "float64[1]", "int32[1]", "int32[1]", "bool", "float64", "int64[2]", "float64[2]", "float64[2]", "int64", "int64"], "returned": []},
  predict_lsp: {"given": ["int32[1]", "int32[1]", "int32[1]", "float64[1]", "float64[1]", "int32[1]", "int32[1]", "bool", "float64", "int64[2]", "float64[2]", "float64[2]", "int64", "int64"], "returned": []},
  predict_navg: {"given": ["int32[1]", "int32[1]", "int32[1]", "float64[1]", "float64[1]", "int32[1]", "int32[1]", "bool", "float64", "int64[2]", "float64[2]", "float64[2]", "int64", "int64"], "returned": []},
  predict_rbf: {"given": ["int32[1]", "int32[1]", "int32[1]", "float64[1]", "float64[1]", "int32[1]", "int32[1]", "bool", "float64", "int64[2]", "float64[2]", "float64[2]", "int64", "int64", "float64"], "returned": []},
  weigh_hierarchy: {"given": ["int32[1]", "int32[1]", "int32[1]", "int32[1]", "int32[1]", "int32[1]", "bool"], "returned": ["int32[1]", "int32[1]", "int32[1]", "float64[1]", "float64[1]", "int32[1]", "int32[1]", "bool"]},
  weigh_traversal: {"given": ["int32[2]", "int64"], "returned": ["int32[1]", "int32[1]", "int32[1]", "float64[1]", "float64[1]", "int32[1]", "int32[1]", "bool"]},
  fit_still: {"given": ["float64[2]", "float64[1]", "float64[2]"], "returned": ["float64[2]"]},
  weighted_sums: {"given": ["float64[2]", "float64[2]"], "returned": ["float64[2]"]},
};
