/**
 * The clusters' affine transforms of a segment: differences in time, range coded in the context of each series' magnitude.
 * Mirrors `gvcodecs.mcgv.motion.affine_coding`; `docs/format.md`, section 5.
 */

import { Cursor } from "../format/cursor.js";
import { decodeSeries } from "../format/series.js";

const ORDERS = [1, 2, 3];

/**
 * @param {Uint8Array} data section `transforms.s`
 * @param {number} frames of the segment
 * @param {Float64Array} rest (K, 4, 3) flat: the transforms that leave the base frame as it is
 * @param {number} step quantisation step, model units
 * @param {string} name of the section, for messages
 * @returns {Float64Array} (frames, K, 4, 3) flat
 */
export function decodeTransforms(data, frames, rest, step, name) {
  const values = decodeSeries(new Cursor(data, name), frames, rest.length, ORDERS);
  for (let i = 0; i < values.length; i++) values[i] = rest[i % rest.length] + values[i] * step;
  return values;
}
