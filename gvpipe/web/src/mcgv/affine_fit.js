/** Piecewise affine prediction from the decoded base frame. Mirrors `gvcodecs.mcgv.motion.affine_fit`. */

export class AffinePredictor {
  /**
   * @param {Float64Array} base (S, 3) base frame, model units, flat
   * @param {Uint16Array} clusters (S) cluster of each slot
   * @param {number} nClusters K; a cluster may be empty
   */
  constructor(base, clusters, nClusters) {
    this.clusters = clusters;
    this.rest = new Float64Array(12 * nClusters); // (K, 4, 3): the transforms that leave the base frame as it is
    this.coordinates = new Float64Array(base.length); // (S, 3) in the frame of the slot's cluster, at most 1 long
    const centres = middles(base, clusters, nClusters);
    const radii = new Float64Array(nClusters);
    clusters.forEach((k, v) => {
      const away = [0, 1, 2].map((axis) => base[3 * v + axis] - centres[3 * k + axis]);
      radii[k] = Math.max(radii[k], Math.sqrt(away[0] ** 2 + away[1] ** 2 + away[2] ** 2));
    });
    clusters.forEach((k, v) => {
      for (let axis = 0; axis < 3; axis++) {
        this.coordinates[3 * v + axis] = (base[3 * v + axis] - centres[3 * k + axis]) / (radii[k] || 1);
      }
    });
    for (let k = 0; k < nClusters; k++) {
      for (let axis = 0; axis < 3; axis++) {
        this.rest[12 * k + 4 * axis] = radii[k];
        this.rest[12 * k + 9 + axis] = centres[3 * k + axis];
      }
    }
  }

  /**
   * @param {Float64Array} transforms (K, 4, 3) of one frame, flat
   * @param {Float64Array} positions (S, 3) filled, model units, flat
   */
  predict(transforms, positions) {
    const { clusters, coordinates } = this;
    for (let v = 0, i = 0; v < clusters.length; v++, i += 3) {
      const row = 12 * clusters[v];
      const [x, y, z] = [coordinates[i], coordinates[i + 1], coordinates[i + 2]];
      for (let axis = 0; axis < 3; axis++) {
        const t = row + axis;
        positions[i + axis] = x * transforms[t] + y * transforms[t + 3] + z * transforms[t + 6] + transforms[t + 9];
      }
    }
  }

  /**
   * The box that the predictions of frames stay in, without a look at any slot: a cluster lies in a ball and in a box about
   * its centre, and each moves with it.
   *
   * @param {Float64Array} transforms (frames, K, 4, 3) flat
   * @param {{min: number[], max: number[]}} bounds made larger where needed
   */
  extend(bounds, transforms) {
    const half = new Float64Array(this.rest.length / 4).fill(-1); // (K, 3) half sides of the clusters' boxes; -1: empty
    this.clusters.forEach((k, v) => {
      for (let j = 0; j < 3; j++) half[3 * k + j] = Math.max(half[3 * k + j], Math.abs(this.coordinates[3 * v + j]));
    });
    for (let row = 0; row < transforms.length; row += 12) {
      const k = (row / 12) % (half.length / 3);
      if (half[3 * k] < 0) continue;
      for (let axis = 0; axis < 3; axis++) {
        const images = [0, 1, 2].map((j) => Math.abs(transforms[row + 3 * j + axis]));
        const box = images.reduce((sum, image, j) => sum + image * half[3 * k + j], 0);
        const reach = Math.min(Math.hypot(...images), box);
        const centre = transforms[row + 9 + axis];
        bounds.min[axis] = Math.min(bounds.min[axis], centre - reach);
        bounds.max[axis] = Math.max(bounds.max[axis], centre + reach);
      }
    }
  }
}

/** (K, 3) middles of the clusters' bounding boxes; 0 for empty ones. */
function middles(base, clusters, nClusters) {
  const low = new Float64Array(3 * nClusters).fill(Infinity);
  const high = new Float64Array(3 * nClusters).fill(-Infinity);
  clusters.forEach((k, v) => {
    for (let axis = 0; axis < 3; axis++) {
      low[3 * k + axis] = Math.min(low[3 * k + axis], base[3 * v + axis]);
      high[3 * k + axis] = Math.max(high[3 * k + axis], base[3 * v + axis]);
    }
  });
  return low.map((value, i) => (value <= high[i] ? (value + high[i]) / 2 : 0));
}
