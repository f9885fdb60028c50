/** Frames from a decoded basis and coefficients, each a product of Python's kernels. Mirrors `gvpipe.trajectory.reconstruction`. */

import { AGAIN, GeometryVideoError } from "../format/errors.js";
import { splitBasis } from "./basis.js";

const PRODUCT_VALUES = 2 ** 21; // of frames that are rebuilt at once
const MAX_FLOAT32 = 2 ** 128 - 2 ** 104;

export class Segment {
  #kernels;
  #vectors;
  #coefficients;

  /**
   * @param {import("../wasm/kernels.js").Kernels} kernels with a memory for this alone
   * @param {import("./basis.js").Basis} basis of n frames
   * @param {Float64Array} coefficients (P, R) by point, flat @param {number} points P
   * @param {boolean} isReversed whether the last component comes first
   */
  constructor(kernels, basis, coefficients, points, isReversed) {
    const { components } = basis;
    const [mean, vectors] = splitBasis(kernels, basis);
    this.#kernels = kernels;
    this.mean = kernels.view(mean).slice();
    this.#vectors = vectors;
    this.#coefficients = kernels.array("float64", [components, points]);
    const turned = kernels.view(this.#coefficients);
    for (let c = 0; c < components; c++) {
      const from = isReversed ? components - 1 - c : c;
      for (let point = 0; point < points; point++) turned[c * points + point] = coefficients[point * components + from];
    }
  }

  /**
   * @param {number} start @param {number} stop frames of the segment
   * @param {Int32Array} points (V) the point of each vertex
   * @param {Float32Array} frames (stop - start, V, 3) filled, model units
   * @param {number} number of frame `start` in the file, for messages
   */
  read(start, stop, points, frames, number) {
    const together = Math.max(1, Math.floor(PRODUCT_VALUES / (3 * this.#coefficients.shape[1])));
    const size = 3 * points.length;
    for (let first = start; first < stop; first += together) {
      const end = Math.min(first + together, stop);
      const sums = this.#sums(first, end);
      for (let frame = first; frame < end; frame++) {
        const target = frames.subarray((frame - start) * size, (frame - start + 1) * size);
        if (!this.#spread(this.#kernels.view(sums), frame, first, points, target)) {
          throw new GeometryVideoError("corrupt", `frame ${number + frame - start} does not decode to finite positions; ${AGAIN}`);
        }
      }
      this.#kernels.free(sums);
    }
  }

  /** (3 (end - first), P) without the mean. */
  #sums(first, end) {
    const { pointer, shape } = this.#vectors;
    const rows = { type: "float64", shape: [3 * (end - first), shape[1]], pointer: pointer + 8 * 3 * first * shape[1] };
    return this.#kernels.call("weighted_sums", rows, this.#coefficients)[0];
  }

  /** Fill `target (V, 3)`; false if a position does not fit. */
  #spread(sums, frame, first, points, target) {
    const pointCount = this.#coefficients.shape[1];
    let isFinite = true;
    for (let axis = 0; axis < 3; axis++) {
      const mean = this.mean[3 * frame + axis];
      const row = (3 * (frame - first) + axis) * pointCount;
      for (let v = 0; v < points.length; v++) {
        const value = sums[row + points[v]] + mean;
        if (!(value <= MAX_FLOAT32 && value >= -MAX_FLOAT32)) isFinite = false;
        target[3 * v + axis] = value;
      }
    }
    return isFinite;
  }
}
