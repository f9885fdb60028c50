/**
 * Triangles and lattice positions of points, positions by adaptive contexts. Mirrors `gvpipe.connectivity.adaptive_mesh` and
 * `position_kernels`; `docs/format.md`, section 5.9.
 */

import { orderByCorners } from "../attributes/entry_order.js";
import { oppositeCorners } from "../attributes/corners.js";
import {
  ADAPTIVE_MESH_MAX_POINTS as MAX_POINTS,
  BASE_MESH_MAX_PER_BYTE as MAX_PER_BYTE,
  POSITION_KERNELS_LONG_RUN as LONG_RUN,
  POSITION_KERNELS_MATCHED as MATCHED,
  POSITION_KERNELS_MATCH_BITS as MATCH_BITS,
  POSITION_KERNELS_MAX_RUN as MAX_RUN,
  POSITION_KERNELS_N_CONTEXTS as N_CONTEXTS,
  POSITION_KERNELS_N_GROUPS as N_GROUPS,
} from "../constants.js";
import { Cursor } from "./cursor.js";
import { NumberDecoder, mixHash } from "./decisions.js";
import { decodeTriangles } from "./topology_only.js";

/**
 * @param {Uint8Array} stream
 * @param {{vertices: number, triangles: number}} most of the header
 * @returns {Promise<{points: Int32Array, faces: Uint32Array}>} (P, 3) lattice units, and (T, 3) triangles over them, flat
 */
export async function decodeAdaptiveMesh(stream, most) {
  const cursor = new Cursor(stream, "mesh");
  const nPoints = cursor.varint(Math.min(MAX_POINTS, most.vertices), "the number of points");
  const [draco, merges, loose] = [cursor.block(), cursor.block(), cursor.block()];
  const nLoose = cursor.varint(Math.min(MAX_PER_BYTE * stream.length, most.triangles), "the number of loose triangles");
  const faces = await decodeTriangles(draco, merges, loose, nLoose, nPoints);
  return { points: decodePositions(cursor, faces, nPoints), faces };
}

function decodePositions(cursor, faces, n) {
  const { order, starts, gates } = orderByCorners(faces, oppositeCorners(faces), n);
  const decoder = new NumberDecoder(cursor.rest(), N_CONTEXTS, N_GROUPS);
  const positions = new Int32Array(3 * n);
  const residuals = new Float64Array(3 * (n + MATCHED)); // in their order, behind zeros
  const byEntry = new Float64Array(3 * n);
  const latest = new Int32Array(2 ** MATCH_BITS).fill(-1);
  const contexts = new Float64Array(N_CONTEXTS);
  const known = { order, starts, gates, positions };
  const hashed = (row) => mixHash(mixHash(residuals[3 * row], residuals[3 * row + 1]), residuals[3 * row + 2]);
  for (let i = 0, match = -1, run = 0; i < n; i++) {
    const entry = order[i];
    const row = i + MATCHED;
    if (match < 0) run = 0;
    const last = hashed(row - 1);
    const pair = mixHash(last, hashed(row - 2));
    const first = starts[i];
    let fits = true;
    let size = 0;
    for (let c = 0; c < 3; c++) {
      const { guess, mean } = predict(known, i, c);
      let before = mixHash(c, 0);
      for (let k = 0; k < c; k++) before = mixHash(before, residuals[3 * row + k]);
      let [a, b] = [guess, guess];
      if (first < starts[i + 1]) {
        a = positions[3 * gates[4 * first] + c];
        b = gates[4 * first + 1] >= 0 ? positions[3 * gates[4 * first + 1] + c] : a;
      }
      const near = nearClass(known, i, byEntry, c);
      const isExpected = match >= 0 && fits;
      const apart = mean - guess;
      contexts[0] = mixHash(1 + 3 * near + c, 64 + Math.min(starts[i + 1] - first, 3));
      contexts[1] = mixHash(mixHash(17 + c, near), bitLength(size));
      contexts[2] = mixHash(mixHash(2 + c, residuals[3 * row - 3 + c]), bitLength(size));
      contexts[3] = mixHash(mixHash(5 + c, a - guess), b - guess);
      contexts[4] = mixHash(8 + c, guess);
      contexts[5] = mixHash(before, pair);
      contexts[6] = mixHash(mixHash(14 + c, 2 * bitLength(Math.abs(apart)) + (apart < 0 ? 1 : 0)), near >> 2);
      contexts[7] = mixHash(mixHash(11 + c, isExpected ? residuals[3 * match + c] : 0), isExpected ? run : -1);
      const group = 3 * c + (!isExpected ? 0 : run < LONG_RUN ? 1 : 2);
      const residual = decoder.number(contexts, group, true);
      const position = guess + residual;
      if (!(position >= 0 && position < 2 ** 31)) throw cursor.corrupt("its decisions name no positions");
      positions[3 * entry + c] = position;
      if (match >= 0 && residual !== residuals[3 * match + c]) fits = false;
      residuals[3 * row + c] = residual;
      byEntry[3 * entry + c] = residual;
      size += Math.abs(residual);
    }
    run = match >= 0 && fits ? Math.min(run + 1, MAX_RUN) : 0;
    const place = mixHash(hashed(row), last) >>> (32 - MATCH_BITS);
    if (match >= 0 && fits) match++;
    else match = latest[place] >= 0 ? latest[place] + 1 : -1;
    latest[place] = row;
  }
  if (!decoder.isAtEnd) throw cursor.corrupt("its decisions name no positions");
  return positions;
}

/** The prediction of a coordinate of entry i of the order, and the mean of its neighbours. */
function predict({ order, starts, gates, positions }, i, c) {
  let [total, n, around, m] = [0, 0, 0, 0];
  for (let g = starts[i]; g < starts[i + 1]; g++) {
    const [a, b, o] = [gates[4 * g], gates[4 * g + 1], gates[4 * g + 2]];
    around += positions[3 * a + c];
    m++;
    if (b < 0) continue;
    around += positions[3 * b + c];
    m++;
    if (o < 0) continue;
    total += positions[3 * a + c] + positions[3 * b + c] - positions[3 * o + c];
    n++;
  }
  if (m === 0 && i > 0) [around, m] = [positions[3 * order[i - 1] + c], 1];
  const mean = m ? Math.floor((2 * around + m) / (2 * m)) : 0;
  return { mean, guess: n ? Math.floor((2 * total + n) / (2 * n)) : mean };
}

/** A class, 0..31, of the mean magnitude of the neighbours' residuals. */
function nearClass({ starts, gates }, i, byEntry, c) {
  let [total, n] = [0, 0];
  for (let g = starts[i]; g < starts[i + 1]; g++) {
    for (let k = 0; k < 2; k++) {
      const other = gates[4 * g + k];
      if (other < 0) continue;
      total += Math.abs(byEntry[3 * other + c]);
      n++;
    }
  }
  if (n === 0) return 31;
  const mean = Math.floor((4 * total) / n);
  const length = bitLength(mean);
  const second = length > 1 ? Math.floor(mean / 2 ** (length - 2)) % 2 : 0;
  return Math.min(2 * length + second, 30);
}

function bitLength(value) {
  let length = 0;
  while (Math.floor(value / 2 ** length)) length++;
  return length;
}
