/** The causal neighbours of a blend's rows. Mirrors `gvcodecs.mcgv.motion.row_neighbours`; `docs/format.md`, section 5.2. */

import { ROW_NEIGHBOURS_MOST as MOST, ROW_NEIGHBOURS_VARIANCE as VARIANCE, SKINNING_INFLUENCES as INFLUENCES } from "../constants.js";
import { independentOrder } from "../trajectory/causal_order.js";

/**
 * @param {import("./skinning.js").Blend} blend @param {number} nClusters K
 * @returns {import("../trajectory/causal_order.js").CausalOrder} of 4 K rows; row 4 k + i is row i of cluster k
 */
export function rowOrder({ clusters, parts }, nClusters) {
  const shared = countShared(clusters, parts, nClusters);
  const neighbours = [];
  const starts = [0];
  for (let k = 0; k < nClusters; k++) {
    const before = shared.subarray(nClusters * k, nClusters * k + k);
    const near = [...before.keys()].filter((j) => before[j] > 0);
    near.sort((a, b) => before[b] - before[a] || a - b);
    near.length = Math.min(near.length, MOST);
    for (let i = 0; i < 4; i++) {
      for (const j of near) neighbours.push(4 * j + i);
      for (let j = 0; j < i; j++) neighbours.push(4 * k + j);
      starts.push(neighbours.length);
    }
  }
  const weights = new Float64Array(neighbours.length);
  return { ...independentOrder(4 * nClusters), starts, neighbours, weights, variances: weights.map(() => VARIANCE) };
}

/** (K, K), flat: how many points follow both clusters. */
function countShared(clusters, parts, nClusters) {
  const shared = new Int32Array(nClusters * nClusters);
  for (let first = 0; first < parts.length; first += INFLUENCES) {
    for (let a = first; a < first + INFLUENCES; a++) {
      for (let b = first; b < a; b++) {
        if (parts[a] > 0 && parts[b] > 0) {
          shared[nClusters * clusters[a] + clusters[b]]++;
          shared[nClusters * clusters[b] + clusters[a]]++;
        }
      }
    }
  }
  return shared;
}
