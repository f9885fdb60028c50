/** What a vertex hierarchy may cost. Mirrors `gvpipe.mesh.hierarchy.keep_hierarchy`. */

import {
  HIERARCHY_KEPT_PER_TRIANGLE as KEPT_PER_TRIANGLE,
  HIERARCHY_KEPT_PER_VERTEX as KEPT_PER_VERTEX,
  HIERARCHY_PEAK_PER_TRIANGLE as PEAK_PER_TRIANGLE,
  HIERARCHY_PEAK_PER_VERTEX as PEAK_PER_VERTEX,
  HIERARCHY_SECONDS_PER_TRIANGLE as SECONDS_PER_TRIANGLE,
  HIERARCHY_SECONDS_PER_VERTEX as SECONDS_PER_VERTEX,
} from "../constants.js";

/**
 * @param {import("../format/budget.js").Budget} budget @param {number} vertices @param {number} triangles
 * @throws {GeometryVideoError} the file may not take it
 */
export function keepHierarchy(budget, vertices, triangles) {
  const what = `a hierarchy of ${vertices} vertices and ${triangles} triangles`;
  budget.ask(what, PEAK_PER_VERTEX * vertices + PEAK_PER_TRIANGLE * triangles);
  const seconds = SECONDS_PER_VERTEX * vertices + SECONDS_PER_TRIANGLE * triangles;
  budget.keep(what, KEPT_PER_VERTEX * vertices + KEPT_PER_TRIANGLE * triangles, seconds);
}
