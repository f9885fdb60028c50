/** The seed triangles' vertices over a clip. Mirrors `gvcodecs.pdct.seed_coding`; `docs/format.md`, section 7. */

import { PDCT_SEED_CODING_MAX_COORDINATE as MAX_COORDINATE, PDCT_SEED_CODING_ORDERS as ORDERS } from "../constants.js";
import { decodeSeries } from "../format/series.js";

/**
 * @param {import("../format/cursor.js").Cursor} cursor over the block @param {number} frames n
 * @param {Float64Array} base (K, 3, 3) seed triangles in the base frame, lattice steps, flat
 * @returns {Int32Array} (n, K, 3, 3) lattice steps, flat
 */
export function decodeSeeds(cursor, frames, base) {
  const values = decodeSeries(cursor, frames, base.length, ORDERS, true);
  const points = new Int32Array(values.length);
  for (let i = 0; i < values.length; i++) {
    const [at, corner] = [i % base.length, i % 9];
    const back = corner < 6 ? 3 : 6; // to the triangle's first vertex
    values[i] += corner < 3 ? base[at] : base[at] - base[at - back] + values[i - back]; // an edge, but for the first vertex
    if (!(Math.abs(values[i]) <= MAX_COORDINATE)) throw cursor.corrupt("a seed vertex lies out of range");
    points[i] = values[i];
  }
  return points;
}
