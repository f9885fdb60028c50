/**
 * Vectors of coefficients from bytes: residuals in contexts of their expected magnitude, then prediction. Mirrors
 * `gvpipe.trajectory.coefficient_coding.decode_vectors`; `docs/format.md`, section 6.
 *
 * Contexts are integers, and must be Python's: all sums here stay below 2^53.
 */

import {
  COEFFICIENT_CODING_LARGEST as LARGEST,
  COEFFICIENT_CODING_MAX_VALUES as MAX_VALUES,
  CONTEXTS_FLOOR_NEAR as FLOOR_NEAR,
  CONTEXTS_FLOOR_SPAN as FLOOR_SPAN,
  CONTEXTS_HIGHEST as HIGHEST,
  CONTEXTS_LONG as LONG,
  CONTEXTS_LOWEST as LOWEST,
  CONTEXTS_MAX_LEVEL as MAX_LEVEL,
  CONTEXTS_N_CONTEXTS as N_CONTEXTS,
  CONTEXTS_N_NEAR as N_NEAR,
  CONTEXTS_ONE as ONE,
  CONTEXTS_PER_OCTAVE as PER_OCTAVE,
  CONTEXTS_POWERS as POWERS,
  CONTEXTS_POWER_ONE as POWER_ONE,
  CONTEXTS_SHORT as SHORT,
} from "../constants.js";
import { BlockDecoder } from "./block_coder.js";
import { Cursor } from "./cursor.js";
import { powersOfTwo } from "./exact_powers.js";
import { decodeIntegers } from "./integers.js";
import { predictVectors } from "./prediction.js";

export { MAX_VALUES };

const ROUNDED = powersOfTwo();
const LEVEL_BOUNDS = Float64Array.from({ length: MAX_LEVEL + 1 }, (_, level) => Number(ROUNDED[4 * level]));
/** The least integers v with 64 v + 1 >= 2 ** (i / 16) rounded down. */
const LOG_BOUNDS = Float64Array.from(ROUNDED, (power) => Number((power - 1n + 63n) >> 6n));
const SMALL_LOGS = Int16Array.from({ length: 1 << 14 }, (_, value) => searchLog(value)); // of most that are asked for

/**
 * @param {Uint8Array} data
 * @param {number} components R
 * @param {number} step quantisation step
 * @param {import("./prediction.js").CausalOrder} causal
 * @param {string} name of the section, for messages
 * @returns {Float64Array} (n, R) by vector, flat
 */
export function decodeVectors(data, components, step, causal, name) {
  const cursor = new Cursor(data, name);
  const n = causal.order.length;
  if (n * components > MAX_VALUES) throw cursor.corrupt(`${n} vectors of ${components} components`);
  const levels = decodeIntegers(cursor.take(cursor.varint(cursor.left, "a length")), components, null, name);
  const usual = new Float64Array(components); // magnitude of each component, in 1 / ONE
  for (let c = 0, level = 0; c < components; c++) {
    level += levels[c];
    if (level < 0 || level > MAX_LEVEL) throw cursor.corrupt("a magnitude level is out of range");
    usual[c] = LEVEL_BOUNDS[level];
  }
  const coder = new BlockDecoder(cursor.rest(), N_CONTEXTS, name);
  const values = decodeResiduals(causal, usual, coder);
  coder.end();
  predictVectors(causal, step, values, components);
  return values;
}

/** Residuals (n, R) by vector, flat. */
function decodeResiduals(causal, usual, coder) {
  const components = usual.length;
  const values = new Float64Array(causal.order.length * components);
  const blockOf = new Int32Array(causal.order.length); // by vector
  let before = usual;
  /** Mean magnitude of a component in the neighbours of vector i of the order; those of its own block count as 0. */
  const meanAround = (i, c) => {
    const count = Math.min(causal.ringSizes[i], causal.starts[i + 1] - causal.starts[i], N_NEAR);
    let sum = 0;
    for (let j = causal.starts[i]; j < causal.starts[i] + count; j++) {
      const neighbour = causal.neighbours[j];
      if (blockOf[neighbour] < blockOf[causal.order[i]]) sum += ONE * Math.abs(values[neighbour * components + c]);
    }
    return Math.floor(sum / Math.max(1, count));
  };
  for (let b = 0; b + 1 < causal.blocks.length; b++) {
    const [first, end] = [causal.blocks[b], causal.blocks[b + 1]];
    for (let i = first; i < end; i++) blockOf[causal.order[i]] = b;
    const contexts = new Uint8Array(end - first);
    const found = new Float64Array(end - first);
    const sums = new Float64Array(components);
    for (let c = 0; c < components; c++) {
      const fixed = POWERS[0] * log(usual[c]) + POWERS[1] * log(before[c]) - spans(usual, 0, c, 1);
      for (let i = first; i < end; i++) {
        const magnitude = b ? meanAround(i, c) : usual[c];
        const forecast = fixed + POWERS[2] * log(magnitude + FLOOR_NEAR) + spans(values, causal.order[i] * components, c, ONE);
        const octaves = Math.floor(forecast / POWER_ONE) - PER_OCTAVE * Math.log2(ONE);
        contexts[i - first] = Math.min(Math.max(Math.floor(octaves / (PER_OCTAVE / 2)), LOWEST), HIGHEST) - LOWEST;
      }
      coder.take(contexts, found);
      for (let i = first; i < end; i++) {
        const residual = found[i - first];
        const magnitude = Math.abs(residual);
        if (magnitude >= LARGEST) throw coder.cursor.corrupt("a residual is out of range");
        sums[c] += ONE * magnitude;
        values[causal.order[i] * components + c] = residual;
      }
    }
    before = sums.map((sum) => Math.floor(sum / Math.max(1, end - first)) + 1);
  }
  return values;
}

/** The part of a forecast from a vector's components before c: logarithms of weighted sums of their magnitudes, times `one`. */
function spans(vector, start, c, one) {
  let short = 0;
  let long = 0;
  for (let t = Math.min(c, LONG.length) - 1; t >= 0; t--) {
    const magnitude = Math.abs(vector[start + c - 1 - t]);
    long += magnitude * LONG[t];
    if (t < SHORT.length) short += magnitude * SHORT[t];
  }
  return POWERS[3] * log(one * short + FLOOR_SPAN) + POWERS[4] * log(one * long + FLOOR_SPAN);
}

/** Logarithm of an integer to base two, in 1 / PER_OCTAVE, rounded down; of 0 as of 1/64. */
function log(value) {
  return value < SMALL_LOGS.length ? SMALL_LOGS[value] : searchLog(value);
}

function searchLog(value) {
  let low = 0;
  let high = LOG_BOUNDS.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (LOG_BOUNDS[middle] <= value) low = middle + 1;
    else high = middle;
  }
  return low - 1 - 6 * PER_OCTAVE;
}
