/**
 * The clusters' affine transforms of a segment: differences in time, range coded in the context of each series' magnitude.
 * Mirrors `gvcodecs.mcgv.motion.affine_coding`; `docs/format.md`, section 5.
 */

import { SERIES_MAX_CLASS as MAX_CLASS } from "../constants.js";
import { Cursor } from "../format/cursor.js";
import { decodeIntegers } from "../format/integers.js";

/**
 * @param {Uint8Array} data section `transforms.s`
 * @param {number} frames of the segment
 * @param {Float64Array} rest (K, 4, 3) flat: the transforms that leave the base frame as it is
 * @param {number} step quantisation step, model units
 * @param {string} name of the section, for messages
 * @returns {Float64Array} (frames, K, 4, 3) flat
 */
export function decodeTransforms(data, frames, rest, step, name) {
  const series = rest.length;
  const cursor = new Cursor(data, name);
  const head = cursor.take(series);
  if (head.some((byte) => byte >> 6 === 0)) throw cursor.corrupt("a difference order is 0");
  const contexts = new Uint8Array(frames * series);
  for (let i = 0; i < contexts.length; i++) contexts[i] = head[i % series] & MAX_CLASS;
  const values = decodeIntegers(cursor.rest(), frames * series, contexts, name);
  for (let j = 0; j < series; j++) {
    for (let order = head[j] >> 6; order > 0; order--) {
      for (let i = j + series; i < values.length; i += series) values[i] += values[i - series];
    }
  }
  for (let i = 0; i < values.length; i++) values[i] = rest[i % series] + values[i] * step;
  return values;
}
