/** Vertex normals for smooth shading, fast enough for every frame. */

import { previousEqual } from "../format/points.js";

const CREASE = Math.cos(Math.PI / 3); // vertices at one point whose normals differ by more stay apart: a hard edge
const SAME = Math.cos(Math.PI / 60); // coded normals of one edge differ by less, each by its bound

/** Normals of one mesh, computed from the positions of a frame. Corners of one group share a normal, the mean by area. */
export class Normals {
  /**
   * @param {Uint32Array} indices (3T) vertex of each corner
   * @param {Uint32Array} groups (3T) group of each corner
   * @param {Uint32Array} shown (R) group of each normal that is wanted
   */
  constructor(indices, groups, shown) {
    this.indices = indices;
    this.groups = groups;
    this.shown = shown;
    let count = 0;
    for (let c = 0; c < groups.length; c++) count = Math.max(count, groups[c] + 1);
    for (let r = 0; r < shown.length; r++) count = Math.max(count, shown[r] + 1);
    this.sums = new Float64Array(3 * count);
  }

  /** Fill `normals (R, 3)`, of unit length, for `positions (V, 3)`. */
  compute(positions, normals) {
    const { indices, groups, sums, shown } = this;
    sums.fill(0);
    for (let i = 0; i < indices.length; i += 3) {
      const a = 3 * indices[i];
      const b = 3 * indices[i + 1];
      const c = 3 * indices[i + 2];
      const ux = positions[b] - positions[a];
      const uy = positions[b + 1] - positions[a + 1];
      const uz = positions[b + 2] - positions[a + 2];
      const vx = positions[c] - positions[a];
      const vy = positions[c + 1] - positions[a + 1];
      const vz = positions[c + 2] - positions[a + 2];
      const x = uy * vz - uz * vy; // (x, y, z) is as long as twice the area
      const y = uz * vx - ux * vz;
      const z = ux * vy - uy * vx;
      for (let corner = i; corner < i + 3; corner++) {
        const sum = 3 * groups[corner];
        sums[sum] += x;
        sums[sum + 1] += y;
        sums[sum + 2] += z;
      }
    }
    for (let r = 0; r < shown.length; r++) {
      const sum = 3 * shown[r];
      const x = sums[sum];
      const y = sums[sum + 1];
      const z = sums[sum + 2];
      const scale = 1 / (Math.sqrt(x * x + y * y + z * z) || 1);
      normals[3 * r] = x * scale;
      normals[3 * r + 1] = y * scale;
      normals[3 * r + 2] = z * scale;
    }
  }
}

/**
 * Groups for a mesh without normals of its own. Files split vertices at seams; those that meet smoothly share a normal, so that no
 * seam shows.
 *
 * @param {Uint32Array} indices (3T)
 * @param {Int32Array} basePoints (V, 3) equal rows are one point
 * @param {Float32Array} positions (V, 3) of some frame
 * @returns {Uint32Array} (V) group of each vertex
 */
export function groupVertices(indices, basePoints, positions) {
  const groups = Uint32Array.from({ length: positions.length / 3 }, (_, v) => v);
  const previous = previousEqual(basePoints, 3);
  if (!previous.some((twin) => twin >= 0)) return groups;
  const normals = new Float32Array(positions.length);
  new Normals(indices, indices, groups.slice()).compute(positions, normals); // every vertex still on its own
  join(groups, previous, normals, CREASE);
  return groups;
}

/**
 * Groups for a mesh whose corners have normals: those at one point of the surface whose normals are the same share one in every
 * frame, so that hard edges stay hard and smooth ones smooth.
 *
 * @param {Uint32Array} indices (3T)
 * @param {Int32Array} basePoints (V, 3) equal rows are one point
 * @param {Uint32Array} entries (3T) which of the values each corner has
 * @param {Float32Array} values (N, 3) unit normals
 * @returns {Uint32Array} (3T) group of each corner
 */
export function groupCorners(indices, basePoints, entries, values) {
  const pairs = new Int32Array(2 * indices.length); // (vertex, value) of each corner
  for (let c = 0; c < indices.length; c++) pairs.set([indices[c], entries[c]], 2 * c);
  const previousPair = previousEqual(pairs, 2);
  const first = new Int32Array(indices.length).fill(-1); // of the pair's corners
  const points = [];
  const distinct = [];
  for (let c = 0; c < indices.length; c++) {
    if (previousPair[c] >= 0) {
      first[c] = first[previousPair[c]];
      continue;
    }
    first[c] = distinct.length;
    distinct.push(entries[c]);
    const v = 3 * indices[c];
    points.push(basePoints[v], basePoints[v + 1], basePoints[v + 2]);
  }
  const groups = Uint32Array.from(distinct, (_, i) => i);
  const normals = new Float32Array(3 * distinct.length);
  distinct.forEach((entry, i) => normals.set(values.subarray(3 * entry, 3 * entry + 3), 3 * i));
  join(groups, previousEqual(points, 3), normals, SAME);
  return Uint32Array.from(first, (pair) => groups[pair]);
}

const LOOK = 64; // twins that are compared: meshes have few, files made to hang a page have many

/** Give each item the group of the latest item at its point whose normal is near enough. */
function join(groups, previous, normals, cosine) {
  for (let i = 0; i < groups.length; i++) {
    for (let twin = previous[i], looked = 0; twin >= 0 && looked < LOOK; twin = previous[twin], looked++) {
      const dot =
        normals[3 * i] * normals[3 * twin] +
        normals[3 * i + 1] * normals[3 * twin + 1] +
        normals[3 * i + 2] * normals[3 * twin + 2];
      if (dot > cosine) {
        groups[i] = groups[twin];
        break;
      }
    }
  }
}
