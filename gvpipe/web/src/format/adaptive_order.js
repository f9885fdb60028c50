/**
 * The user's vertex order, its ranks by adaptive contexts. Mirrors `gvpipe.connectivity.adaptive_order`; `docs/format.md`, section 5.9.
 */

import {
  ADAPTIVE_ORDER_MAX_VERTICES as MAX_VERTICES,
  ORDER_KERNELS_N_CONTEXTS as N_CONTEXTS,
  ORDER_KERNELS_N_GROUPS as N_GROUPS,
  VERTEX_ORDER_REACH as REACH,
} from "../constants.js";
import { DecisionStream, newNumberMixing } from "./decisions.js";
import { corrupt } from "./errors.js";
import { findNeighbours } from "./vertex_order.js";

/**
 * @param {import("../wasm/kernels.js").Kernels} kernels
 * @param {Uint8Array} data section `order`
 * @param {Int32Array} lattice (V, 3) (point, 0, 0) of each vertex, flat
 * @param {Uint32Array} faces (T, 3) codec's order
 * @param {Int32Array} visits (V) filled: the codec's vertex of each of the user's
 */
export function decodeAdaptiveOrder(kernels, data, lattice, faces, visits) {
  const n = visits.length;
  if (n > MAX_VERTICES) throw corrupt("order", `${n} vertices, at most ${MAX_VERTICES}`);
  const own = kernels.fresh();
  const stream = new DecisionStream(own, data);
  const lists = findNeighbours(own, lattice, faces);
  const points = own.whole(lattice.filter((_, i) => i % 3 === 0));
  const found = own.array("int64", [n]);
  const [fits] = own.call("code_visits", ...lists, points, REACH, ...newNumberMixing(own, N_CONTEXTS, N_GROUPS), ...stream.arrays, true, found);
  if (!fits || !stream.isAtEnd) throw corrupt("order", "its decisions name no vertex order");
  const words = own.words(found);
  for (let v = 0; v < n; v++) visits[v] = words[2 * v];
}
