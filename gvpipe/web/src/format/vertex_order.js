/**
 * The user's vertex order: a walk in which each vertex is known by its rank in a breadth-first search from the one before.
 * Mirrors `gvpipe.connectivity.vertex_order.decode_order`; `docs/format.md`, section 4.
 */

import {
  VERTEX_ORDER_ESCAPE as ESCAPE,
  VERTEX_ORDER_EXACT_RANKS as EXACT_RANKS,
  VERTEX_ORDER_N_SYMBOLS as N_SYMBOLS,
  VERTEX_ORDER_REACH as REACH,
} from "../constants.js";
import { Cursor } from "./cursor.js";
import { previousEqual } from "./points.js";
import { RangeDecoder, categoricalEdges } from "./range_decoder.js";

/**
 * @param {Uint8Array} data section `order`, not empty
 * @param {Int32Array} points (V, 3) lattice units, codec's order
 * @param {Uint32Array} faces (T, 3) codec's order
 * @param {Int32Array} visits (V) filled: the codec's vertex of each of the user's
 */
export function decodeOrder(data, points, faces, visits) {
  const cursor = new Cursor(data, "order");
  const weights = Array.from(cursor.take(N_SYMBOLS), (c) => (c < 8 ? c : (8 + (c % 8)) * 2 ** ((c >> 3) - 1)));
  if (cursor.left % 4 || (visits.length && !weights.some((weight) => weight > 0))) throw cursor.corrupt("not a vertex order");
  const decoder = new RangeDecoder(cursor.words(cursor.left / 4), "order");
  const { ranks, jumps } = decodeRanks(decoder, weights, visits.length);
  if (!decoder.exhausted) throw cursor.corrupt("bytes left over");
  const done = walk(findNeighbours(points, faces), ranks, jumps, visits);
  if (done < visits.length) throw cursor.corrupt(`no vertex has the rank sent for vertex ${done}`);
}

/** Ranks (-1: not found by the search, then the jump counts). */
function decodeRanks(decoder, weights, n) {
  const symbols = n ? decoder.categorical(categoricalEdges(weights), n) : [];
  const ranks = new Int32Array(n);
  const jumps = new Int32Array(n);
  for (let v = 0; v < n; v++) {
    const symbol = symbols[v];
    if (symbol === ESCAPE) {
      ranks[v] = -1;
      jumps[v] = n - v > 1 ? decoder.uniform(n - v) : 0;
    } else if (symbol < EXACT_RANKS) {
      ranks[v] = symbol;
    } else {
      const above = symbol - EXACT_RANKS;
      const width = 2 + (above >> 1);
      ranks[v] = ((2 + (above & 1)) << width) + decoder.uniform(1 << width);
    }
  }
  return { ranks, jumps };
}

/** Neighbours by triangle edges, and by shared positions, of each vertex, nearest first: `starts` (V + 1), `neighbours`. */
export function findNeighbours(points, faces) {
  const n = points.length / 3;
  const twins = previousEqual(points, 3);
  const pairs = [];
  for (let i = 0; i < faces.length; i += 3) {
    pairs.push(faces[i], faces[i + 1], faces[i + 1], faces[i + 2], faces[i + 2], faces[i]);
  }
  twins.forEach((twin, v) => {
    if (twin >= 0) pairs.push(v, twin);
  });
  const starts = new Uint32Array(n + 1);
  for (const v of pairs) starts[v + 1]++;
  for (let v = 0; v < n; v++) starts[v + 1] += starts[v];
  const unsorted = new Uint32Array(pairs.length);
  const filled = starts.slice();
  for (let i = 0; i < pairs.length; i += 2) {
    unsorted[filled[pairs[i]]++] = pairs[i + 1];
    unsorted[filled[pairs[i + 1]]++] = pairs[i];
  }
  return sortNeighbours(points, starts, unsorted);
}

function sortNeighbours(points, starts, unsorted) {
  const n = starts.length - 1;
  const sortedStarts = new Uint32Array(n + 1);
  const neighbours = new Uint32Array(unsorted.length);
  const length = new Float64Array(n);
  let count = 0;
  for (let v = 0; v < n; v++) {
    const row = unsorted.subarray(starts[v], starts[v + 1]);
    for (const w of row) {
      const [x, y, z] = [0, 1, 2].map((axis) => points[3 * v + axis] - points[3 * w + axis]);
      length[w] = x * x + y * y + z * z;
    }
    row.sort((a, b) => length[a] - length[b] || a - b);
    for (let i = 0; i < row.length; i++) if (i === 0 || row[i] !== row[i - 1]) neighbours[count++] = row[i];
    sortedStarts[v + 1] = count;
  }
  return { starts: sortedStarts, neighbours };
}

/** Fill `visits`; returns the vertices done: fewer than V where a rank or a jump points nowhere. */
function walk(lists, ranks, jumps, visits) {
  const search = new Search(lists, visits);
  for (let v = 0; v < visits.length; v++) {
    const target = ranks[v] < 0 ? search.left[jumps[v]] : search.find(v, ranks[v]);
    if (target < 0) return v;
    search.visit(v, target);
  }
  return visits.length;
}

/** A breadth-first search from each vertex, over unvisited ones. */
export class Search {
  /** @param {{starts: Uint32Array, neighbours: Uint32Array}} lists @param {Int32Array} visits (V) filled by `visit` */
  constructor(lists, visits) {
    const n = visits.length;
    this.lists = lists;
    this.visits = visits;
    this.visited = new Uint8Array(n);
    this.left = Int32Array.from({ length: n }, (_, v) => v); // not visited, in the order that removals by swapping leave
    this.place = this.left.slice();
    this.seenBy = new Int32Array(n).fill(-1); // the last search that saw a vertex
    this.queue = new Int32Array(Math.min(REACH, n) + 1);
    this.firstLeft = 0;
  }

  /** The vertex of a rank among the unvisited ones that a search from the vertex before v sees; -1: none. */
  find(v, wanted) {
    const { visits, visited, seenBy, queue, firstLeft } = this;
    const { starts, neighbours } = this.lists;
    const n = visits.length;
    let [head, tail, rank, seed] = [0, 0, 0, firstLeft];
    /** Take y into the search; true if it is the one. */
    const see = (y) => {
      if (seenBy[y] === v) return false;
      seenBy[y] = v;
      queue[tail++] = y;
      return !visited[y] && rank++ === wanted;
    };
    if (v > 0) see(visits[v - 1]);
    while (tail < REACH) {
      if (head === tail) {
        // the component is exhausted: go on with the first vertex left in the codec's order
        while (seed < n && seed - firstLeft < REACH && (visited[seed] || seenBy[seed] === v)) seed++;
        if (seed === n || seed - firstLeft >= REACH) return -1;
        if (see(seed)) return seed;
      } else {
        const u = queue[head++];
        for (let k = starts[u]; k < starts[u + 1] && tail < REACH; k++) if (see(neighbours[k])) return neighbours[k];
      }
    }
    return -1;
  }

  /** Note that the user's vertex v is the codec's `target`. */
  visit(v, target) {
    const { visits, visited, left, place } = this;
    const n = visits.length;
    visits[v] = target;
    visited[target] = 1;
    const hole = place[target];
    const last = left[n - 1 - v];
    left[hole] = last;
    place[last] = hole;
    while (this.firstLeft < n && visited[this.firstLeft]) this.firstLeft++;
  }
}
