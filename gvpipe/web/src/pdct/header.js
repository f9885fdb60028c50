/** What the reader of a `pdct` bitstream must know beside its sections. Mirrors `gvcodecs.pdct.header`. */

import { PDCT_HEADER_MAX_CLIPS as MAX_CLIPS, PDCT_HEADER_VERSION_POINTS as VERSION, SEGMENTS_HUGE as HUGE } from "../constants.js";
import { corrupt, quote } from "../format/errors.js";
import { readSegments } from "../format/segments.js";

export { VERSION };

/**
 * @typedef {object} Header
 * @property {number} clips how many @property {number[]} base origin x, y, z and step of the base frame's lattice, model units
 *
 * @param {object} header of the payload, of this codec
 * @returns {Header}
 */
export function readHeader(header) {
  const clips = readSegments(header, MAX_CLIPS, "clips");
  const { base } = header.settings;
  const isLattice = Array.isArray(base) && base.length === 4 && base.every((v) => typeof v === "number" && Math.abs(v) <= HUGE);
  if (!isLattice || !(base[3] > 0)) throw corrupt("header", `base is ${quote(base)}`);
  return { clips, base };
}
