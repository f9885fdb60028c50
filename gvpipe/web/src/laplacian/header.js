/** What the reader of a `laplacian` bitstream must know beside its sections. Mirrors `gvcodecs.laplacian.header`. */

import {
  LAPLACIAN_ANCHORS_ANCHOR_CHOICES as ANCHOR_CHOICES,
  LAPLACIAN_AVERAGE_CODING_SPACING as SPACING,
  LAPLACIAN_DELTA_ROWS_DELTA_PREDICTIONS as DELTA_PREDICTIONS,
  LAPLACIAN_HEADER_COARSEST as COARSEST,
  LAPLACIAN_HEADER_FINEST as FINEST,
  LAPLACIAN_HEADER_LEAST_RATIO as LEAST_RATIO,
  LAPLACIAN_HEADER_MAX_SEGMENTS as MAX_SEGMENTS,
  LAPLACIAN_HEADER_MAX_SPACING as MAX_SPACING,
  LAPLACIAN_HEADER_MOST_POWER as MOST_POWER,
  LAPLACIAN_HEADER_MOST_RATIO as MOST_RATIO,
  LAPLACIAN_HEADER_VERSION as VERSION,
  LAPLACIAN_LAPLACE_OPERATORS_OPERATORS as OPERATORS,
} from "../constants.js";
import { corrupt, quote } from "../format/errors.js";
import { checkInteger, checkNumber } from "../format/header.js";
import { readSegments, readSteps } from "../format/segments.js";

export { VERSION };

/**
 * @typedef {object} CoefficientCoding
 * @property {"mean-value"|"cotangent"|"tutte"} operator whose deltas are coded
 * @property {"kalman"|"rigid"|"none"} deltaPrediction how they are predicted
 * @property {number} anchors points per anchor @property {"hierarchy"|"walk"} anchorChoice
 * @property {number} edgePower steps of deltas go with this power of edge lengths
 * @property {number} averageStep mean edge lengths @property {number} anchorRatio @property {number} basisRatio in steps of deltas
 *
 * @typedef {object} Header
 * @property {CoefficientCoding} coding
 * @property {number} segments how many @property {number[]} steps quantisation step of each, model units
 *
 * @param {object} header of the payload, of this codec
 * @returns {Header}
 */
export function readHeader(header) {
  const { settings } = header;
  const segments = readSegments(header, MAX_SEGMENTS);
  const coding = {
    operator: choice(settings, "operator", OPERATORS),
    deltaPrediction: choice(settings, "delta_prediction", DELTA_PREDICTIONS),
    anchors: checkInteger(settings, "anchors", 1, MAX_SPACING),
    anchorChoice: choice(settings, "anchor_choice", ANCHOR_CHOICES),
    edgePower: checkNumber(settings, "edge_power", 0, MOST_POWER),
    averageStep: checkNumber(settings, "average_step", FINEST, COARSEST),
    anchorRatio: checkNumber(settings, "anchor_ratio", LEAST_RATIO, MOST_RATIO),
    basisRatio: checkNumber(settings, "basis_ratio", LEAST_RATIO, MOST_RATIO),
  };
  return { coding, segments, steps: readSteps(settings, segments) };
}

/** Whether there is an average mesh. @param {CoefficientCoding} coding */
export function needsAverage({ operator, deltaPrediction }) {
  return operator !== "tutte" || deltaPrediction === "rigid";
}

/** How the average itself is coded. @param {CoefficientCoding} coding @returns {CoefficientCoding} */
export function ofAverage(coding) {
  return { ...coding, operator: "tutte", deltaPrediction: "kalman", anchors: SPACING, anchorRatio: 1 };
}

function choice(settings, key, choices) {
  if (!choices.includes(settings[key])) throw corrupt("header", `${key} is ${quote(settings[key])}`);
  return settings[key];
}
