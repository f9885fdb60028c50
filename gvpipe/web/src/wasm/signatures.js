// Made by tools/build_wasm.py: arguments of each kernel with NamedTuples unpacked, and what it returns.
export const SIGNATURES = {
  decimate: {"given": ["int32[2]", "int64", "int64"], "returned": ["int32[1]", "int32[1]", "int32[1]", "int32[1]", "int32[1]", "int32[2]"]},
  traverse: {"given": ["int32[2]", "int32[1]", "int64"], "returned": ["int32[1]", "int32[1]", "int32[1]"]},
  find_dual: {"given": ["int32[2]", "int64"], "returned": ["int32[2]"]},
  decode_rows: {"given": ["int64[2]", "int64", "bool[1]", "int32[1]", "int32[1]", "int32[1]", "float64[1]", "float64[1]", "int32[1]", "int32[1]", "bool", "int64[2]", "uint8[2]", "int64[2]", "int64[1]", "int64[1]", "int64[1]", "int64[1]", "uint8[1]"], "returned": ["bool"]},
  predict_rows: {"given": ["int32[1]", "int32[1]", "int32[1]", "float64[1]", "float64[1]", "int32[1]", "int32[1]", "bool", "int64", "bool[1]", "int64", "float64", "int64[2]", "float64[2]", "float64[2]"], "returned": []},
  add_components: {"given": ["float64[2]", "float64[2]", "float64[2]"], "returned": []},
  predict_kalman: {"given": ["int32[1]", "int32[1]", "int32[1]", "float64[1]", "float64[1]", "int32[1]", "int32[1]", "bool", "float64", "int64[2]", "float64[2]", "float64[2]"], "returned": []},
};
