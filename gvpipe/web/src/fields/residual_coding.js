/** Residuals of rows from bytes. Mirrors `gvpipe.fields.residual_coding`. */

import {
  DECISION_KERNELS_ONE_BITS as ONE_BITS,
  DECISION_KERNELS_PLACE as PLACE,
  DECISION_KERNELS_RANGE as RANGE,
  RESIDUAL_KERNELS_NODES as NODES,
  RESIDUAL_KERNELS_N_COARSE as N_COARSE,
  RESIDUAL_KERNELS_N_CONTEXTS as N_CONTEXTS,
  RESIDUAL_KERNELS_N_FINE as N_FINE,
  RESIDUAL_KERNELS_N_MIXERS as N_MIXERS,
} from "../constants.js";
import { corrupt } from "../format/errors.js";
import { inBlocks } from "../trajectory/coefficient_coding.js";
import { SQUASH, STRETCH } from "./logistic_tables.js";

const SEEN = 250; // last uses of a slot that count
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
  const mixing = newMixing(kernels);
  const bytes = kernels.array("uint8", [data.length], data);
  const forecast = [columns, columns, columns, rows].map((count) => kernels.array("int64", [count]));
  const state = kernels.array("int64", [3], startState(data));
  const given = [values, frames, flags, ...causal, ...forecast, ...mixing, state, bytes];
  const isWhole = inBlocks(rows, (first, end) => kernels.call("decode_rows", ...given, first, end)[0] === 1);
  if (!isWhole || kernels.view(state)[PLACE] < data.length) throw corrupt(name, "its residuals do not decode");
  for (const array of [bytes, state, ...forecast, ...mixing]) kernels.free(array);
  return values;
}

/** Mirrors `start_decoder` of `gvpipe.entropy.decision_kernels`. */
function startState(data) {
  const code = [0, 1, 2, 3].reduce((sum, i) => sum * 256 + (data[i] ?? 0), 0);
  return [code, RANGE, 4].map(BigInt);
}

/** Mirrors `new_mixing` of `gvpipe.entropy.decision_kernels`. */
function newMixing(kernels) {
  const own = Math.floor((65536 * 4) / (3 * N_CONTEXTS));
  const chances = kernels.array("int64", [N_CONTEXTS, N_SLOTS]);
  kernels.view(chances).fill(1n << BigInt(ONE_BITS - 1));
  const longs = (values) => kernels.array("int64", [values.length], BigInt64Array.from(values, BigInt));
  const weights = Array.from({ length: N_MIXERS * (N_CONTEXTS + 1) }, (_, i) => ((i + 1) % (N_CONTEXTS + 1) ? own : 0));
  return [
    chances,
    kernels.array("uint8", [N_CONTEXTS, N_SLOTS]),
    kernels.array("int64", [N_MIXERS, N_CONTEXTS + 1], BigInt64Array.from(weights, BigInt)),
    kernels.array("int64", [N_CONTEXTS + 1]),
    longs(Array.from({ length: SEEN + 1 }, (_, n) => Math.floor((2 * 65536) / (2 * n + 3)))),
    longs(Array.from(SQUASH)),
    longs(Array.from(STRETCH)),
  ];
}
