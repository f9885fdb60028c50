/**
 * Vertices as a GPU needs them. A mesh whose corners at one vertex have several normals or texture coordinates is split there: a
 * render vertex is a vertex with one value of each.
 */

import { previousEqual } from "../format/points.js";

/**
 * @typedef {object} RenderVertices
 * @property {Uint32Array} index (3T) the render vertex of each corner
 * @property {Uint32Array} vertices (R) the vertex of each render vertex
 * @property {Uint32Array} corners (R) one corner of each
 * @property {boolean} isSplit false: render vertices are the vertices
 *
 * @param {Uint32Array} indices (3T) vertex of each corner
 * @param {number} nVertices
 * @param {Uint32Array[]} tables (3T) each: corners of a vertex with equal numbers in every table stay together
 * @returns {RenderVertices}
 */
export function splitVertices(indices, nVertices, tables) {
  if (!tables.length) return unsplit(indices, nVertices);
  const width = tables.length + 1;
  const rows = new Int32Array(indices.length * width);
  for (let c = 0; c < indices.length; c++) {
    rows[c * width] = indices[c];
    for (let t = 1; t < width; t++) rows[c * width + t] = tables[t - 1][c];
  }
  const previous = previousEqual(rows, width);
  const index = new Uint32Array(indices.length);
  const corners = new Uint32Array(indices.length);
  let count = 0;
  for (let c = 0; c < indices.length; c++) {
    if (previous[c] >= 0) {
      index[c] = index[previous[c]];
    } else {
      corners[count] = c;
      index[c] = count++;
    }
  }
  const vertices = Uint32Array.from({ length: count }, (_, r) => indices[corners[r]]);
  return { index, vertices, corners: corners.slice(0, count), isSplit: true };
}

function unsplit(indices, nVertices) {
  const corners = new Uint32Array(nVertices);
  for (let c = 0; c < indices.length; c++) corners[indices[c]] = c;
  const vertices = Uint32Array.from({ length: nVertices }, (_, v) => v);
  return { index: indices.slice(), vertices, corners, isSplit: false };
}

/**
 * Which value of an attribute each corner has.
 *
 * @param {{domain: string, indices: Uint32Array|null}} attribute
 * @param {Uint32Array} indices (3T) @param {{triangles: [number, number]}[]} parts
 * @returns {Uint32Array} (3T)
 */
export function cornerEntries({ domain, indices: entries }, indices, parts) {
  const rows = new Uint32Array(indices.length);
  if (domain === "vertex") rows.set(indices);
  else if (domain === "part") parts.forEach(({ triangles: [start, stop] }, p) => rows.fill(p, 3 * start, 3 * stop));
  else for (let c = 0; c < rows.length; c++) rows[c] = domain === "corner" ? c : (c / 3) | 0;
  if (entries) for (let c = 0; c < rows.length; c++) rows[c] = entries[rows[c]];
  return rows;
}
