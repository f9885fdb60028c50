/**
 * Blended prediction: points follow weighted means of up to four clusters' affine motions. Mirrors `gvcodecs.mcgv.motion.skinning`.
 *
 * A point at p with homogeneous coordinates y is predicted at `p + sum of w_k y @ T_k`; the file holds rows of equal weight,
 * `C_k = L_k^T T_k`, where L_k is the Cholesky factor of the energy that the cluster's rows cause.
 */

import {
  BLEND_KERNELS_FLAT as FLAT,
  SKINNING_INFLUENCES as INFLUENCES,
  BLEND_KERNELS_LEAST_ENERGY as LEAST_ENERGY,
  SKINNING_TOTAL as TOTAL,
} from "../constants.js";

export class Blend {
  /**
   * @param {Float64Array} base (P, 3) base positions, model units, flat
   * @param {import("./weight_coding.js").Weights} weights of the points
   * @param {number} nClusters K
   */
  constructor(base, weights, nClusters) {
    this.base = base;
    this.clusters = weights.clusters;
    this.parts = Float64Array.from(weights.weights, (weight) => weight / TOTAL);
    this.coordinates = homogeneous(base); // (P, 3): the fourth is 1
    /** Of the transforms' rows, once a segment has asked for it. @type {import("../trajectory/causal_order.js").CausalOrder | undefined} */
    this.rowOrder = undefined;
    this.factors = new Float64Array(16 * nClusters); // (K, 4, 4) lower triangles, flat
    this.#addEnergies();
    for (let at = 0; at < this.factors.length; at += 16) factorise(this.factors.subarray(at, at + 16));
  }

  #addEnergies() {
    const y = [0, 0, 0, 1];
    for (let i = 0; i < this.parts.length; i++) {
      const square = this.parts[i] ** 2;
      if (square === 0) continue;
      const point = 3 * Math.floor(i / INFLUENCES);
      const at = 16 * this.clusters[i];
      for (let r = 0; r < 3; r++) y[r] = this.coordinates[point + r];
      for (let r = 0; r < 4; r++) for (let c = 0; c <= r; c++) this.factors[at + 4 * r + c] += square * y[r] * y[c];
    }
  }

  /** Transforms (K, 4, 3) in model units for rows (K, 4, 3) of equal weight, flat, in their place. */
  transforms(rows) {
    const { factors } = this;
    for (let k = 0; 12 * k < rows.length; k++) {
      for (let axis = 0; axis < 3; axis++) {
        for (let r = 3; r >= 0; r--) {
          let value = rows[12 * k + 3 * r + axis];
          for (let j = r + 1; j < 4; j++) value -= factors[16 * k + 4 * j + r] * rows[12 * k + 3 * j + axis];
          rows[12 * k + 3 * r + axis] = value / factors[16 * k + 5 * r];
        }
      }
    }
    return rows;
  }

  /**
   * @param {Float64Array} transforms (K, 4, 3) of one frame, flat
   * @param {Float64Array} positions (P, 3) filled
   */
  predict(transforms, positions) {
    const { base, clusters, parts, coordinates } = this;
    for (let i = 0, slot = 0; i < base.length; i += 3, slot += INFLUENCES) {
      const x = coordinates[i];
      const y = coordinates[i + 1];
      const z = coordinates[i + 2];
      let atX = base[i];
      let atY = base[i + 1];
      let atZ = base[i + 2];
      for (let j = slot; j < slot + INFLUENCES; j++) {
        const part = parts[j];
        if (part === 0) break;
        const t = 12 * clusters[j];
        atX += part * (x * transforms[t] + y * transforms[t + 3] + z * transforms[t + 6] + transforms[t + 9]);
        atY += part * (x * transforms[t + 1] + y * transforms[t + 4] + z * transforms[t + 7] + transforms[t + 10]);
        atZ += part * (x * transforms[t + 2] + y * transforms[t + 5] + z * transforms[t + 8] + transforms[t + 11]);
      }
      positions[i] = atX;
      positions[i + 1] = atY;
      positions[i + 2] = atZ;
    }
  }
}

/** (P, 3) coordinates in the middle of the bounding box, in parts of its longest side. */
export function homogeneous(base) {
  const low = [Infinity, Infinity, Infinity];
  const high = [-Infinity, -Infinity, -Infinity];
  base.forEach((value, i) => {
    low[i % 3] = Math.min(low[i % 3], value);
    high[i % 3] = Math.max(high[i % 3], value);
  });
  const extent = Math.max(...high.map((value, axis) => value - low[axis])) || 1;
  return base.map((value, i) => (value - (low[i % 3] + high[i % 3]) / 2) / extent);
}

/** The Cholesky factor of an energy (4, 4), in its place: lower triangles. */
function factorise(a) {
  const lift = FLAT * (a[0] + a[5] + a[10] + a[15]) + LEAST_ENERGY;
  for (let r = 0; r < 4; r++) {
    for (let c = 0; c <= r; c++) {
      let value = a[4 * r + c] + (r === c ? lift : 0);
      for (let j = 0; j < c; j++) value -= a[4 * r + j] * a[4 * c + j];
      a[4 * r + c] = r === c ? Math.sqrt(value) : value / a[5 * c];
    }
  }
}
