/** Points that never move. Mirrors `gvcodecs.pdct.still_points`; `docs/format.md`, section 7.2. */

import {
  PDCT_STILL_POINTS_SECTION as SECTION,
  SEGMENTS_LARGEST_STEP as LARGEST_STEP,
  SEGMENTS_SMALLEST_STEP as SMALLEST_STEP,
} from "../constants.js";
import { Cursor } from "../format/cursor.js";
import { decodeIntegers } from "../format/integers.js";
import { decodeFlags } from "../format/still_vertices.js";

export { SECTION };

/**
 * @param {Uint8Array} data @param {Float64Array} base (P, 3) base frame of the points, along the traversal, model units, flat
 * @returns {{points: Int32Array, positions: Float32Array}} those that stand still (S), ascending, and where (S, 3), flat
 */
export function decodeStill(data, base) {
  const cursor = new Cursor(data, SECTION);
  const step = cursor.f64();
  if (!(step >= SMALLEST_STEP && step <= LARGEST_STEP)) throw cursor.corrupt(`its step is ${step}`);
  const flags = decodeFlags(cursor.block(), base.length / 3, SECTION);
  const points = Int32Array.from(flags.keys()).filter((point) => flags[point]);
  const off = decodeIntegers(cursor.rest(), 3 * points.length, null, SECTION);
  const positions = new Float32Array(3 * points.length);
  points.forEach((point, i) => {
    for (let axis = 0; axis < 3; axis++) positions[3 * i + axis] = base[3 * point + axis] + step * off[axis * points.length + i];
  });
  if (!positions.every(Number.isFinite)) throw cursor.corrupt("a position is larger than float32 can hold");
  return { points, positions };
}
