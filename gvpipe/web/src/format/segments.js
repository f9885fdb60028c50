/** What headers say of a sequence's segments. Mirrors `gvpipe.container.segments`. */

import { SEGMENTS_LARGEST_STEP as LARGEST_STEP, SEGMENTS_MAX_SEGMENT as MAX_SEGMENT, SEGMENTS_SMALLEST_STEP as SMALLEST_STEP } from "../constants.js";
import { corrupt, quote } from "./errors.js";
import { checkInteger, checkNumber } from "./header.js";

/** How many segments there are, at most `most`. @param {object} header of the payload @param {number} most @param {string} [key] */
export function readSegments({ settings, frames }, most, key = "segments") {
  const count = checkInteger(settings, key, 1, Math.min(most, frames));
  if (Math.ceil(frames / count) > MAX_SEGMENT) throw corrupt("header", `${frames} frames in ${count} ${key}`);
  return count;
}

/** The quantisation step of each segment, model units. @param {object} settings @param {number} segments @returns {number[]} */
export function readSteps({ steps }, segments) {
  if (!Array.isArray(steps) || steps.length !== segments) throw corrupt("header", `steps is ${quote(steps)}`);
  for (const s of steps.keys()) checkNumber(steps, s, SMALLEST_STEP, LARGEST_STEP);
  return steps;
}
