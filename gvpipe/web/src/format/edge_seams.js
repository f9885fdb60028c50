/** Which copy of its point each corner uses, coded along edges. Mirrors `gvpipe.connectivity.edge_seams`; `docs/format.md`, section 5.8. */

import { EDGE_SEAM_KERNELS_CONTEXTS as CONTEXTS, EDGE_SEAM_KERNELS_DECODE as DECODE } from "../constants.js";
import { corrupt } from "./errors.js";
import { decodeIntegers } from "./integers.js";

/**
 * @param {import("../wasm/kernels.js").Kernels} kernels
 * @param {Uint8Array} data the rest of section `mesh`
 * @param {Uint32Array} pointFaces (T, 3) triangles over points, flat @param {ArrayLike<number>} counts (P) copies of each point
 * @param {Uint32Array} corners of points with more than one copy, by point, then by number
 * @returns {Uint32Array} (3 T) the copy that each corner uses
 */
export function decodeSeams(kernels, data, pointFaces, counts, corners) {
  const own = kernels.fresh();
  const begins = new Int32Array(corners.length); // of each corner's point
  for (let i = 1; i < corners.length; i++) begins[i] = pointFaces[corners[i]] === pointFaces[corners[i - 1]] ? begins[i - 1] : i;
  const seams = [pointFaces, corners, begins, counts].map((values) => own.whole(values));
  const [numbers, ranks, contexts] = [pointFaces, corners, corners].map(({ length }) => own.array("int64", [length]));
  own.call("visit_corners", ...seams, numbers, ranks, contexts, CONTEXTS);
  const coded = corners.map((_, i) => i).filter((i) => begins[i] !== i); // the others use their point's first copy
  const found = own.words(contexts);
  const values = decodeIntegers(data, coded.length, Uint8Array.from(coded, (i) => found[2 * i]), "mesh");
  const all = own.view(ranks);
  coded.forEach((i, k) => (all[i] = BigInt(values[k])));
  if (own.call("visit_corners", ...seams, numbers, ranks, contexts, DECODE)[0] < corners.length) {
    throw corrupt("mesh", "a corner uses a copy that does not exist");
  }
  const words = own.words(numbers);
  return Uint32Array.from(pointFaces, (_, corner) => words[2 * corner]);
}
