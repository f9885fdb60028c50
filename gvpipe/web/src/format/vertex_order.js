/**
 * The user's vertex order: a walk in which each vertex is known by its rank in a breadth-first search from the one before.
 * Mirrors `gvpipe.connectivity.vertex_order.decode_order`; `docs/format.md`, section 4.
 */

import { VERTEX_ORDER_REACH as REACH, VISIT_SYMBOLS_N_SYMBOLS as N_SYMBOLS } from "../constants.js";
import { Cursor } from "./cursor.js";
import { previousEqual } from "./points.js";
import { WordStream, categoricalEdges } from "./word_stream.js";

/**
 * @param {import("../wasm/kernels.js").Kernels} kernels
 * @param {Uint8Array} data section `order`, not empty
 * @param {Int32Array} points (V, 3) lattice units, codec's order
 * @param {Uint32Array} faces (T, 3) codec's order
 * @param {Int32Array} visits (V) filled: the codec's vertex of each of the user's
 */
export function decodeOrder(kernels, data, points, faces, visits) {
  const cursor = new Cursor(data, "order");
  const weights = Array.from(cursor.take(N_SYMBOLS), (c) => (c < 8 ? c : (8 + (c % 8)) * 2 ** ((c >> 3) - 1)));
  if (cursor.left % 4 || (visits.length && !weights.some((weight) => weight > 0))) throw cursor.corrupt("not a vertex order");
  const own = kernels.fresh();
  const stream = new WordStream(own, cursor.words(cursor.left / 4));
  const edges = own.array("uint64", [N_SYMBOLS + 1], BigUint64Array.from(categoricalEdges(weights), BigInt));
  const coded = [0, 1, 2].map(() => own.array("int64", [visits.length]));
  if (!own.call("decode_ranks", ...stream.arrays, edges, ...coded)[0]) throw cursor.corrupt("its range-coded data do not decode");
  if (!stream.isAtEnd) throw cursor.corrupt("bytes left over");
  const [done] = own.call("traverse_visits", ...findNeighbours(own, points, faces), REACH, ...coded, true);
  if (done < visits.length) throw cursor.corrupt(`no vertex has the rank sent for vertex ${done}`);
  const words = own.words(coded[2]);
  for (let v = 0; v < visits.length; v++) visits[v] = words[2 * v];
}

/** Neighbours by triangle edges, and by shared positions, of each vertex, nearest first: the members of Python's `NeighbourLists`. */
export function findNeighbours(kernels, points, faces) {
  const twins = [];
  previousEqual(points, 3).forEach((twin, v) => {
    if (twin >= 0) twins.push(v, twin);
  });
  const rows = (values, width) => kernels.whole(values, [values.length / width, width]);
  return kernels.call("sort_neighbours", rows(points, 3), rows(faces, 3), rows(twins, 2));
}
