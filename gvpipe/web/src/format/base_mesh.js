/**
 * Triangles and base-frame lattice points. Mirrors `gvpipe.connectivity.base_mesh.decode_base`; `docs/format.md`, section 4: what Draco
 * carries, then the loose vertices and triangles beside it.
 */

import { VERTEX_ORDER_MAX_VERTICES as MAX_VERTICES } from "../constants.js";
import { Cursor } from "./cursor.js";
import { decodeDraco } from "./draco.js";
import { AGAIN, GeometryVideoError, corrupt } from "./errors.js";
import { inflate } from "./inflate.js";
import { previousEqual } from "./points.js";

/**
 * @typedef {object} BaseMesh
 * @property {Int32Array} points (P, 3) lattice units, flat, in the codec's order
 * @property {Uint32Array} faces (T, 3) flat
 *
 * @param {Uint8Array} mesh stream
 * @param {{vertices: number, triangles: number}} most of the header
 * @returns {Promise<BaseMesh>}
 */
export async function decodeBase(mesh, most) {
  const cursor = new Cursor(mesh, "mesh");
  const [bytesDraco, looseVertices, looseFaces, bytesVertices] = [cursor.u32(), cursor.u32(), cursor.u32(), cursor.u32()];
  if (looseVertices > most.vertices || looseFaces > most.triangles) {
    throw cursor.corrupt(`${looseVertices} loose vertices and ${looseFaces} loose triangles, more than the header says`);
  }
  const draco = cursor.take(bytesDraco);
  const carried = bytesDraco ? merge(await decodeDraco(draco, most.triangles)) : { points: [], faces: [] };
  const points = join(Int32Array, carried.points, await decodeTable(cursor.take(bytesVertices), looseVertices));
  const faces = join(Uint32Array, carried.faces, await decodeTable(cursor.rest(), looseFaces));
  const n = points.length / 3;
  if (n > MAX_VERTICES) throw cursor.corrupt(`${n} vertices, at most ${MAX_VERTICES}`);
  if (points.some((c) => c < 0)) throw cursor.corrupt("lattice coordinate out of range");
  if (faces.some((vertex) => vertex >= n)) throw cursor.corrupt("a triangle names a vertex that does not exist");
  return { points, faces };
}

/** Draco splits vertices; those with equal keys are one, numbered by first appearance. */
function merge({ keys, faces }) {
  const previous = previousEqual(keys, 4);
  const vertex = new Uint32Array(previous.length);
  const points = [];
  for (let i = 0; i < previous.length; i++) {
    if (previous[i] >= 0) {
      vertex[i] = vertex[previous[i]];
    } else {
      vertex[i] = points.length / 3;
      points.push(keys[4 * i], keys[4 * i + 1], keys[4 * i + 2]);
    }
  }
  return { points, faces: faces.map((i) => vertex[i]) };
}

/** Rows of three integers: deflated byte planes of row differences. */
export async function decodeTable(data, rows) {
  if (rows === 0) {
    if (data.length) throw corrupt("mesh", "bytes of loose rows where there are none");
    return new Float64Array(0);
  }
  const planes = await inflate(data, 12 * rows, (what) => corrupt("mesh", `loose rows: ${what}`));
  if (planes.length !== 12 * rows) {
    throw corrupt("mesh", `${planes.length} bytes of loose rows, expected ${12 * rows}`);
  }
  const table = new Float64Array(3 * rows);
  for (let axis = 0; axis < 3; axis++) {
    const byte = (k, row) => planes[(4 * axis + k) * rows + row];
    for (let row = 0, sum = 0; row < rows; row++) {
      sum += byte(0, row) | (byte(1, row) << 8) | (byte(2, row) << 16) | (byte(3, row) << 24);
      if (sum < 0 || sum >= 2 ** 31) throw corrupt("mesh", "a loose row is out of range");
      table[3 * row + axis] = sum;
    }
  }
  return table;
}

function join(Type, first, second) {
  const joined = new Type(first.length + second.length);
  joined.set(first);
  joined.set(second, first.length);
  return joined;
}

/** Throw unless a mesh has the header's vertices and triangles. */
export function checkCounts({ vertices, triangles }, n, faces) {
  if (n !== vertices || faces.length !== 3 * triangles) {
    throw new GeometryVideoError("corrupt", `the mesh has other counts than the header says; ${AGAIN}`);
  }
}
