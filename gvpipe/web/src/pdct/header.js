/** What the reader of a `pdct` bitstream must know beside its sections. Mirrors `gvcodecs.pdct.header`. */

import {
  PDCT_HEADER_MAX_CLIPS as MAX_CLIPS,
  PDCT_HEADER_VERSION as VERSION,
  SEGMENTS_HUGE as HUGE,
  SEGMENTS_MAX_SEGMENT as MAX_SEGMENT,
} from "../constants.js";
import { corrupt, quote } from "../format/errors.js";
import { checkInteger } from "../format/header.js";
import { readSegments } from "../format/segments.js";

export { VERSION };

/**
 * @typedef {object} Header
 * @property {number} clips how many; of files that grow, so far @property {number} clip frames of each but the last; 0: even cuts
 * @property {number[]} base origin x, y, z and step of the base frame's lattice, model units
 *
 * @param {object} header of the payload, of this codec
 * @returns {Header}
 */
export function readHeader(header) {
  const { base } = header.settings;
  const clip = "clip" in header.settings ? checkInteger(header.settings, "clip", 1, MAX_SEGMENT) : 0;
  const clips = clip ? Math.ceil(header.frames / clip) : readSegments(header, MAX_CLIPS, "clips");
  if (clips > MAX_CLIPS) throw corrupt("header", `${header.frames} frames in clips of ${clip}`);
  const isLattice = Array.isArray(base) && base.length === 4 && base.every((v) => typeof v === "number" && Math.abs(v) <= HUGE);
  if (!isLattice || !(base[3] > 0)) throw corrupt("header", `base is ${quote(base)}`);
  return { clips, clip, base };
}
