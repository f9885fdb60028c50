/**
 * Least squares with a sparse operator: the normal equations, factored and solved by Python's kernels. Mirrors
 * `gvcodecs.laplacian.normal_equations` with its budget, and the solving half of `gvcodecs.laplacian.extended_laplacian`.
 */

import {
  LAPLACIAN_NORMAL_EQUATIONS_BYTES_PER_ENTRY as BYTES_PER_ENTRY,
  LAPLACIAN_NORMAL_EQUATIONS_BYTES_PER_PAIR as BYTES_PER_PAIR,
  LAPLACIAN_NORMAL_EQUATIONS_COLUMNS as COLUMNS,
  LAPLACIAN_NORMAL_EQUATIONS_FREE_PRODUCTS as FREE_PRODUCTS,
  LAPLACIAN_NORMAL_EQUATIONS_PRODUCTS as PRODUCTS,
  LAPLACIAN_NORMAL_EQUATIONS_SECONDS_PER_ENTRY as SECONDS_PER_ENTRY,
  LAPLACIAN_NORMAL_EQUATIONS_SECONDS_PER_PAIR as SECONDS_PER_PAIR,
  LAPLACIAN_NORMAL_EQUATIONS_SECONDS_PER_PRODUCT as SECONDS_PER_PRODUCT,
  LAPLACIAN_NORMAL_EQUATIONS_SECONDS_PER_SOLVED as SECONDS_PER_SOLVED,
  LAPLACIAN_NORMAL_EQUATIONS_SECONDS_PER_STEP as SECONDS_PER_STEP,
} from "../constants.js";
import { GeometryVideoError, corrupt } from "../format/errors.js";

export class NormalEquations {
  #kernels;
  #budget;
  #operator;
  #order;
  #factors;
  #cost; // s of work a solved column
  #anchors;
  #weight; // of an anchor's row, squared

  /**
   * @param {import("../wasm/kernels.js").Kernels} kernels
   * @param {import("../wasm/kernels.js").KernelArray[]} operator (P, P) by rows: starts, columns, values; kept
   * @param {Int32Array} anchors (A) points that an equation of their own holds
   * @param {number} weight of these, beside 1 for a row of the operator
   * @param {import("../format/budget.js").Budget} budget
   * @throws {GeometryVideoError} the factor takes more than the file may, or an unknown is held by nothing
   */
  constructor(kernels, operator, anchors, weight, budget) {
    const n = operator[0].shape[0] - 1;
    this.#kernels = kernels;
    this.#budget = budget;
    this.#operator = operator;
    this.#anchors = kernels.array("int32", [anchors.length], anchors);
    this.#weight = weight * weight;
    const [what, pairs] = [`factoring over ${n} points`, countPairs(kernels.numbers(operator[0]))];
    budget.ask(what, BYTES_PER_PAIR * pairs, SECONDS_PER_PAIR * pairs);
    const transposed = kernels.call("transpose", ...operator);
    const [starts, columns] = kernels.call("normal_pattern", ...operator, ...transposed);
    const limit = FREE_PRODUCTS + PRODUCTS * n * Math.floor(Math.sqrt(n));
    const mostSteps = Math.floor(budget.secondsLeft / SECONDS_PER_STEP);
    const [order, entries, products, steps] = kernels.call("order_unknowns", starts, columns, limit, mostSteps);
    if (products > limit) {
      const most = `${n} points may take ${limit} products`;
      throw new GeometryVideoError("unsupported", `its triangles couple points at random: factoring takes too long, ${most}; encode it as pca`);
    }
    budget.keep(what, 0, SECONDS_PER_STEP * steps);
    const work = SECONDS_PER_PAIR * pairs + SECONDS_PER_ENTRY * entries + SECONDS_PER_PRODUCT * products;
    budget.ask(what, BYTES_PER_PAIR * pairs + BYTES_PER_ENTRY * entries);
    budget.keep(what, BYTES_PER_ENTRY * entries, work);
    const held = new Float64Array(n);
    for (const anchor of anchors) held[anchor] = this.#weight;
    const diagonal = kernels.array("float64", [n], held);
    const matrix = kernels.call("normal_matrix", ...operator, ...transposed, diagonal, order, columns.shape[0] / 2);
    const pattern = kernels.call("factor_pattern", matrix[0], matrix[1], entries);
    const [, , values, pivots, at] = kernels.call("factorise", ...matrix, ...pattern);
    kernels.free(...transposed, starts, columns, diagonal, ...matrix);
    if (at >= 0) throw corrupt("average", "its Laplacian cannot be inverted");
    this.#order = order;
    this.#factors = [...pattern, values, pivots];
    this.#cost = SECONDS_PER_SOLVED * (entries + n);
  }

  /** Check that the file may take the work of so many solutions. @param {number} columns */
  askToSolve(columns) {
    const n = this.#order.shape[0];
    this.#budget.ask(`${columns} solutions over ${n} points`, 0, columns * this.#cost);
  }

  /**
   * The coefficients that fit best.
   *
   * @param {Int32Array} points (D) which have deltas @param {Float64Array} deltas (D, R), flat
   * @param {Float64Array} anchored (A, R), flat, of the anchors @param {number} columns R
   * @returns {import("../wasm/kernels.js").KernelArray} (P, R)
   */
  solve(points, deltas, anchored, columns) {
    const kernels = this.#kernels;
    const given = [
      kernels.array("int32", [points.length], points),
      kernels.array("float64", [points.length, columns], deltas),
      kernels.array("float64", [this.#anchors.shape[0], columns], anchored),
    ];
    const [right] = kernels.call("multiply_transposed", ...this.#operator, given[0], given[1]);
    kernels.call("add_rows", right, this.#anchors, this.#weight, given[2]);
    const solved = kernels.array("float64", right.shape);
    for (let first = 0; first < columns; first += COLUMNS) {
      kernels.call("solve_columns", ...this.#factors, this.#order, right, solved, first, Math.min(first + COLUMNS, columns));
    }
    kernels.free(...given, right);
    return solved;
  }

  /** Give the memory of the factors and of the operator back. */
  free() {
    this.#kernels.free(...this.#operator, this.#anchors, this.#order, ...this.#factors);
  }
}

/** Pairs of points that a row couples, of all rows. */
function countPairs(starts) {
  let pairs = 0;
  for (let i = 1; i < starts.length; i++) pairs += (starts[i] - starts[i - 1]) ** 2;
  return pairs;
}
