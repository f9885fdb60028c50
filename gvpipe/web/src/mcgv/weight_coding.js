/** The clusters that points follow. Mirrors `gvcodecs.mcgv.motion.weight_coding.decode_weights`; `docs/format.md`, section 5. */

import { WEIGHT_CODING_COUNT_CONTEXTS as COUNT_CONTEXTS } from "../constants.js";
import { Cursor } from "../format/cursor.js";
import { decodeIntegers } from "../format/integers.js";
import { INFLUENCES, TOTAL, restore } from "./weight_kernels.js";

/**
 * @typedef {object} Weights
 * @property {Uint16Array} clusters (P, 4) flat, 0..K-1; 0 where unused
 * @property {Uint8Array} weights (P, 4) flat, in 1 / TOTAL, used ones first; each row's sum is TOTAL
 *
 * @param {Uint8Array} data section `weights`
 * @param {{starts: Int32Array, neighbours: Int32Array}} causal of the points
 * @param {number} nClusters K
 * @returns {Weights}
 */
export function decodeWeights(data, causal, nClusters) {
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
  const weights = { clusters: new Uint16Array(INFLUENCES * n), weights: new Uint8Array(INFLUENCES * n) };
  const wrong = restore(causal, nClusters, { counts, gaps, changes }, weights);
  if (wrong >= 0) throw cursor.corrupt(`the weights of point ${wrong} make no sense`);
  return weights;
}

/** Places of the points' own clusters, one point after the other, less the `last` ones of each. */
function slots(counts, last) {
  const places = [];
  for (const count of counts) for (let place = 0; place < count - last; place++) places.push(place);
  return Uint8Array.from(places);
}
