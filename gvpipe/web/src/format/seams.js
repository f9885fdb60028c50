/**
 * Which vertex each corner of a mesh of points uses. Mirrors `gvpipe.connectivity.seams.decode_seams`; `docs/format.md`, sections 5.5 and
 * 6.1.
 */

import { CANDIDATE_ORDER_MARK as MARK, VERTEX_ORDER_MAX_VERTICES as MAX_VERTICES } from "../constants.js";
import { decodeAdaptiveOrder, decodeCandidateOrder } from "./adaptive_order.js";
import { corrupt } from "./errors.js";
import { decodeIntegers } from "./integers.js";
import { decodeSeams } from "./edge_seams.js";
import { decodeOrder } from "./vertex_order.js";

/**
 * @param {import("../wasm/kernels.js").Kernels} kernels
 * @param {Uint8Array} counts @param {Uint8Array} copies parts of section `mesh`
 * @param {Uint8Array} order section
 * @param {Uint32Array} pointFaces (T, 3) triangles over points, smallest point first, flat
 * @param {number} nPoints P
 * @param {boolean} adaptive whether the order has adaptive ranks, as in older files
 * @returns {{faces: Uint32Array, point: Int32Array}} triangles (T, 3) over vertices, flat, and the point of each vertex (V)
 */
export function decodeCopies(kernels, counts, copies, order, pointFaces, nPoints, adaptive) {
  const { faces, point } = decodeCorners(kernels, counts, copies, pointFaces, nPoints);
  if (order.length === 0) return { faces, point };
  const n = point.length;
  const lattice = new Int32Array(3 * n); // for the walk: equal where points are
  for (let v = 0; v < n; v++) lattice[3 * v] = point[v];
  const visits = new Int32Array(n);
  const decode = adaptive ? decodeAdaptiveOrder : order[0] === MARK ? decodeCandidateOrder : decodeOrder;
  decode(kernels, order, lattice, faces, visits);
  const rank = new Int32Array(n); // the user's vertex of each of the codec's
  visits.forEach((visit, v) => (rank[visit] = v));
  return { faces: faces.map((vertex) => rank[vertex]), point: visits.map((visit) => point[visit]) };
}

/** The same in the codec's order: the vertices of point 0, then those of point 1, and so on. */
function decodeCorners(kernels, countsData, data, pointFaces, nPoints) {
  const counts = decodeIntegers(countsData, nPoints, null, "mesh").map((others) => others + 1);
  const starts = new Float64Array(nPoints + 1); // first vertex of each point, and V
  for (let p = 0; p < nPoints; p++) {
    starts[p + 1] = starts[p] + counts[p];
    if (counts[p] < 1 || starts[p + 1] > MAX_VERTICES) throw corrupt("mesh", "a number of copies is out of range");
  }
  const where = sharedCorners(pointFaces, counts);
  const copies = decodeSeams(kernels, data, pointFaces, counts, where);
  const faces = pointFaces.map((p, corner) => starts[p] + copies[corner]);
  const point = new Int32Array(starts[nPoints]);
  for (let p = 0; p < nPoints; p++) point.fill(p, starts[p], starts[p + 1]);
  return { faces, point };
}

/** Corners of points with more than one copy, in order of point and corner. */
function sharedCorners(pointFaces, counts) {
  const ends = new Uint32Array(counts.length + 1);
  for (const p of pointFaces) if (counts[p] > 1) ends[p + 1]++;
  for (let p = 0; p < counts.length; p++) ends[p + 1] += ends[p];
  const corners = new Uint32Array(ends[counts.length]);
  pointFaces.forEach((p, corner) => {
    if (counts[p] > 1) corners[ends[p]++] = corner;
  });
  return corners;
}
