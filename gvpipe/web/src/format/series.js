/** Series of integers over the frames: differences in time, range coded. Mirrors `gvpipe.entropy.series`; `docs/format.md`, section 5. */

import { SERIES_FIRST_CLASS as FIRST_CLASS, SERIES_MAX_CLASS as MAX_CLASS } from "../constants.js";
import { decodeIntegers } from "./integers.js";

/**
 * @param {import("./cursor.js").Cursor} cursor read to its end
 * @param {number} frames n @param {number} count m, how many series
 * @param {number[]} orders of differences that may be, ascending
 * @param {boolean} firstApart whether frame 0 has a context of its own
 * @returns {Float64Array} (n, m) flat
 */
export function decodeSeries(cursor, frames, count, orders, firstApart = false) {
  const head = cursor.take(count);
  if (head.some((byte) => !orders.includes(byte >> 6))) {
    throw cursor.corrupt(`a difference order is not among ${orders.join(", ")}`);
  }
  const contexts = new Uint8Array(frames * count);
  for (let i = 0; i < contexts.length; i++) contexts[i] = head[i % count] & MAX_CLASS;
  if (firstApart) contexts.fill(FIRST_CLASS, 0, count);
  const values = decodeIntegers(cursor.rest(), frames * count, contexts, cursor.name);
  for (let j = 0; j < count; j++) {
    for (let order = head[j] >> 6; order > 0; order--) {
      for (let i = j + count; i < values.length; i += count) values[i] += values[i - count];
    }
  }
  return values;
}
