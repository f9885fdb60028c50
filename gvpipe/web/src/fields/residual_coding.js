/** Residuals of rows from bytes. Mirrors `gvpipe.fields.residual_coding`. */

import {
  RESIDUAL_KERNELS_NODES as NODES,
  RESIDUAL_KERNELS_N_COARSE as N_COARSE,
  RESIDUAL_KERNELS_N_CONTEXTS as N_CONTEXTS,
  RESIDUAL_KERNELS_N_FINE as N_FINE,
  RESIDUAL_KERNELS_N_MIXERS as N_MIXERS,
} from "../constants.js";
import { DecisionStream, newMixing } from "../format/decisions.js";
import { corrupt } from "../format/errors.js";
import { inBlocks } from "../trajectory/coefficient_coding.js";

const N_SLOTS = N_FINE * N_COARSE * NODES;

/**
 * @param {import("../wasm/kernels.js").Kernels} kernels
 * @param {import("../wasm/kernels.js").KernelArray[]} causal the order of R rows, as kernels take it
 * @param {Uint8Array} data
 * @param {[number, number]} size columns N, and frames F of which they are
 * @param {string} name of the section, for messages
 * @param {import("../wasm/kernels.js").KernelArray|null} still (R) flags of rows of which each component's first column alone is coded
 * @returns {import("../wasm/kernels.js").KernelArray} (R, N) int64
 */
export function decodeResiduals(kernels, causal, data, [columns, frames], name, still = null) {
  const rows = causal[0].shape[0];
  const values = kernels.array("int64", [rows, columns]);
  const flags = still ?? kernels.array("bool", [rows]);
  const mixing = newMixing(kernels, N_CONTEXTS, N_SLOTS, N_MIXERS);
  const stream = new DecisionStream(kernels, data);
  const forecast = [columns, columns, columns, rows].map((count) => kernels.array("int64", [count]));
  const given = [values, frames, flags, ...causal, ...forecast, ...mixing, ...stream.arrays];
  const isWhole = inBlocks(rows, (first, end) => kernels.call("decode_rows", ...given, first, end)[0] === 1);
  if (!isWhole || stream.place < data.length) throw corrupt(name, "its residuals do not decode");
  for (const array of [...stream.arrays, ...forecast, ...mixing]) kernels.free(array);
  return values;
}
