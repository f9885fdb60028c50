/** Vertex normals for smooth shading, fast enough for every frame. */

import { previousEqual } from "../format/points.js";

const CREASE = Math.cos(Math.PI / 3); // vertices at one point whose normals differ by more stay apart: a hard edge

/** Normals of one mesh. Files split vertices at seams; those that meet smoothly share a normal, so that no seam shows. */
export class Normals {
  /**
   * @param {Uint32Array} indices (T, 3)
   * @param {Int32Array} basePoints (V, 3) equal rows are one point
   * @param {Float32Array} positions (V, 3) of some frame
   */
  constructor(indices, basePoints, positions) {
    this.indices = indices;
    this.groups = Uint32Array.from({ length: positions.length / 3 }, (_, v) => v);
    this.sums = new Float64Array(positions.length);
    this.#groupSmooth(previousEqual(basePoints, 3), positions);
  }

  /** Fill `normals (V, 3)`, of unit length, for `positions (V, 3)`. */
  compute(positions, normals) {
    const { indices, groups, sums } = this;
    sums.fill(0);
    for (let i = 0; i < indices.length; i += 3) {
      const [a, b, c] = [3 * indices[i], 3 * indices[i + 1], 3 * indices[i + 2]];
      const [ux, uy, uz] = [
        positions[b] - positions[a],
        positions[b + 1] - positions[a + 1],
        positions[b + 2] - positions[a + 2],
      ];
      const [vx, vy, vz] = [
        positions[c] - positions[a],
        positions[c + 1] - positions[a + 1],
        positions[c + 2] - positions[a + 2],
      ];
      const [x, y, z] = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx]; // as long as twice the area
      for (let corner = 0; corner < 3; corner++) {
        const sum = 3 * groups[indices[i + corner]];
        sums[sum] += x;
        sums[sum + 1] += y;
        sums[sum + 2] += z;
      }
    }
    for (let v = 0; v < groups.length; v++) {
      const sum = 3 * groups[v];
      const [x, y, z] = [sums[sum], sums[sum + 1], sums[sum + 2]];
      const scale = 1 / (Math.sqrt(x * x + y * y + z * z) || 1);
      normals[3 * v] = x * scale;
      normals[3 * v + 1] = y * scale;
      normals[3 * v + 2] = z * scale;
    }
  }

  #groupSmooth(previous, positions) {
    if (!previous.some((twin) => twin >= 0)) return;
    const normals = new Float32Array(positions.length);
    this.compute(positions, normals); // every vertex still on its own
    const groups = this.groups.slice();
    for (let v = 0; v < previous.length; v++) {
      for (let twin = previous[v]; twin >= 0; twin = previous[twin]) {
        let cosine = 0;
        for (let axis = 0; axis < 3; axis++) cosine += normals[3 * v + axis] * normals[3 * twin + axis];
        if (cosine > CREASE) {
          groups[v] = groups[twin];
          break;
        }
      }
    }
    this.groups = groups;
  }
}
