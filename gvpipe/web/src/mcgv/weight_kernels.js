/**
 * What points' weights are predicted from. Mirrors `gvcodecs.mcgv.motion.weight_kernels`.
 *
 * A point's list holds the clusters that its causal neighbours follow, heaviest first, equal ones by number.
 */

import {
  SKINNING_INFLUENCES as INFLUENCES,
  SKINNING_TOTAL as TOTAL,
  WEIGHT_KERNELS_MAX_NEIGHBOURS as MAX_NEAR,
} from "../constants.js";

export { INFLUENCES, TOTAL };

/**
 * Fill `weights` from the numbers of the section, points in order.
 *
 * @param {{starts: Int32Array, neighbours: Int32Array}} causal
 * @param {number} nClusters K
 * @param {{counts: Float64Array, gaps: Float64Array, changes: Float64Array}} coded
 * @param {import("./weight_coding.js").Weights} result filled
 * @returns {number} the first point that makes no sense, or -1
 */
export function restore(causal, nClusters, { counts, gaps, changes }, result) {
  const { clusters, weights } = result;
  const listed = new Int32Array(INFLUENCES * MAX_NEAR);
  const sums = new Int32Array(INFLUENCES * MAX_NEAR);
  const ranks = new Int32Array(INFLUENCES);
  let [nextGap, nextChange] = [0, 0];
  for (let point = 0; point < counts.length; point++) {
    const nListed = listClusters(point, causal, result, listed, sums);
    const n = counts[point];
    const at = INFLUENCES * point;
    if (n === 0) {
      if (nListed === 0) return point;
      follow(listed, sums, nListed, clusters, weights, at);
      continue;
    }
    for (let j = 0, rank = -1; j < n; j++) {
      rank += 1 + gaps[nextGap++];
      if (rank >= nClusters) return point;
      ranks[j] = rank;
      clusters[at + j] = clusterOf(rank, listed, nListed);
    }
    const total = sumOf(ranks, n, sums, nListed);
    let left = TOTAL;
    for (let j = 0; j < n - 1; j++) {
      const share = (TOTAL * sumAt(ranks[j], sums, nListed)) / total;
      const expected = total ? Math.max(1, Math.floor(share)) : Math.floor(TOTAL / n);
      const weight = expected + changes[nextChange++];
      left -= weight;
      if (weight < 1 || left < 1) return point;
      weights[at + j] = weight;
    }
    weights[at + n - 1] = left;
  }
  return -1;
}

/** Fill `listed` and `sums` with a point's list; return its length. */
function listClusters(point, { starts, neighbours }, { clusters, weights }, listed, sums) {
  let n = 0;
  for (let entry = Math.max(starts[point], starts[point + 1] - MAX_NEAR); entry < starts[point + 1]; entry++) {
    const at = INFLUENCES * neighbours[entry];
    for (let j = at; j < at + INFLUENCES && weights[j]; j++) {
      let place = 0;
      while (place < n && listed[place] !== clusters[j]) place++;
      if (place === n) {
        listed[n] = clusters[j];
        sums[n++] = 0;
      }
      sums[place] += weights[j];
    }
  }
  for (let i = 1; i < n; i++) {
    const [cluster, sum] = [listed[i], sums[i]];
    let place = i;
    for (; place > 0; place--) {
      const before = place - 1;
      if (sums[before] > sum || (sums[before] === sum && listed[before] < cluster)) break;
      listed[place] = listed[before];
      sums[place] = sums[before];
    }
    listed[place] = cluster;
    sums[place] = sum;
  }
  return n;
}

/** What the list suggests: its first four clusters in proportion to their sums, what is left to the first. */
function follow(listed, sums, nListed, clusters, weights, at) {
  const n = Math.min(nListed, INFLUENCES);
  let total = 0;
  for (let j = 0; j < n; j++) total += sums[j];
  let left = TOTAL;
  for (let j = n - 1; j > 0; j--) {
    const share = Math.floor((TOTAL * sums[j]) / total);
    left -= share;
    if (!share) continue; // the list descends: those that get nothing come last
    clusters[at + j] = listed[j];
    weights[at + j] = share;
  }
  clusters[at] = listed[0];
  weights[at] = left;
}

/** The cluster of a rank: its place in the list; clusters that are not listed follow by number. */
function clusterOf(rank, listed, nListed) {
  if (rank < nListed) return listed[rank];
  for (let cluster = rank - nListed; ; ) {
    let below = 0;
    for (let place = 0; place < nListed; place++) below += listed[place] <= cluster;
    if (rank - nListed + below === cluster) return cluster;
    cluster = rank - nListed + below;
  }
}

function sumAt(rank, sums, nListed) {
  return rank < nListed ? sums[rank] : 0;
}

function sumOf(ranks, n, sums, nListed) {
  let total = 0;
  for (let j = 0; j < n; j++) total += sumAt(ranks[j], sums, nListed);
  return total;
}
