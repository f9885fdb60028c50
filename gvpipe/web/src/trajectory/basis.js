/** Principal trajectories of a segment. Mirrors `gvpipe.trajectory.basis.decode_basis`; `docs/format.md`, section 6. */

import {
  BASIS_BYTES_PER_ROW as BYTES_PER_ROW,
  BASIS_BYTES_PER_VALUE as BYTES_PER_VALUE,
  BASIS_LEAST_OUTSIDE as LEAST_OUTSIDE,
  BASIS_MAX_COMPONENTS as MAX_COMPONENTS,
  BASIS_MAX_SCALE as MAX_SCALE,
  BASIS_PER_OCTAVE as PER_OCTAVE,
  BASIS_SECONDS_PER_VALUE as SECONDS_PER_VALUE,
} from "../constants.js";
import { Cursor } from "../format/cursor.js";
import { decodeIntegers } from "../format/integers.js";
import { placed } from "./causal_order.js";
import { MAX_VALUES, decodeVectors, findsNoises } from "./coefficient_coding.js";
import { temporalOrder } from "./temporal_neighbours.js";

/** 2 ** (i / PER_OCTAVE), rounded correctly: browsers' own powers need not be. */
const ROOTS = [1, 1.0905077326652577, 1.189207115002721, 1.2968395546510096, 1.4142135623730951, 1.5422108254079407, 1.681792830507429, 1.8340080864093424];

/**
 * @typedef {object} Basis
 * @property {number} components R
 * @property {Float64Array} columns (A F, 1 + R) flat: the mean trajectory, then the principal ones
 *
 * @param {import("../wasm/kernels.js").Kernels} kernels
 * @param {Uint8Array} data
 * @param {number} frames of the segment @param {number} points whose trajectories these are
 * @param {number} step quantisation step, model units
 * @param {string} name of the section, for messages
 * @param {number} axes A, coordinates of a frame
 * @param {import("./budget.js").Budget|null} budget of the file; null: no limit
 * @returns {Basis}
 */
export function decodeBasis(kernels, data, frames, points, step, name, axes = 3, budget = null) {
  const cursor = new Cursor(data, name);
  const components = cursor.varint(Math.min(MAX_COMPONENTS, axes * frames), "the number of components");
  const values = (points + axes * frames) * (components + 1);
  const memory = BYTES_PER_VALUE * values + BYTES_PER_ROW * axes * frames;
  budget?.ask(`section '${name}', ${components} trajectories over ${frames} frames`, memory, SECONDS_PER_VALUE * values);
  const levels = decodeIntegers(cursor.block(), components, null, name);
  const scales = [Math.sqrt(points)];
  let level = 0;
  for (const difference of levels) {
    level += difference;
    if (Math.abs(level) > MAX_SCALE) throw cursor.corrupt("a scale is out of range");
    scales.push(step * 2 ** Math.floor(level / PER_OCTAVE) * ROOTS[level & (PER_OCTAVE - 1)]);
  }
  const width = components + 1;
  if (axes * frames * width > MAX_VALUES) throw cursor.corrupt(`${components} components over ${frames} frames`);
  const coarse = step / Math.sqrt(Math.max(LEAST_OUTSIDE, 1 - width / (axes * frames)));
  const rest = cursor.rest();
  const order = placed(kernels, temporalOrder(frames, axes, findsNoises(rest, name)));
  const decoded = decodeVectors(kernels, order, rest, width, coarse, name);
  const columns = kernels.view(decoded).slice();
  kernels.free(...order, decoded);
  for (let i = 0; i < columns.length; i++) columns[i] /= scales[i % width];
  return { components, columns };
}

/**
 * A basis as kernels take it.
 *
 * @param {import("../wasm/kernels.js").Kernels} kernels
 * @param {Basis} basis
 * @returns {[object, object]} the mean (A F) and the principal trajectories (A F, R), arrays of `kernels`
 */
export function splitBasis(kernels, { components, columns }) {
  const width = components + 1;
  const rows = columns.length / width;
  const [mean, vectors] = [kernels.array("float64", [rows]), kernels.array("float64", [rows, components])];
  const [ofMean, ofVectors] = [kernels.view(mean), kernels.view(vectors)];
  for (let row = 0; row < rows; row++) {
    ofMean[row] = columns[row * width];
    ofVectors.set(columns.subarray(row * width + 1, (row + 1) * width), row * components);
  }
  return [mean, vectors];
}
