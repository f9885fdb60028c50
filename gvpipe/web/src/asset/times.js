/** Section `times`: seconds of each frame, where they do not follow from the rate. Mirrors `gvpipe.asset_coding.times`. */

import { TIMES_SECTION as SECTION } from "../constants.js";
import { corrupt } from "../format/errors.js";
import { inflate } from "../format/inflate.js";

const PLANES = 8; // bytes of a number

/**
 * @param {Uint8Array} data the section @param {number} frameCount
 * @returns {Promise<Float64Array>} (F)
 * @throws {GeometryVideoError} it does not hold a time for each frame
 */
export async function readTimes(data, frameCount) {
  const planes = await inflate(data, PLANES * frameCount, (what) => corrupt(SECTION, what));
  if (planes.length !== PLANES * frameCount) throw corrupt(SECTION, `it does not hold a time for each of ${frameCount} frames`);
  const bytes = new Uint8Array(PLANES * frameCount);
  for (let i = 0; i < frameCount; i++) for (let k = 0; k < PLANES; k++) bytes[PLANES * i + k] = planes[k * frameCount + i];
  const bits = new BigInt64Array(bytes.buffer); // browsers run on little-endian machines
  let [value, step] = [0n, 0n];
  for (let i = 0; i < frameCount; i++) {
    const zigzag = BigInt.asUintN(64, bits[i]);
    step += (zigzag >> 1n) ^ -(zigzag & 1n);
    value += step;
    bits[i] = BigInt.asIntN(64, value);
  }
  const times = new Float64Array(bytes.buffer);
  if (!times.every(Number.isFinite)) throw corrupt(SECTION, "a time is no number");
  return times;
}
