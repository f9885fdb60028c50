/** Points that never move: one position each. Mirrors the reading half of `gvpipe.trajectory.still_points`; `docs/format.md`, section 6. */

import {
  SEGMENTS_LARGEST_STEP as LARGEST_STEP,
  SEGMENTS_SMALLEST_STEP as SMALLEST_STEP,
  STILL_POINTS_BYTES_PER_STILL as BYTES_PER_STILL,
  STILL_POINTS_SECONDS_PER_PRODUCT as SECONDS_PER_PRODUCT,
  STILL_POINTS_SECONDS_PER_STILL as SECONDS_PER_STILL,
  STILL_POINTS_SECTION as SECTION,
} from "../constants.js";
import { Cursor } from "../format/cursor.js";
import { corrupt } from "../format/errors.js";
import { decodeFlags } from "../format/still_vertices.js";
import { MAX_VALUES, decodeVectors } from "./coefficient_coding.js";

export { SECTION };

/** Still points of a mesh of P points; all points move where a file has none. */
export class StillPoints {
  /** @param {Uint8Array} flags (P) which stand still @param {Float32Array} positions (P, 3), model units; the others' mean nothing */
  constructor(flags, positions) {
    this.flags = flags;
    this.positions = positions;
    this.count = flags.reduce((sum, flag) => sum + flag, 0);
  }

  get movingCount() {
    return this.flags.length - this.count;
  }

  /**
   * Coefficients of the still points in a segment's basis, in closest fit; null if all points move.
   *
   * @param {import("../wasm/kernels.js").Kernels} kernels
   * @param {import("../wasm/kernels.js").KernelArray} mean (3n) @param {import("../wasm/kernels.js").KernelArray} vectors (3n, R)
   * @param {import("../format/budget.js").Budget} budget
   * @returns {import("../wasm/kernels.js").KernelArray|null} (P, R), 0 for points that move
   */
  given(kernels, mean, vectors, budget) {
    if (!this.count) return null;
    const { flags, count } = this;
    const [rows, components] = vectors.shape;
    const products = SECONDS_PER_PRODUCT * count * rows * components;
    budget.ask(`coefficients of ${count} still points over ${rows / 3} frames`, 8 * count * (2 * rows + 3 * components), products);
    if (components * flags.length > MAX_VALUES) throw corrupt(SECTION, `${components} components of ${flags.length} points`);
    const own = Float64Array.from(this.positions).filter((_, i) => flags[Math.floor(i / 3)]);
    const positions = kernels.array("float64", [count, 3], own);
    const [fitted] = kernels.call("fit_still", positions, mean, vectors);
    const result = kernels.array("float64", [flags.length, components]);
    const [from, to] = [kernels.view(fitted), kernels.view(result)];
    for (let point = 0, row = 0; point < flags.length; point++) {
      if (!flags[point]) continue;
      to.set(from.subarray(row * components, (row + 1) * components), point * components);
      row++;
    }
    kernels.free(positions, fitted);
    return result;
  }

  /** Give the still vertices of `frames (n, V, 3)` their positions. @param {Int32Array} points (V) the point of each vertex */
  overwrite(frames, points) {
    if (!this.count) return;
    const { flags, positions } = this;
    for (let first = 0; first < frames.length; first += 3 * points.length) {
      for (let v = 0; v < points.length; v++) {
        if (!flags[points[v]]) continue;
        for (let axis = 0; axis < 3; axis++) frames[first + 3 * v + axis] = positions[3 * points[v] + axis];
      }
    }
  }
}

/**
 * @param {import("../wasm/kernels.js").Kernels} kernels @param {Uint8Array|null} data the section; null: the file has none
 * @param {Uint32Array} pointFaces (T, 3) triangles over points, flat @param {number} n P
 * @param {import("../format/budget.js").Budget} budget
 * @returns {StillPoints}
 * @throws {GeometryVideoError} the section is not as gvpipe writes it
 */
export function readStill(kernels, data, pointFaces, n, budget) {
  if (!data) return new StillPoints(new Uint8Array(n), new Float32Array(0));
  budget.ask(`${n} still points`, BYTES_PER_STILL * n, SECONDS_PER_STILL * n);
  const cursor = new Cursor(data, SECTION);
  const step = cursor.f64();
  const origin = new Float32Array(cursor.take(12).slice().buffer);
  if (!(step >= SMALLEST_STEP && step <= LARGEST_STEP) || !origin.every(Number.isFinite)) {
    throw cursor.corrupt(`its step is ${step}, its origin ${origin}`);
  }
  const flags = decodeFlags(cursor.block(), n, SECTION);
  const numbers = new Int32Array(n); // of still points, among themselves
  let count = 0;
  flags.forEach((flag, point) => (numbers[point] = flag ? count++ : -1));
  if (!count) throw cursor.corrupt("no point stands still");
  const order = stillOrder(kernels, numbers, pointFaces, count);
  const indices = decodeVectors(kernels, order, cursor.rest(), 3, 1, SECTION, { predictor: "navg" });
  const found = kernels.view(indices);
  const positions = new Float32Array(3 * n);
  numbers.forEach((number, point) => {
    for (let axis = 0; number >= 0 && axis < 3; axis++) positions[3 * point + axis] = origin[axis] + step * found[3 * number + axis];
  });
  if (!positions.every(Number.isFinite)) throw cursor.corrupt("a position is larger than float32 can hold");
  kernels.free(indices, ...order);
  return new StillPoints(flags, positions);
}

/** The order of the still points along the triangles between them, as kernels take it. */
function stillOrder(kernels, numbers, pointFaces, count) {
  const between = [];
  for (let i = 0; i < pointFaces.length; i += 3) {
    const corners = [numbers[pointFaces[i]], numbers[pointFaces[i + 1]], numbers[pointFaces[i + 2]]];
    if (Math.min(...corners) >= 0) between.push(...corners);
  }
  const mesh = kernels.array("int32", [between.length / 3, 3], between);
  const order = kernels.call("weigh_traversal", mesh, count);
  kernels.free(mesh);
  return order;
}
