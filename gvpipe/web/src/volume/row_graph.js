/**
 * In which order rows inside of a volume are coded, and which rows predict each: waves of rows leave a graph. Mirrors
 * `gvpipe.fields.graph`.
 */

import {
  GRAPH_FAR_VARIANCE as FAR_VARIANCE,
  GRAPH_LEAST as LEAST,
  GRAPH_MOST_BEYOND as MOST_BEYOND,
  GRAPH_MOST_RING as MOST_RING,
  GRAPH_MOST_WAVES as MOST_WAVES,
  GRAPH_RING_VARIANCE as RING_VARIANCE,
  GRAPH_SURE as SURE,
} from "../constants.js";

const SCATTER = 0x9e3779b97f4a7c15n; // an odd multiplier

/**
 * A symmetric graph: neighbours of row r are `others[starts[r]]` to `others[starts[r + 1] - 1]`, rising, `strengths` beside them.
 * @typedef {{starts: Int32Array, others: Int32Array, strengths: Int32Array}} Graph
 *
 * Rows (n) that leave together, by their names: row after row its neighbours, `rings` of them next to it, `sizes` in all.
 * @typedef {{rows: number[], rings: number[], sizes: number[], neighbours: number[]}} Wave
 */

/**
 * @param {ArrayLike<number>} edges (2E) pairs of rows, in any order; pairs of a row with itself do not count @param {number} count R
 * @returns {import("../trajectory/causal_order.js").CausalOrder}
 */
export function graphOrder(edges, count) {
  let graph = firstGraph(edges, count);
  let names = Int32Array.from({ length: count }, (_, row) => row);
  const shuffled = Float64Array.from(names, (name) => Number(BigInt.asUintN(64, BigInt(name) * SCATTER) >> 20n));
  const waves = [];
  while (graph.others.length && waves.length < MOST_WAVES) {
    const leaves = leavingRows(graph, names, shuffled);
    const numbers = new Int32Array(names.length).fill(-1); // of the rows that stay
    let left = 0;
    for (let row = 0; row < names.length; row++) if (!leaves[row]) numbers[row] = left++;
    const smaller = merged(graph, leaves, numbers, left);
    const stayed = names.filter((_, row) => !leaves[row]);
    waves.push(taken({ graph, names, leaves, numbers }, smaller, stayed));
    [graph, names] = [smaller, stayed];
  }
  waves.push(coarsest(graph, names));
  return joined(waves.reverse(), count);
}

/** @param {Wave[]} waves the coarsest first @param {number} count R */
function joined(waves, count) {
  const order = Int32Array.from(waves.flatMap(({ rows }) => rows));
  const ringSizes = Int32Array.from(waves.flatMap(({ rings }) => rings));
  const sizes = waves.flatMap((wave) => wave.sizes);
  const neighbours = Int32Array.from(waves.flatMap((wave) => wave.neighbours));
  const starts = new Int32Array(count + 1);
  const [weights, variances] = [new Float64Array(neighbours.length), new Float64Array(neighbours.length)];
  for (let i = 0; i < count; i++) {
    const doubt = Math.min(1, Math.max(LEAST, i / SURE));
    starts[i + 1] = starts[i] + sizes[i];
    for (let k = 0; k < sizes[i]; k++) {
      const isNear = k < ringSizes[i];
      weights[starts[i] + k] = isNear ? 1 / ringSizes[i] : 0;
      variances[starts[i] + k] = (isNear ? RING_VARIANCE : FAR_VARIANCE) * doubt;
    }
  }
  return { order, starts, neighbours, weights, variances, ringSizes, blocks: [0, count], affine: true };
}

/** @returns {Graph} each pair once, of strength 1 */
function firstGraph(edges, count) {
  const [from, to] = [new Int32Array(edges.length), new Int32Array(edges.length)];
  let n = 0;
  for (let e = 0; e < edges.length; e += 2) {
    const [a, b] = [edges[e], edges[e + 1]];
    if (a === b) continue;
    [from[n], to[n], from[n + 1], to[n + 1]] = [a, b, b, a];
    n += 2;
  }
  const graph = gathered(from.subarray(0, n), to.subarray(0, n), new Int32Array(n).fill(1), count);
  graph.strengths.fill(1);
  return graph;
}

/** The graph of links, which are there in both directions; strengths of equal ones add up. @returns {Graph} */
function gathered(from, to, strengths, count) {
  const bounds = boundsOf(from, count);
  const byRow = new Int32Array(from.length);
  const next = bounds.slice();
  for (let i = 0; i < from.length; i++) byRow[next[from[i]]++] = i;
  const [others, found] = [new Int32Array(from.length), new Int32Array(from.length)];
  next.set(bounds);
  for (let row = 0; row < count; row++) {
    for (let i = bounds[row]; i < bounds[row + 1]; i++) { // what is there in both directions comes rising
      const at = next[to[byRow[i]]]++;
      others[at] = row;
      found[at] = strengths[byRow[i]];
    }
  }
  const starts = new Int32Array(count + 1);
  let end = 0;
  for (let row = 0; row < count; row++) {
    const first = end;
    for (let i = bounds[row]; i < bounds[row + 1]; i++) {
      if (end > first && others[end - 1] === others[i]) found[end - 1] += found[i];
      else [others[end], found[end++]] = [others[i], found[i]];
    }
    starts[row + 1] = end;
  }
  return { starts, others: others.slice(0, end), strengths: found.slice(0, end) };
}

