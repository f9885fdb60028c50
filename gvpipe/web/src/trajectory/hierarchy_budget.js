/** What a vertex hierarchy may cost. Mirrors `gvpipe.mesh.hierarchy.keep_hierarchy`. */

import {
  HIERARCHY_KEPT_PER_TRIANGLE as KEPT_PER_TRIANGLE,
  HIERARCHY_KEPT_PER_VERTEX as KEPT_PER_VERTEX,
  HIERARCHY_PEAK_PER_TRIANGLE as PEAK_PER_TRIANGLE,
  HIERARCHY_PEAK_PER_VERTEX as PEAK_PER_VERTEX,
  HIERARCHY_SECONDS_PER_TRIANGLE as SECONDS_PER_TRIANGLE,
  HIERARCHY_SECONDS_PER_VERTEX as SECONDS_PER_VERTEX,
  SPATIAL_NEIGHBOURS_PEAK_PER_TRIANGLE as TRAVERSED_PER_TRIANGLE,
  SPATIAL_NEIGHBOURS_PEAK_PER_VERTEX as TRAVERSED_PER_VERTEX,
  SPATIAL_NEIGHBOURS_SECONDS_PER_TRIANGLE as TRAVERSAL_SECONDS_PER_TRIANGLE,
  SPATIAL_NEIGHBOURS_SECONDS_PER_VERTEX as TRAVERSAL_SECONDS_PER_VERTEX,
} from "../constants.js";

/**
 * Of the order along a traversal. Mirrors `gvpipe.trajectory.spatial_neighbours.ask_parallelograms`.
 *
 * @param {import("../format/budget.js").Budget} budget @param {number} vertices @param {number} triangles
 * @throws {GeometryVideoError} the file may not take it
 */
export function askParallelograms(budget, vertices, triangles) {
  const memory = TRAVERSED_PER_VERTEX * vertices + TRAVERSED_PER_TRIANGLE * triangles;
  const seconds = TRAVERSAL_SECONDS_PER_VERTEX * vertices + TRAVERSAL_SECONDS_PER_TRIANGLE * triangles;
  budget.ask(`a traversal of ${vertices} vertices and ${triangles} triangles`, memory, seconds);
}

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
