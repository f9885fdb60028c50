/** What the reader of a `pca` bitstream must know beside its sections. Mirrors `gvcodecs.pca.header`. */

import {
  PCA_HEADER_MAX_SEGMENTS as MAX_SEGMENTS,
  PCA_HEADER_VERSION_STILL as VERSION,
  PREDICTION_PREDICTORS as PREDICTORS,
  SEGMENTS_LARGEST_STEP as LARGEST_STEP,
  SEGMENTS_MAX_SEGMENT as MAX_SEGMENT,
  SEGMENTS_SMALLEST_STEP as SMALLEST_STEP,
} from "../constants.js";
import { corrupt, quote } from "../format/errors.js";
import { checkInteger, checkNumber } from "../format/payload.js";

export { VERSION };

/**
 * @typedef {object} Header
 * @property {"navg"|"lsp"|"rbf"|"kalman"} predictor of the coefficients @property {number} beta exponent of the radial function
 * @property {number} segments how many @property {number[]} steps quantisation step of each, model units
 *
 * @param {object} header of the payload, of this codec
 * @returns {Header}
 */
export function readHeader({ settings, frames }) {
  const { predictor, steps } = settings;
  if (!PREDICTORS.includes(predictor)) throw corrupt("header", `predictor is ${quote(predictor)}`);
  const segments = checkInteger(settings, "segments", 1, Math.min(MAX_SEGMENTS, frames));
  if (Math.ceil(frames / segments) > MAX_SEGMENT) throw corrupt("header", `${frames} frames in ${segments} segments`);
  if (!Array.isArray(steps) || steps.length !== segments) throw corrupt("header", `steps is ${quote(steps)}`);
  for (const s of steps.keys()) checkNumber(steps, s, SMALLEST_STEP, LARGEST_STEP);
  return { predictor, beta: checkNumber(settings, "beta", 0.1, 1.99), segments, steps };
}
