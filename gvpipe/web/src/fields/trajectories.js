/** Values of a field from principal trajectories. Mirrors `gvpipe.fields.trajectories`. */

import { SEGMENTS_LARGEST_STEP as LARGEST_STEP, SEGMENTS_SMALLEST_STEP as SMALLEST_STEP } from "../constants.js";
import { decodeBasis } from "../trajectory/basis.js";
import { Cursor } from "../format/cursor.js";
import { inBlocks } from "../trajectory/coefficient_coding.js";
import { decodeResiduals } from "./residual_coding.js";

/**
 * @param {Uint8Array} data @param {[number, number]} shape frames D, components K @param {import("./segment.js").Place} place
 * @returns {(row: number, component: number, frame: number) => number} values in steps
 */
export function decodeTrajectories(data, [frames, components], { kernels, causal, name }) {
  const cursor = new Cursor(data, name);
  const step = cursor.f64();
  if (!(step >= SMALLEST_STEP && step <= LARGEST_STEP)) throw cursor.corrupt(`a step of coefficients is ${step}`);
  const rows = causal[0].shape[0];
  const basis = decodeBasis(kernels, cursor.block(), frames, rows, step, name, components);
  const count = basis.components;
  const coefficients = decodeCoefficients(cursor.block(), count, step, { kernels, causal, name });
  const size = frames * components;
  const width = count + 1; // of the basis' rows: the mean, then the components
  const vectors = new Float64Array(count * size);
  const mean = new Float64Array(size);
  for (let n = 0; n < size; n++) {
    mean[n] = basis.columns[n * width];
    for (let k = 0; k < count; k++) vectors[k * size + n] = basis.columns[n * width + k + 1];
  }
  const [sums] = kernels.call("weighted_sums", coefficients, kernels.array("float64", [count, size], vectors));
  const left = decodeResiduals(kernels, causal, cursor.rest(), [size, frames], name);
  const [found, words] = [kernels.view(sums), kernels.words(left)];
  return (row, component, frame) => {
    const n = frame * components + component;
    const i = row * size + component * frames + frame;
    return found[row * size + n] + mean[n] + (words[2 * i + 1] * 2 ** 32 + (words[2 * i] >>> 0));
  };
}

/** (R, K) coefficients, as kernels have them. */
function decodeCoefficients(data, count, step, { kernels, causal, name }) {
  const residuals = decodeResiduals(kernels, causal, data, [count, Math.max(1, count)], name);
  const rows = causal[0].shape[0];
  const ranked = kernels.array("int64", [rows, count]);
  const [order, from, to] = [kernels.view(causal[0]), kernels.view(residuals), kernels.view(ranked)];
  order.forEach((row, rank) => to.set(from.subarray(row * count, (row + 1) * count), rank * count));
  const decoded = kernels.array("float64", [rows, count]);
  const noises = kernels.array("float64", [count], new Float64Array(count).fill(step * step));
  const coding = [...causal, step, ranked, decoded, kernels.array("float64", [0, 0]), noises, 0];
  inBlocks(rows, (first, end) => kernels.call("predict_kalman", ...coding, first, end));
  return decoded;
}
