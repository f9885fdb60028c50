/**
 * The user's vertex order by adaptive contexts: its ranks, or which candidates its vertices are. Mirrors
 * `gvpipe.connectivity.adaptive_order` and `candidate_order`; `docs/format.md`, section 5.9.
 */

import {
  ADAPTIVE_ORDER_MAX_VERTICES as MAX_VERTICES,
  CANDIDATE_KERNELS_N_CONTEXTS as CHOICE_CONTEXTS,
  CANDIDATE_KERNELS_N_GROUPS as CHOICE_GROUPS,
  CANDIDATE_KERNELS_NUMBER_CONTEXTS as NUMBER_CONTEXTS,
  CANDIDATE_KERNELS_NUMBER_GROUPS as NUMBER_GROUPS,
  CANDIDATE_ORDER_MAX_VERTICES as MOST_OF_CANDIDATES,
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
  if (visits.length > MAX_VERTICES) throw corrupt("order", `${visits.length} vertices, at most ${MAX_VERTICES}`);
  const own = kernels.fresh();
  decodeBy(own, "code_visits", data, lattice, faces, newNumberMixing(own, N_CONTEXTS, N_GROUPS), visits);
}

/** The same where `data`, behind its mark, chooses among candidates. */
export function decodeCandidateOrder(kernels, data, lattice, faces, visits) {
  if (visits.length > MOST_OF_CANDIDATES) throw corrupt("order", `${visits.length} vertices, at most ${MOST_OF_CANDIDATES}`);
  const own = kernels.fresh();
  const learnt = [...newNumberMixing(own, CHOICE_CONTEXTS, CHOICE_GROUPS), ...newNumberMixing(own, NUMBER_CONTEXTS, NUMBER_GROUPS)];
  decodeBy(own, "code_by_candidates", data.subarray(1), lattice, faces, learnt, visits);
}

function decodeBy(own, kernel, data, lattice, faces, learnt, visits) {
  const stream = new DecisionStream(own, data);
  const lists = findNeighbours(own, lattice, faces);
  const points = own.whole(lattice.filter((_, i) => i % 3 === 0));
  const found = own.array("int64", [visits.length]);
  const [fits] = own.call(kernel, ...lists, points, REACH, ...learnt, ...stream.arrays, true, found);
  if (!fits || !stream.isAtEnd) throw corrupt("order", "its decisions name no vertex order");
  const words = own.words(found);
  for (let v = 0; v < visits.length; v++) visits[v] = words[2 * v];
}
