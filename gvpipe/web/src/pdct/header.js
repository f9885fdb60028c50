/** What the reader of a `pdct` bitstream must know beside its sections. Mirrors `gvcodecs.pdct.header`. */

import {
  PDCT_HEADER_MAX_CLIPS as MAX_CLIPS,
  PDCT_HEADER_VERSION_POINTS as VERSION,
  SEGMENTS_HUGE as HUGE,
  SEGMENTS_MAX_SEGMENT as MAX_SEGMENT,
} from "../constants.js";
import { corrupt, quote } from "../format/errors.js";
import { checkInteger } from "../format/payload.js";

export { VERSION };

/**
 * @typedef {object} Header
 * @property {number} clips how many @property {number[]} base origin x, y, z and step of the base frame's lattice, model units
 *
 * @param {object} header of the payload, of this codec
 * @returns {Header}
 */
export function readHeader({ settings, frames }) {
  const clips = checkInteger(settings, "clips", 1, Math.min(MAX_CLIPS, frames));
  if (Math.ceil(frames / clips) > MAX_SEGMENT) throw corrupt("header", `${frames} frames in ${clips} clips`);
  const { base } = settings;
  const isLattice = Array.isArray(base) && base.length === 4 && base.every((v) => typeof v === "number" && Math.abs(v) <= HUGE);
  if (!isLattice || !(base[3] > 0)) throw corrupt("header", `base is ${quote(base)}`);
  return { clips, base };
}
