/**
 * Vectors of coefficients from bytes, by Python's kernels: residuals in contexts of their expected magnitude, then prediction. Mirrors
 * `gvpipe.trajectory.coefficient_coding.decode_vectors`; `docs/format.md`, section 6.
 */

import {
  COEFFICIENT_CODING_MAX_VALUES as MAX_VALUES,
  COEFFICIENT_CODING_MOST_FLAGS as MOST_FLAGS,
  CONTEXTS_MAX_LEVEL as MAX_LEVEL,
  CONTEXTS_N_CONTEXTS as N_CONTEXTS,
  CONTEXTS_PER_OCTAVE as PER_OCTAVE,
  CONTEXTS_TREND_POWERS as TREND_POWERS,
  TRELLIS_FALL as FALL,
  TRELLIS_FINDS_NOISES as FINDS_NOISES,
  TRELLIS_FINENESS as FINENESS,
  TRELLIS_GRADES as GRADES,
  TRELLIS_LEAST_GRADE as LEAST_GRADE,
  TRELLIS_PARTS as PARTS,
  TRELLIS_WHAT as WHAT,
} from "../constants.js";
import { BlockStream } from "../format/block_stream.js";
import { Cursor } from "../format/cursor.js";
import { decodeIntegers } from "../format/integers.js";
import { powersOfTwo } from "./exact_powers.js";
import { TrellisStream } from "./trellis_stream.js";

export { MAX_VALUES };

const MOST_LOGS = 2 ** 14; // numbers whose logarithms are looked up
const LEAST_VECTORS = 16; // of a call
const BLOCK_TIME = 20; // ms that a call takes, about

let tables = null; // made when first needed

/**
 * @param {import("../wasm/kernels.js").Kernels} kernels
 * @param {(import("../wasm/kernels.js").KernelArray|boolean)[]} causal the order, as kernels take it
 * @param {Uint8Array} data @param {number} components R @param {number} step quantisation step
 * @param {string} name of the section, for messages
 * @param {{predictor?: string, beta?: number, given?: import("../wasm/kernels.js").KernelArray|null, blocks?: number|null, known?: number, rounds?: boolean}} [how]
 *   `given` (n, R) has decoded vectors that `causal` leaves out, and the first `known` components of all, and is filled; `blocks` are
 *   decoded alone; `rounds`: components to parts of their step
 * @returns {import("../wasm/kernels.js").KernelArray} (n, R) float64, by vector
 * @throws {GeometryVideoError} the bytes are not as gvpipe writes them
 */
export function decodeVectors(...given) {
  return finish(vectorSteps(...given));
}

/** `decodeVectors` in steps of some 20 ms, so that other work may come between. @yields after a step */
export function* vectorSteps(kernels, causal, data, components, step, name, { predictor = "kalman", beta = 0, given = null, blocks = null, known = 0, rounds = false } = {}) {
  const cursor = new Cursor(data, name);
  const [order, , , , , , bounds] = causal;
  const n = order.shape[0];
  if (n * components > MAX_VALUES) throw cursor.corrupt(`${n} vectors of ${components} components`);
  tables ??= makeTables();
  const coded = components - known;
  const levels = decodeIntegers(cursor.block(), coded, null, name);
  const means = new BigInt64Array(2 * coded); // those that are usual, and sums of what is decoded
  for (let c = 0, level = 0; c < coded; c++) {
    level += levels[c];
    if (level < 0 || level > MAX_LEVEL) throw cursor.corrupt("a magnitude level is out of range");
    means[c] = tables.levels[level];
  }
  const rest = cursor.rest();
  const flags = flagsOf(rest);
  const onTrellis = flags !== null;
  const what = flags >> WHAT;
  if ((known || rounds) && !onTrellis) throw cursor.corrupt("its residuals are not on a trellis");
  if (flags && predictor !== "kalman") throw cursor.corrupt("its flags are those of the predictor kalman");
  const wanted = blocks ?? bounds.shape[0] - 1;
  const vectors = kernels.view(bounds)[wanted];
  if (onTrellis && rest.length === 1 && vectors * coded > 0) throw cursor.corrupt("it has no words");
  const stream = onTrellis ? new TrellisStream(kernels, rest.subarray(1), what > 0, name) : new BlockStream(kernels, rest, N_CONTEXTS, name);
  const decoded = given ?? kernels.array("float64", [n, components]);
  const inputs = contextInputs(kernels, causal, decoded.shape[0], means.subarray(0, coded), wanted, TREND_POWERS[what]);
  const residuals = kernels.array("int64", [vectors, coded]);
  const state = [residuals, kernels.array("int64", [coded, vectors]), kernels.array("int64", [2, coded], means)];
  for (let b = 0; b < wanted; b++) {
    const given = [...state, ...inputs, ...stream.arrays, b, b + 1];
    stream.check((onTrellis ? kernels.call("code_residuals", ...given, false) : kernels.call("decode_residuals", ...given))[0]);
    yield;
  }
  if (blocks === null) stream.end();
  const target = kernels.array("float64", [0, 0]);
  const noises = kernels.array("float64", [components]);
  const last = predictor === "rbf" ? [beta] : [];
  const fine = onTrellis ? step * FINENESS : step;
  const steps = stepsOf(fine, bounds.shape[0] - 1, flags);
  for (const [first, end, before] of flags ? runs(kernels.view(bounds), wanted) : [[0, vectors, 0]]) {
    const own = flags ? steps.shift() : fine;
    kernels.view(noises).set(noisesOf(kernels, residuals, [before, first], own, flags, known));
    const coding = [...causal, own, residuals, decoded, target, noises, rounds ? own / PARTS : 0];
    yield* blockSteps(first, end, (from, to) => kernels.call(`predict_${predictor}`, ...coding, from, to, ...last));
  }
  kernels.free(...inputs.filter((array) => !causal.includes(array)), ...stream.arrays, ...state, target, noises);
  return decoded;
}

