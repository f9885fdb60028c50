/**
 * The user's vertex order, its ranks by adaptive contexts. Mirrors `gvpipe.connectivity.adaptive_order` and `order_kernels`;
 * `docs/format.md`, section 5.9.
 */

import {
  ADAPTIVE_ORDER_MAX_VERTICES as MAX_VERTICES,
  ORDER_KERNELS_LONG_RUN as LONG_RUN,
  ORDER_KERNELS_LOOKED_AT as LOOKED_AT,
  ORDER_KERNELS_MATCHED as MATCHED,
  ORDER_KERNELS_MATCH_BITS as MATCH_BITS,
  ORDER_KERNELS_MAX_RUN as MAX_RUN,
  ORDER_KERNELS_N_CONTEXTS as N_CONTEXTS,
  ORDER_KERNELS_N_GROUPS as N_GROUPS,
  VERTEX_ORDER_REACH as REACH,
} from "../constants.js";
import { NumberDecoder, mixHash } from "./decisions.js";
import { corrupt } from "./errors.js";
import { Search, findNeighbours } from "./vertex_order.js";

/**
 * @param {Uint8Array} data section `order`
 * @param {Int32Array} lattice (V, 3) (point, 0, 0) of each vertex, flat
 * @param {Uint32Array} faces (T, 3) codec's order
 * @param {Int32Array} visits (V) filled: the codec's vertex of each of the user's
 */
export function decodeAdaptiveOrder(data, lattice, faces, visits) {
  const n = visits.length;
  if (n > MAX_VERTICES) throw corrupt("order", `${n} vertices, at most ${MAX_VERTICES}`);
  const lists = findNeighbours(lattice, faces);
  const search = new Search(lists, visits);
  const decoder = new NumberDecoder(data, N_CONTEXTS, N_GROUPS);
  const around = new Int32Array(n); // visited neighbours of each vertex
  const numbers = new Int32Array(n + MATCHED); // behind zeros
  const latest = new Int32Array(2 ** MATCH_BITS).fill(-1);
  const contexts = new Float64Array(N_CONTEXTS);
  for (let v = 0, match = -1, run = 0; v < n; v++) {
    const row = v + MATCHED;
    findContexts({ lists, lattice, visits, visited: search.visited, around }, v, contexts);
    addHistory(numbers, row, contexts);
    contexts[6] = mixHash(match >= 0 ? numbers[match] : -1, run);
    const number = decoder.number(contexts, match < 0 ? 0 : run < LONG_RUN ? 1 : 2, false);
    if (!(number <= REACH)) throw corrupt("order", "its decisions name no vertex order");
    const target = number === 0 ? search.left[decoder.index(n - v)] : search.find(v, number - 1);
    if (target < 0) throw corrupt("order", `no vertex has the rank sent for vertex ${v}`);
    search.visit(v, target);
    for (let k = lists.starts[target]; k < lists.starts[target + 1]; k++) around[lists.neighbours[k]]++;
    numbers[row] = number;
    if (match >= 0 && numbers[match] === number) [match, run] = [match + 1, Math.min(run + 1, MAX_RUN)];
    else [match, run] = [-1, 0];
    let key = 0;
    for (let k = 0; k < MATCHED; k++) key = mixHash(key, numbers[row - k]);
    const place = key >>> (32 - MATCH_BITS);
    if (match < 0 && latest[place] >= 0) match = latest[place] + 1;
    latest[place] = row;
  }
  if (!decoder.isAtEnd) throw corrupt("order", "its decisions name no vertex order");
}

/** The first three contexts of vertex v. */
function findContexts({ lists: { starts, neighbours }, lattice, visits, visited, around }, v, contexts) {
  let [count, shared, crowded, twins] = [0, 0, 0, 0];
  const before = v > 0 ? visits[v - 1] : -1;
  for (let k = v > 0 ? starts[before] : 0; v > 0 && k < starts[before + 1]; k++) {
    const y = neighbours[k];
    if (visited[y]) continue;
    if (count < LOOKED_AT) {
      const last = v > 1 ? visits[v - 2] : -1; // its list, not that of y: hubs would be searched again and again
      const isShared = last >= 0 && neighbours.subarray(starts[last], starts[last + 1]).includes(y);
      shared = 2 * shared + (isShared ? 1 : 0);
      crowded = 4 * crowded + Math.min(around[y], 3);
      twins = 2 * twins + (lattice[3 * y] === lattice[3 * before] ? 1 : 0);
    }
    count = Math.min(count + 1, 8);
  }
  contexts[0] = mixHash(1 + count, shared);
  contexts[1] = mixHash(11 + count, crowded);
  contexts[2] = mixHash(21 + Math.min(count, 3), twins);
}

/** The contexts of numbers before the one at a row. */
function addHistory(numbers, row, contexts) {
  let key = 0;
  for (let k = 1; k <= MATCHED; k++) {
    key = mixHash(key, numbers[row - k]);
    if (k === 1) contexts[2] = mixHash(contexts[2], key);
    else if (k === 2) contexts[3] = key;
    else if (k === 3) contexts[4] = key;
  }
  contexts[5] = key;
}
