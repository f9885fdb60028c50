/** The mesh under fields: in which order rows are coded, and which rows predict each. Mirrors `gvpipe.fields.mesh`. */

import { HIERARCHY_MAX_WAVES as MAX_WAVES } from "../constants.js";
import { taken } from "../trajectory/causal_order.js";

/**
 * @param {import("../wasm/kernels.js").Kernels} kernels
 * @param {Int32Array} faces (3T) vertices @param {number} nVertices
 * @param {"vertex"|"triangle"|"polygon"} domain of the rows @param {Int32Array|null} polygons corners of each, for those
 * @returns {import("../trajectory/causal_order.js").CausalOrder} of R rows
 */
export function rowOrder(kernels, faces, nVertices, domain, polygons) {
  const mesh = kernels.array("int32", [faces.length / 3, 3], faces);
  if (domain === "vertex") return ordered(kernels, mesh, nVertices);
  const [dual] = kernels.call("find_dual", mesh, nVertices);
  if (domain === "triangle") return ordered(kernels, dual, faces.length / 3);
  const joined = joinedRows(kernels.view(dual), polygons);
  return ordered(kernels, kernels.array("int32", [joined.length / 3, 3], joined), polygons.length);
}

function ordered(kernels, rows, count) {
  const hierarchy = kernels.call("build_order", rows, count, MAX_WAVES);
  return taken(kernels, kernels.call("weigh_hierarchy", ...hierarchy, true));
}

/** Dual triangles between polygons, of those between triangles. */
function joinedRows(dual, polygons) {
  const owner = [];
  polygons.forEach((corners, p) => {
    for (let k = 0; k < corners - 2; k++) owner.push(p);
  });
  const found = [];
  for (let t = 0; t < dual.length; t += 3) {
    const [a, b, c] = [owner[dual[t]], owner[dual[t + 1]], owner[dual[t + 2]]];
    if (a !== b && b !== c && c !== a) found.push(a, b, c);
  }
  return Int32Array.from(found);
}
