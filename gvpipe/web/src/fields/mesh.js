/** The mesh under fields: in which order rows are coded, and which rows predict each. Mirrors `gvpipe.fields.mesh`. */

import { HIERARCHY_MAX_WAVES as MAX_WAVES } from "../constants.js";
import { taken } from "../trajectory/causal_order.js";

/**
 * @param {import("../wasm/kernels.js").Kernels} kernels
 * @param {Int32Array} faces (3T) vertices @param {number} nVertices @param {"vertex"|"triangle"} domain
 * @returns {import("../trajectory/causal_order.js").CausalOrder} of R rows
 */
export function rowOrder(kernels, faces, nVertices, domain) {
  const mesh = kernels.array("int32", [faces.length / 3, 3], faces);
  const isDual = domain === "triangle";
  const [rows] = isDual ? kernels.call("find_dual", mesh, nVertices) : [mesh];
  const hierarchy = kernels.call("build_order", rows, isDual ? faces.length / 3 : nVertices, MAX_WAVES);
  return taken(kernels, kernels.call("weigh_hierarchy", ...hierarchy, true));
}