/** (count + 1) where the entries of each row start, once they are sorted by it. */
function boundsOf(rows, count) {
  const bounds = new Int32Array(count + 1);
  for (const row of rows) bounds[row + 1]++;
  for (let row = 0; row < count; row++) bounds[row + 1] += bounds[row];
  return bounds;
}

/** (n) 1 for rows of which no two are neighbours; at least one where there is an edge. */
function leavingRows({ starts, others }, names, shuffled) {
  const degree = (row) => starts[row + 1] - starts[row];
  const isBefore = (a, b) =>
    degree(a) - degree(b) || shuffled[names[a]] - shuffled[names[b]] || a - b;
  const comesFirst = (row, counts) => {
    for (let i = starts[row]; i < starts[row + 1]; i++) if (counts(others[i]) && isBefore(row, others[i]) > 0) return false;
    return true;
  };
  const [leaves, isBlocked] = [new Uint8Array(names.length), new Uint8Array(names.length)];
  for (let row = 0; row < names.length; row++) {
    if (!degree(row) || !comesFirst(row, () => true)) continue;
    leaves[row] = 1;
    for (let i = starts[row]; i < starts[row + 1]; i++) isBlocked[others[i]] = 1;
  }
  const isFree = Uint8Array.from(leaves, (has, row) => (degree(row) && !has && !isBlocked[row] ? 1 : 0));
  for (let row = 0; row < names.length; row++) if (isFree[row] && comesFirst(row, (other) => isFree[other])) leaves[row] = 1;
  return leaves;
}

/** The graph without the rows that leave, each merged into its strongest neighbour. @returns {Graph} */
function merged({ starts, others, strengths }, leaves, numbers, left) {
  const into = Int32Array.from(numbers);
  for (let row = 0; row < leaves.length; row++) {
    if (!leaves[row]) continue;
    let best = starts[row];
    for (let i = best + 1; i < starts[row + 1]; i++) {
      const [a, b] = [others[i], others[best]];
      const fewer = starts[a + 1] - starts[a] - (starts[b + 1] - starts[b]);
      if ((strengths[best] - strengths[i] || fewer || a - b) < 0) best = i;
    }
    into[row] = numbers[others[best]];
  }
  const [from, to, given] = [new Int32Array(others.length), new Int32Array(others.length), new Int32Array(others.length)];
  let n = 0;
  for (let row = 0; row < leaves.length; row++) {
    for (let i = starts[row]; i < starts[row + 1]; i++) {
      const [a, b] = [into[row], into[others[i]]];
      if (a === b) continue;
      from[n] = a;
      to[n] = b;
      given[n++] = strengths[i];
    }
  }
  return gathered(from.subarray(0, n), to.subarray(0, n), given.subarray(0, n), left);
}

/** The rows that leave, their strongest neighbours, and the strongest neighbours of these once they have left. @returns {Wave} */
function taken({ graph, names, leaves, numbers }, smaller, stayed) {
  const wave = { rows: [], rings: [], sizes: [], neighbours: [] };
  const sums = new Float64Array(stayed.length);
  for (let row = 0; row < leaves.length; row++) {
    if (!leaves[row]) continue;
    const place = (i) => ({ at: graph.others[i], strength: graph.strengths[i] });
    const near = strongest(range(graph.starts[row], graph.starts[row + 1]).map(place), MOST_RING);
    const ring = near.map(({ at }) => numbers[at]);
    const touched = [];
    for (const each of ring) {
      for (let i = smaller.starts[each]; i < smaller.starts[each + 1]; i++) {
        const other = smaller.others[i];
        if (!sums[other]) touched.push(other);
        sums[other] += smaller.strengths[i];
      }
    }
    for (const each of ring) sums[each] = 0;
    const wide = touched.filter((other) => sums[other]).map((at) => ({ at, strength: sums[at] }));
    for (const other of touched) sums[other] = 0;
    const far = strongest(wide, MOST_BEYOND);
    wave.rows.push(names[row]);
    wave.rings.push(near.length);
    wave.sizes.push(near.length + far.length);
    wave.neighbours.push(...near.map(({ at }) => names[at]), ...far.map(({ at }) => stayed[at]));
  }
  return wave;
}

function range(start, stop) {
  return Array.from({ length: stop - start }, (_, i) => start + i);
}

function strongest(entries, most) {
  return entries.sort((a, b) => b.strength - a.strength || a.at - b.at).slice(0, most);
}

/** What is left, in order: each with its neighbours before it, else the row before it. @returns {Wave} */
function coarsest({ starts, others }, names) {
  const wave = { rows: [...names], rings: [], sizes: [], neighbours: [] };
  for (let row = 0; row < names.length; row++) {
    const before = [...others.subarray(starts[row], starts[row + 1])].filter((other) => other < row).slice(0, MOST_RING);
    if (!before.length && row) before.push(row - 1);
    wave.rings.push(before.length);
    wave.sizes.push(before.length);
    for (const other of before) wave.neighbours.push(names[other]);
  }
  return wave;
}
