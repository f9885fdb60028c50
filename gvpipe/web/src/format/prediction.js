/**
 * Vectors of coefficients from their residuals, each component predicted from causal neighbours, by weights that the vector's earlier
 * components teach. Mirrors the predictor `kalman` of `gvpipe.trajectory.prediction_kernels`, for vectors (`affine` false), in the same
 * order of operations.
 */

import { PREDICTION_KERNELS_DOUBT as DOUBT } from "../constants.js";

/**
 * @typedef {object} CausalOrder in which order n vectors are coded, and from which causal neighbours each is predicted
 * @property {number[]} order (n) vectors
 * @property {number[]} starts (n + 1) bounds of each vector's causal neighbours in `neighbours`
 * @property {number[]} neighbours vectors, each earlier in `order`
 * @property {number[]} weights prior means of their weights @property {number[]} variances
 * @property {number[]} ringSizes (n) how many of the first neighbours lie next to the vector
 * @property {number[]} blocks bounds in `order` of the blocks that are entropy coded at once
 *
 * @param {CausalOrder} causal
 * @param {number} step quantisation step of all components
 * @param {Float64Array} values (n, R) by vector, flat: residuals in steps, replaced by the components
 * @param {number} components R
 */
export function predictVectors(causal, step, values, components) {
  const noise = step * step;
  for (let i = 0; i < causal.order.length; i++) {
    const own = causal.order[i] * components;
    const [first, end] = [causal.starts[i], causal.starts[i + 1]];
    const n = end - first;
    const neighbours = causal.neighbours.slice(first, end).map((vector) => vector * components);
    const w = Float64Array.from(causal.weights.slice(first, end));
    const [y, p, cov] = [new Float64Array(n), new Float64Array(n), new Float64Array(n * n)];
    for (let j = 0; j < n; j++) cov[j * n + j] = causal.variances[first + j];
    for (let c = 0; c < components; c++) {
      let guess = 0;
      for (let j = 0; j < n; j++) {
        y[j] = values[neighbours[j] + c];
        guess += w[j] * y[j];
      }
      const change = values[own + c] * step;
      values[own + c] = guess + change;
      let gain = noise;
      for (let j = 0; j < n; j++) {
        let total = 0;
        for (let k = 0; k < n; k++) total += cov[j * n + k] * y[k];
        p[j] = total;
        gain += (1 + DOUBT) * total * y[j];
      }
      for (let j = 0; j < n; j++) {
        const scaled = p[j] / gain;
        w[j] += scaled * change;
        for (let k = 0; k < n; k++) cov[j * n + k] -= scaled * p[k];
      }
    }
  }
}
