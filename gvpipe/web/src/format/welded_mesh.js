/**
 * Triangles, points on the base frame's lattice, seams and vertex order. Mirrors `gvpipe.connectivity.welded_mesh.decode_points`;
 * `docs/format.md`, section 5.5.
 */

import {
  WELDED_MESH_ADAPTIVE_MESH as ADAPTIVE_MESH,
  WELDED_MESH_ADAPTIVE_ORDER as ADAPTIVE_ORDER,
  WELDED_MESH_FITTED_MESH as FITTED_MESH,
} from "../constants.js";
import { decodeAdaptiveMesh } from "./adaptive_mesh.js";
import { decodeBase } from "./base_mesh.js";
import { decodeCopies } from "./seams.js";
import { Cursor } from "./cursor.js";
import { smallestFirst } from "./topology_only.js";

/**
 * @typedef {object} PointMesh
 * @property {Uint32Array} faces (T, 3) triangles over V vertices, flat
 * @property {Int32Array} point (V) the point of each vertex
 * @property {Int32Array} lattice (P, 3) positions of the points, lattice units, flat
 * @property {Uint32Array} pointFaces (T, 3) the triangles over points, flat
 *
 * @param {import("../wasm/kernels.js").Kernels} kernels
 * @param {Uint8Array} mesh @param {Uint8Array} order sections
 * @param {{vertices: number, triangles: number}} most of the header
 * @returns {Promise<PointMesh>}
 */
export async function decodePoints(kernels, mesh, order, most) {
  const cursor = new Cursor(mesh, "mesh");
  const flags = cursor.u8();
  const isBoth = (flags & ADAPTIVE_MESH) > 0 && (flags & FITTED_MESH) > 0;
  if (flags > FITTED_MESH + ADAPTIVE_ORDER || isBoth) throw cursor.corrupt(`flags ${flags} are unknown`);
  const stream = cursor.take(cursor.varint(cursor.left, "a length"));
  const adaptive = flags & (ADAPTIVE_MESH | FITTED_MESH);
  const base = adaptive ? await decodeAdaptiveMesh(kernels, stream, most, adaptive === FITTED_MESH) : await decodeBase(stream, most);
  const pointFaces = smallestFirst(base.faces);
  const counts = cursor.take(cursor.varint(cursor.left, "a length"));
  const { faces, point } = decodeCopies(kernels, counts, cursor.rest(), order, pointFaces, base.points.length / 3, Boolean(flags & ADAPTIVE_ORDER));
  return { faces, point, lattice: base.points, pointFaces };
}
