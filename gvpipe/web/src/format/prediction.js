/**
 * Rows of coefficients from their residuals, each component predicted from rows known before; the row's earlier components say
 * how. Mirrors the predictor `kalman` of `gvpipe.trajectory.prediction_kernels`, for rows of vectors (`affine` false), in the same
 * order of operations.
 */

import { PREDICTION_KERNELS_DOUBT as DOUBT } from "../constants.js";

/**
 * @typedef {object} Rows in which order n rows are coded, and from what each is predicted
 * @property {number[]} order (n) rows
 * @property {number[]} starts (n + 1) bounds of each row's known rows in `near`
 * @property {number[]} near known rows, each earlier in `order`
 * @property {number[]} weights prior means of their weights @property {number[]} variances
 * @property {number[]} rings (n) how many of the first known rows lie next to the row
 * @property {number[]} blocks bounds in `order` of the blocks that are entropy coded at once
 *
 * @param {Rows} rows
 * @param {number} step quantisation step of all components
 * @param {Float64Array} values (n, R) by row, flat: residuals in steps, replaced by the components
 * @param {number} components R
 */
export function predictRows(rows, step, values, components) {
  const noise = step * step;
  for (let i = 0; i < rows.order.length; i++) {
    const row = rows.order[i] * components;
    const [first, end] = [rows.starts[i], rows.starts[i + 1]];
    const n = end - first;
    const near = rows.near.slice(first, end).map((known) => known * components);
    const w = Float64Array.from(rows.weights.slice(first, end));
    const [y, p, cov] = [new Float64Array(n), new Float64Array(n), new Float64Array(n * n)];
    for (let j = 0; j < n; j++) cov[j * n + j] = rows.variances[first + j];
    for (let c = 0; c < components; c++) {
      let guess = 0;
      for (let j = 0; j < n; j++) {
        y[j] = values[near[j] + c];
        guess += w[j] * y[j];
      }
      const change = values[row + c] * step;
      values[row + c] = guess + change;
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
