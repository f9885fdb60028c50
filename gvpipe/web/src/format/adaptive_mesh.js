/**
 * Triangles and lattice positions of points, positions by adaptive contexts. Mirrors `gvpipe.connectivity.adaptive_mesh`;
 * `docs/format.md`, section 5.9.
 */

import { oppositeCorners } from "../attributes/corners.js";
import {
  ADAPTIVE_MESH_MAX_POINTS as MAX_POINTS,
  BASE_MESH_MAX_PER_BYTE as MAX_PER_BYTE,
  FITTED_KERNELS_N_CONTEXTS as N_FITTED_CONTEXTS,
  FITTED_KERNELS_N_GROUPS as N_FITTED_GROUPS,
  POSITION_KERNELS_N_CONTEXTS as N_CONTEXTS,
  POSITION_KERNELS_N_GROUPS as N_GROUPS,
} from "../constants.js";
import { Cursor } from "./cursor.js";
import { DecisionStream, newForecastMixing, newNumberMixing } from "./decisions.js";
import { decodeTriangles } from "./topology_only.js";

/**
 * @param {import("../wasm/kernels.js").Kernels} kernels @param {Uint8Array} stream
 * @param {{vertices: number, triangles: number}} most of the header @param {boolean} isFitted false: contexts alone
 * @returns {Promise<{points: Int32Array, faces: Uint32Array}>} (P, 3) lattice units, and (T, 3) triangles over them, flat
 */
export async function decodeAdaptiveMesh(kernels, stream, most, isFitted) {
  const cursor = new Cursor(stream, "mesh");
  const nPoints = cursor.varint(Math.min(MAX_POINTS, most.vertices), "the number of points");
  const [draco, merges, loose] = [cursor.block(), cursor.block(), cursor.block()];
  const nLoose = cursor.varint(Math.min(MAX_PER_BYTE * stream.length, most.triangles), "the number of loose triangles");
  const faces = await decodeTriangles(draco, merges, loose, nLoose, nPoints, most.triangles);
  return { points: decodePositions(kernels, cursor, faces, nPoints, isFitted), faces };
}

function decodePositions(kernels, cursor, faces, n, isFitted) {
  const own = kernels.fresh();
  const stream = new DecisionStream(own, cursor.rest());
  const triangles = own.array("int32", [faces.length / 3, 3], faces);
  const opposite = own.array("int64", [faces.length], BigInt64Array.from(oppositeCorners(faces), BigInt));
  const order = own.call("order_by_corners", triangles, opposite, n);
  const positions = own.array("int64", [n, 3]);
  const mixing = isFitted ? newForecastMixing(own, N_FITTED_CONTEXTS, N_FITTED_GROUPS) : newNumberMixing(own, N_CONTEXTS, N_GROUPS);
  const known = isFitted ? [...order, triangles, opposite, ...mixing] : [...order, ...mixing];
  const [fits] = own.call(isFitted ? "code_fitted" : "code_positions", ...known, ...stream.arrays, true, positions);
  if (!fits || !stream.isAtEnd) throw cursor.corrupt("its decisions name no positions");
  const words = own.words(positions);
  return Int32Array.from({ length: 3 * n }, (_, i) => words[2 * i]);
}
