/**
 * Triangles, points on the base frame's lattice, seams and vertex order. Mirrors `gvpipe.connectivity.welded_mesh.decode_points`;
 * `docs/format.md`, section 5.5.
 */

import { decodeBase } from "./base_mesh.js";
import { decodeCopies } from "./seams.js";
import { Cursor } from "./cursor.js";

/**
 * @typedef {object} PointMesh
 * @property {Uint32Array} faces (T, 3) triangles over V vertices, flat
 * @property {Int32Array} point (V) the point of each vertex
 * @property {Int32Array} lattice (P, 3) positions of the points, lattice units, flat
 * @property {Uint32Array} pointFaces (T, 3) the triangles over points, flat
 *
 * @param {Uint8Array} mesh @param {Uint8Array} order sections
 * @param {boolean} across whether seams are coded across edges (`seams.js`)
 * @returns {Promise<PointMesh>}
 */
export async function decodePoints(mesh, order, across) {
  const cursor = new Cursor(mesh, "mesh");
  const base = await decodeBase(cursor.take(cursor.varint(cursor.left, "a length")), new Uint8Array(0));
  const pointFaces = smallestFirst(base.faces);
  const counts = cursor.take(cursor.varint(cursor.left, "a length"));
  const { faces, point } = decodeCopies(counts, cursor.rest(), order, pointFaces, base.visits.length, across);
  return { faces, point, lattice: base.points, pointFaces };
}

/** Rotate each triangle so that its smallest index leads; winding stays. */
function smallestFirst(faces) {
  const turned = new Uint32Array(faces.length);
  for (let i = 0; i < faces.length; i += 3) {
    const [a, b, c] = [faces[i], faces[i + 1], faces[i + 2]];
    if (a <= b && a <= c) turned.set([a, b, c], i);
    else if (b <= c) turned.set([b, c, a], i);
    else turned.set([c, a, b], i);
  }
  return turned;
}
