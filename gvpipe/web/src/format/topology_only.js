/** Triangles over welded points, without any position. Mirrors `gvpipe.connectivity.topology_only`; `docs/format.md`, section 6.1. */

import { BASE_MESH_MAX_PER_BYTE as MAX_PER_BYTE, VERTEX_ORDER_MAX_VERTICES as MAX_VERTICES } from "../constants.js";
import { decodeTable } from "./base_mesh.js";
import { Cursor } from "./cursor.js";
import { decodeDracoTriangles } from "./draco.js";
import { AGAIN, GeometryVideoError, corrupt } from "./errors.js";
import { decodeIntegers } from "./integers.js";
import { decodeCopies } from "./seams.js";

/**
 * @typedef {object} Topology
 * @property {Uint32Array} faces (T, 3) over V vertices, flat @property {Int32Array} point (V) the point of each vertex
 * @property {Uint32Array} pointFaces (T, 3) the same triangles over points, flat @property {number} pointCount P
 *
 * @param {import("../wasm/kernels.js").Kernels} kernels
 * @param {Uint8Array} mesh @param {Uint8Array} order sections
 * @param {{vertices: number, triangles: number}} header what it must be
 * @returns {Promise<Topology>}
 * @throws {GeometryVideoError} the sections do not hold what the header says
 */
export async function decodeTopology(kernels, mesh, order, { vertices, triangles }) {
  const cursor = new Cursor(mesh, "mesh");
  const [draco, merges, loose, counts, nLoose, pointCount] = Array.from({ length: 6 }, () => cursor.u32());
  if (pointCount > Math.min(MAX_VERTICES, vertices) || nLoose > Math.min(triangles, MAX_PER_BYTE * mesh.length)) {
    throw cursor.corrupt(`${pointCount} points and ${nLoose} loose triangles in ${mesh.length} bytes`);
  }
  const parts = [draco, merges, loose].map((length) => cursor.take(length));
  const pointFaces = await decodeTriangles(...parts, nLoose, pointCount, triangles);
  const { faces, point } = decodeCopies(kernels, cursor.take(counts), cursor.rest(), order, pointFaces, pointCount, false);
  if (point.length !== vertices || faces.length !== 3 * triangles) {
    const found = `${point.length} vertices and ${faces.length / 3} triangles`;
    throw new GeometryVideoError("corrupt", `the mesh has ${found}, the header says ${vertices} and ${triangles}; ${AGAIN}`);
  }
  return { faces, point, pointFaces, pointCount };
}

/**
 * @param {Uint8Array} draco @param {Uint8Array} merges @param {Uint8Array} loose streams
 * @param {number} nLoose triangles in the last @param {number} nPoints P
 * @param {number} most triangles
 * @returns {Promise<Uint32Array>} (T, 3), flat: Draco's with its split vertices merged, smallest point first, then the loose ones
 */
export async function decodeTriangles(draco, merges, loose, nLoose, nPoints, most) {
  const carried = draco.length ? await decodeDracoTriangles(draco, most) : { nVertices: 0, faces: new Uint32Array(0) };
  const merged = smallestFirst(merge(carried, merges));
  const others = await decodeTable(loose, nLoose);
  const faces = new Uint32Array(merged.length + others.length);
  faces.set(merged);
  faces.set(others, merged.length);
  if (faces.some((point) => point >= nPoints)) throw corrupt("mesh", "a triangle names a point that does not exist");
  return faces;
}

/** Draco's triangles over points: vertices that it split are one point again. */
function merge({ nVertices, faces }, merges) {
  if (!merges.length) return faces;
  const cursor = new Cursor(merges, "mesh");
  const n = cursor.varint(nVertices, "the number of merges");
  const values = decodeIntegers(cursor.rest(), 2 * n, null, "mesh");
  const standsFor = new Int32Array(nVertices).fill(-1);
  for (let i = 0, again = -1; i < n; i++) {
    again += values[i] + 1;
    const other = again - values[n + i];
    if (values[i] < 0 || again >= nVertices || other < 0 || other >= again || standsFor[other] >= 0) {
      throw cursor.corrupt("a merge names a vertex that does not exist");
    }
    standsFor[again] = other;
  }
  const number = new Int32Array(nVertices);
  for (let v = 0, count = 0; v < nVertices; v++) number[v] = standsFor[v] < 0 ? count++ : number[standsFor[v]];
  return faces.map((vertex) => number[vertex]);
}

/** Rotate each triangle so that its smallest index leads; winding stays. */
export function smallestFirst(faces) {
  const turned = new Uint32Array(faces.length);
  for (let i = 0; i < faces.length; i += 3) {
    const [a, b, c] = [faces[i], faces[i + 1], faces[i + 2]];
    if (a <= b && a <= c) turned.set([a, b, c], i);
    else if (b <= c) turned.set([b, c, a], i);
    else turned.set([c, a, b], i);
  }
  return turned;
}