/** Whether the stream of bytes of vectors says how noisy their components are. Mirrors `stream_flags`. */
export function findsNoises(data, name) {
  const cursor = new Cursor(data, name);
  cursor.block();
  return (flagsOf(cursor.rest()) & FINDS_NOISES) !== 0;
}

/** Flags of a stream on a trellis, or null. */
function flagsOf(stream) {
  return stream[0] <= MOST_FLAGS ? stream[0] : null;
}

/** Begin and end of the first blocks, and the begin of the block before. */
function runs(bounds, wanted) {
  return Array.from({ length: wanted }, (_, b) => [bounds[b], bounds[b + 1], bounds[Math.max(0, b - 1)]]);
}

/** Steps of blocks. Mirrors `gvpipe.trajectory.trellis.block_steps`. */
function stepsOf(step, blocks, flags) {
  const steps = new Array(blocks).fill(step);
  for (let b = blocks - 1, grade = 1; flags & GRADES && b >= 0; b--, grade = Math.max(LEAST_GRADE, FALL * grade)) steps[b] = step * grade;
  return steps;
}

/** Variances of what weights do not explain, from the residuals of the block before. Mirrors `gvpipe.trajectory.trellis.find_noises`. */
function noisesOf(kernels, residuals, [before, first], step, flags, known) {
  const components = residuals.shape[1];
  const noises = new Float64Array(known + components).fill(step * step);
  if (!(flags & FINDS_NOISES) || before === first) return noises;
  const words = kernels.words(residuals); // little-endian halves of int64
  const sums = new Float64Array(components);
  for (let i = 2 * before * components, c = 0; i < 2 * first * components; i += 2, c = (c + 1) % components)
    sums[c] += Math.abs(words[i + 1] * 2 ** 32 + (words[i] >>> 0));
  for (let c = 0; c < components; c++) {
    const mean = sums[c] / (first - before) / 4;
    noises[known + c] *= 1 + mean * mean;
  }
  return noises;
}

/**
 * Call a kernel for some ranks of n at a time. Browsers compile it well while it runs, and take that for the next call.
 *
 * @param {number} n @param {(first: number, end: number) => unknown} call false ends it @returns {boolean}
 */
export function inBlocks(n, call) {
  return finish(blockSteps(0, n, call));
}

/** `inBlocks` in steps. @yields after a call */
function* blockSteps(begin, n, call) {
  let size = LEAST_VECTORS;
  for (let first = begin, end = begin; first < n; first = end) {
    end = Math.min(first + size, n);
    const started = performance.now();
    if (call(first, end) === false) return false;
    if (performance.now() - started < BLOCK_TIME / 2) size *= 2;
    yield;
  }
  return true;
}

/** What steps return, taken one after the other. */
function finish(steps) {
  let step = steps.next();
  while (!step.done) step = steps.next();
  return step.value;
}

/** The members of Python's `ContextInputs`; three are arrays of `causal` themselves. */
function contextInputs(kernels, [order, starts, neighbours, , , ringSizes, blocks], n, usual, wanted, powers) {
  const ranks = new Int32Array(n).fill(order.shape[0]); // given vectors: behind all blocks
  kernels.view(order).forEach((vector, rank) => (ranks[vector] = rank));
  return [
    kernels.array("int32", [wanted + 1], kernels.view(blocks).slice(0, wanted + 1)),
    kernels.array("int32", [n], ranks),
    starts,
    neighbours,
    ringSizes,
    kernels.array("int64", [usual.length], usual),
    kernels.array("int64", [tables.roots.length], tables.roots),
    kernels.array("int64", [MOST_LOGS], tables.logs),
    kernels.whole(powers),
  ];
}

/** Mirrors the tables of `gvpipe.trajectory.contexts`. */
function makeTables() {
  const roots = BigInt64Array.from(powersOfTwo());
  const logs = new BigInt64Array(MOST_LOGS);
  for (let value = 0, i = 0; value < MOST_LOGS; value++) {
    while (roots[i + 1] <= BigInt(64 * value + 1)) i++;
    logs[value] = BigInt(i - 6 * PER_OCTAVE);
  }
  return { roots, logs, levels: Array.from({ length: MAX_LEVEL + 1 }, (_, level) => roots[4 * level]) };
}
