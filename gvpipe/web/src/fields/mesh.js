/** The mesh under fields: in which order rows are coded, and which rows predict each. Mirrors `gvpipe.fields.mesh`. */

import {
  HIERARCHY_MAX_WAVES as MAX_WAVES,
  SPATIAL_NEIGHBOURS_FAR_VARIANCE as FAR_VARIANCE,
  SPATIAL_NEIGHBOURS_LEAST as LEAST,
  SPATIAL_NEIGHBOURS_OVERSHOOT as OVERSHOOT,
  SPATIAL_NEIGHBOURS_RING_VARIANCE as RING_VARIANCE,
  SPATIAL_NEIGHBOURS_SURE as SURE,
} from "../constants.js";

/**
 * @typedef {object} RowOrder of R rows
 * @property {Int32Array} order (R) rows
 * @property {Int32Array} starts (R + 1) bounds of each row's causal neighbours in `neighbours`
 * @property {Int32Array} neighbours rows, each earlier in `order`
 * @property {Float64Array} weights @property {Float64Array} variances prior means and variances of the neighbours' weights
 * @property {Int32Array} ringSizes (R) how many of the first neighbours are a ring around the row
 *
 * @param {import("../wasm/kernels.js").Kernels} kernels
 * @param {Int32Array} faces (3T) vertices @param {number} nVertices @param {"vertex"|"triangle"} domain
 * @returns {RowOrder}
 */
export function rowOrder(kernels, faces, nVertices, domain) {
  if (domain === "vertex") return hierarchyOrder(kernels, faces, nVertices);
  const [dual] = kernels.call("find_dual", kernels.array("int32", [faces.length / 3, 3], faces), nVertices);
  return hierarchyOrder(kernels, kernels.view(dual).slice(), faces.length / 3);
}

/** Mirrors `build_hierarchy` of `gvpipe.mesh.hierarchy` and `hierarchy_order` of `gvpipe.trajectory.spatial_neighbours`. */
function hierarchyOrder(kernels, faces, nRows) {
  const proper = faces.filter((_, c) => hasThree(faces, c - (c % 3)));
  const mesh = kernels.array("int32", [proper.length / 3, 3], proper);
  const [left, ...fine] = kernels.call("decimate", mesh, nRows, MAX_WAVES).reverse();
  const [rings, neighbours, starts, , order] = fine.map((array) => kernels.view(array).slice());
  const isGone = new Uint8Array(nRows);
  for (const row of order) isGone[row] = 1;
  const seeds = Int32Array.from({ length: nRows }, (_, row) => row).filter((row) => !isGone[row]);
  const coarse = kernels.call("traverse", left, kernels.array("int32", [seeds.length], seeds), nRows);
  const [first, firstStarts, firstNeighbours] = coarse.map((array) => kernels.view(array).slice());
  const result = {
    order: new Int32Array(nRows),
    starts: new Int32Array(nRows + 1),
    neighbours: new Int32Array(firstNeighbours.length + neighbours.length),
    ringSizes: new Int32Array(nRows),
  };
  result.order.set(first);
  result.starts.set(firstStarts);
  result.neighbours.set(firstNeighbours);
  const isBoundary = new Uint8Array(nRows); // by rank
  for (let rank = first.length; rank < nRows; rank++) {
    const i = nRows - 1 - rank; // backwards: what left last comes first
    result.order[rank] = order[i];
    result.neighbours.set(neighbours.subarray(starts[i], starts[i + 1]), result.starts[rank]);
    result.starts[rank + 1] = result.starts[rank] + starts[i + 1] - starts[i];
    result.ringSizes[rank] = Math.abs(rings[i]);
    isBoundary[rank] = rings[i] < 0 ? 1 : 0;
  }
  return { ...result, ...priors(result, isBoundary) };
}

/** The neighbours' weights before anything is learnt. */
function priors({ starts, ringSizes }, isBoundary) {
  const weights = new Float64Array(starts[ringSizes.length]);
  const variances = new Float64Array(weights.length);
  for (let rank = 0; rank < ringSizes.length; rank++) {
    const [start, ring] = [starts[rank], ringSizes[rank]];
    const count = starts[rank + 1] - start;
    const beyond = count - ring;
    const extra = beyond > 0 ? OVERSHOOT : 0;
    const doubt = Math.min(Math.max(rank / SURE, LEAST), 1);
    for (let number = 0; number < count; number++) {
      const inRing = number < ring;
      let weight = inRing ? (1 + extra) / ring : -extra / beyond;
      if (isBoundary[rank]) {
        if (ring === 1) weight = 1;
        else weight = number === 0 || number === ring - 1 ? 0.5 : 0;
      } else if (!ring) {
        if (beyond === 3) weight = number === 2 ? -1 : 1; // a parallelogram
        else weight = 1 / beyond;
      }
      weights[start + number] = weight;
      variances[start + number] = (inRing || !ring ? RING_VARIANCE : FAR_VARIANCE) * doubt;
    }
  }
  return { weights, variances };
}

function hasThree(faces, c) {
  return faces[c] !== faces[c + 1] && faces[c + 1] !== faces[c + 2] && faces[c] !== faces[c + 2];
}
