/** What the reader of a `pca` bitstream must know beside its sections. Mirrors `gvcodecs.pca.header`. */

import {
  PCA_HEADER_MAX_SEGMENTS as MAX_SEGMENTS,
  PCA_HEADER_VERSION as VERSION,
  PREDICTION_PREDICTORS as PREDICTORS,
} from "../constants.js";
import { corrupt, quote } from "../format/errors.js";
import { checkNumber } from "../format/header.js";
import { readSegments, readSteps } from "../format/segments.js";

export { VERSION };

/**
 * @typedef {object} Header
 * @property {"navg"|"lsp"|"rbf"|"kalman"} predictor of the coefficients @property {number} beta exponent of the radial function
 * @property {number} segments how many @property {number[]} steps quantisation step of each, model units
 * @property {boolean} hasFirst coefficients say how many components come first
 *
 * @param {object} header of the payload, of this codec
 * @returns {Header}
 */
export function readHeader(header) {
  const { settings } = header;
  const { predictor } = settings;
  if (!PREDICTORS.includes(predictor)) throw corrupt("header", `predictor is ${quote(predictor)}`);
  const segments = readSegments(header, MAX_SEGMENTS);
  const { first: hasFirst = false } = settings;
  if (typeof hasFirst !== "boolean" || (hasFirst && predictor !== "kalman")) throw corrupt("header", `first is ${quote(hasFirst)}`);
  return { predictor, beta: checkNumber(settings, "beta", 0.1, 1.99), segments, steps: readSteps(settings, segments), hasFirst };
}
