/** The clusters that points follow. Mirrors `gvcodecs.mcgv.motion.weight_coding.decode_weights`; `docs/format.md`, section 5. */

import {
  SKINNING_INFLUENCES as INFLUENCES,
  SKINNING_TOTAL as TOTAL,
  WEIGHT_CODING_COUNT_CONTEXTS as COUNT_CONTEXTS,
  WEIGHT_KERNELS_MAX_LISTED as MAX_LISTED,
} from "../constants.js";
import { Cursor } from "../format/cursor.js";
import { decodeIntegers } from "../format/integers.js";

/**
 * @typedef {object} Weights
 * @property {Int32Array} clusters (P, 4) flat, 0..K-1; 0 where unused
 * @property {Int32Array} weights (P, 4) flat, in 1 / TOTAL, used ones first; each row's sum is TOTAL
 *
 * @param {import("../wasm/kernels.js").Kernels} kernels @param {Uint8Array} data section `weights`
 * @param {{starts: Int32Array, neighbours: Int32Array}} causal of the points
 * @param {number} nClusters K
 * @returns {Weights}
 */
export function decodeWeights(kernels, data, causal, nClusters) {
  const cursor = new Cursor(data, "weights");
  const n = causal.starts.length - 1;
  const context = (p) => Math.min(causal.starts[p + 1] - causal.starts[p], COUNT_CONTEXTS - 1);
  const contexts = Uint8Array.from({ length: n }, (_, p) => context(p));
  const counts = decodeIntegers(cursor.take(cursor.varint(cursor.left, "a length")), n, contexts, "weights");
  if (counts.some((count) => count < 0 || count > INFLUENCES)) throw cursor.corrupt("a point follows more than four clusters");
  const ranked = slots(counts, 0);
  const gaps = decodeIntegers(cursor.take(cursor.varint(cursor.left, "a length")), ranked.length, ranked, "weights");
  const weighted = slots(counts, 1);
  const changes = decodeIntegers(cursor.rest(), weighted.length, weighted, "weights");
  if (gaps.some((gap) => gap < 0 || gap >= nClusters) || changes.some((change) => Math.abs(change) >= TOTAL)) {
    throw cursor.corrupt("a rank or a weight is out of range");
  }
  const own = kernels.fresh();
  const numbers = [causal.starts, causal.neighbours, counts, gaps, changes].map((values) => own.whole(values));
  const listed = [MAX_LISTED, MAX_LISTED, INFLUENCES].map((size) => own.array("int64", [size]));
  const weights = [0, 1].map(() => own.array("int32", [n, INFLUENCES]));
  const [wrong] = own.call("fill_weights", ...numbers.slice(0, 2), nClusters, ...numbers.slice(2), ...listed, ...weights);
  if (wrong >= 0) throw cursor.corrupt(`the weights of point ${wrong} make no sense`);
  const [clusters, parts] = weights.map((array) => own.view(array).slice());
  return { clusters, weights: parts };
}

/** Places of the points' own clusters, one point after the other, less the `last` ones of each. */
function slots(counts, last) {
  const places = [];
  for (const count of counts) for (let place = 0; place < count - last; place++) places.push(place);
  return Uint8Array.from(places);
}
