/** Which cluster each vertex belongs to, as runs along the traversal. Mirrors `gvcodecs.pdct.labels`; `docs/format.md`, section 7. */

import { decodeIntegers } from "../format/integers.js";

/**
 * @param {import("../format/cursor.js").Cursor} cursor over the block
 * @param {number} n vertices @param {number} nClusters
 * @returns {Int32Array} (n) clusters, in the order of the traversal
 */
export function decodeLabels(cursor, n, nClusters) {
  const labels = new Int32Array(n);
  if (nClusters === 1) {
    cursor.end();
    return labels;
  }
  const runs = cursor.varint(n, "the number of runs");
  const lengths = decodeIntegers(cursor.block(), runs, null, cursor.name);
  const differences = decodeIntegers(cursor.rest(), runs, null, cursor.name);
  let [start, cluster] = [0, 0];
  for (let i = 0; i < runs; i++) {
    const end = start + lengths[i] + 1;
    cluster += differences[i];
    if (lengths[i] < 0 || end > n) throw cursor.corrupt("the runs of clusters do not cover the vertices");
    if (cluster < 0 || cluster >= nClusters) throw cursor.corrupt("a cluster does not exist");
    labels.fill(cluster, start, end);
    start = end;
  }
  if (start < n) throw cursor.corrupt("the runs of clusters do not cover the vertices");
  return labels;
}
