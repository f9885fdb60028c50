/**
 * What follows from triangles and the decoded average mesh, before any trajectory is known, by Python's kernels. Mirrors
 * `gvcodecs.laplacian.domain`, and `decode_coefficients` of `gvcodecs.laplacian.coefficients`.
 */

import {
  HIERARCHY_MAX_WAVES as MAX_WAVES,
  LAPLACIAN_DELTA_ROWS_N_CAUSAL as MOST_CAUSAL,
  LAPLACIAN_DELTA_ROWS_N_RING as MOST_IN_RING,
  LAPLACIAN_LAPLACE_OPERATORS_OPERATORS as OPERATORS,
} from "../constants.js";
import { placed, taken } from "../trajectory/causal_order.js";
import { decodeVectors } from "../trajectory/coefficient_coding.js";
import { NormalEquations } from "./normal_equations.js";

const OF_CAUSAL = 8; // members of a causal order

/** What follows from the triangles alone, as arrays of kernels. */
export class Surface {
  /**
   * @param {import("../wasm/kernels.js").Kernels} kernels
   * @param {Uint32Array} pointFaces (T, 3), flat, over points @param {number} pointCount P
   */
  constructor(kernels, pointFaces, pointCount) {
    const given = kernels.array("int32", [pointFaces.length / 3, 3], pointFaces);
    [this.faces] = kernels.call("proper_triangles", given);
    this.pointCount = pointCount;
    this.graph = kernels.call("link_vertices", this.faces, pointCount);
    this.hierarchy = kernels.call("build_order", this.faces, pointCount, MAX_WAVES);
    this.causal = kernels.call("weigh_hierarchy", ...this.hierarchy, true);
    const numbers = kernels.array("int32", [pointCount], Int32Array.from({ length: pointCount }, (_, point) => point));
    [this.traversal] = kernels.call("traverse", this.faces, numbers, pointCount);
    [this.components] = kernels.call("label_components", this.graph[0], this.graph[1]);
  }
}

export class Domain {
  #coding;

  /**
   * @param {import("../wasm/kernels.js").Kernels} kernels
   * @param {Surface} surface
   * @param {import("../wasm/kernels.js").KernelArray|null} average (P, 3) decoded, in mean edge lengths, if there is one
   * @param {import("./header.js").CoefficientCoding} coding
   * @param {Uint8Array} still (P) flags of the points whose coefficients are given
   * @param {import("../format/budget.js").Budget} budget
   * @throws {GeometryVideoError} of `NormalEquations`
   */
  constructor(kernels, surface, average, coding, still, budget) {
    const { pointCount, faces, graph, hierarchy, traversal } = surface;
    this.#coding = coding;
    const flags = kernels.array("bool", [pointCount], still);
    const isWalk = coding.anchorChoice === "walk";
    const [anchors, ...chosen] = kernels.call(
      "select_anchors",
      ...[coding.anchors, isWalk, ...hierarchy, ...surface.causal, traversal, surface.components, flags],
    );
    const hasDeltas = chosen[OF_CAUSAL];
    /** `Int32Array` (A) points whose coefficients are coded themselves, in the order of their vectors. */
    this.anchors = kernels.view(anchors).slice();
    this.anchorOrder = taken(kernels, chosen.slice(0, OF_CAUSAL));
    const points = average ?? kernels.array("float64", [pointCount, 3]);
    const whole = kernels.call("laplace_rows", points, faces, ...graph, OPERATORS.indexOf(coding.operator));
    const thin = kernels.call("thin_rows", ...whole);
    const [scale] = kernels.call("fineness", points, ...graph, average ? coding.edgePower : 0);
    const operator = kernels.call("scale_rows", ...thin, scale, hasDeltas);
    const ordered = kernels.call("order_deltas", coding.deltaPrediction === "kalman", ...hierarchy, traversal, hasDeltas);
    const [differential] = kernels.call("multiply", ...operator, points);
    const [most, mostInRing] = [MOST_CAUSAL, MOST_IN_RING].map((table) => table.get(coding.deltaPrediction));
    const weighed = kernels.call("weigh_deltas", ...ordered, ...graph, differential, most, mostInRing);
    /** `Int32Array` (D) points that have deltas, in the order of their vectors. */
    this.deltaPoints = kernels.view(ordered[0]).slice();
    this.deltaOrder = taken(kernels, weighed);
    kernels.free(flags, anchors, ...chosen, ...whole, ...thin, scale, ...ordered, differential, ...weighed);
    if (!average) kernels.free(points);
    this.equations = new NormalEquations(kernels, operator, this.anchors, 1 / coding.anchorRatio, budget);
  }

  /**
   * Coefficients of all points.
   *
   * @param {import("../wasm/kernels.js").Kernels} own kernels whose memory is given back afterwards
   * @param {Uint8Array} anchors @param {Uint8Array} deltas sections @param {[string, string]} names theirs
   * @param {number} components R @param {number} step of deltas
   * @param {Float64Array|null} given (P, R), flat, of the points that stand still
   * @returns {import("../wasm/kernels.js").KernelArray} (P, R), in the memory of the kernels that the domain was made with
   * @throws {GeometryVideoError} the bytes are not as gvpipe writes them
   */
  decode(own, anchors, deltas, names, components, step, given = null) {
    const { anchorRatio, deltaPrediction } = this.#coding;
    this.equations.askToSolve(components);
    const held = given && own.array("float64", [this.anchors.length, components], rowsOf(given, this.anchors, components));
    const sent = decodeVectors(own, placed(own, this.anchorOrder), anchors, components, step * anchorRatio, names[0], { given: held });
    const anchored = own.view(sent).slice();
    const predictor = deltaPrediction === "kalman" ? "kalman" : "navg"; // fixed weights
    const decoded = decodeVectors(own, placed(own, this.deltaOrder), deltas, components, step, names[1], { predictor });
    return this.equations.solve(this.deltaPoints, own.view(decoded), anchored, components);
  }
}

/** Some rows of a matrix. */
function rowsOf(values, chosen, width) {
  const rows = new Float64Array(chosen.length * width);
  chosen.forEach((row, i) => rows.set(values.subarray(row * width, (row + 1) * width), i * width));
  return rows;
}
