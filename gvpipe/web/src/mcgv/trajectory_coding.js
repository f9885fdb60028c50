/**
 * A segment of trajectory images: basis, transforms and outliers beside what the pictures hold. Mirrors
 * `gvcodecs.mcgv.pictures.trajectories.decode_segment`; `docs/format.md`, section 5.
 */

import { Cursor } from "../format/cursor.js";
import { decodeIntegers } from "../format/integers.js";
import { decodeBasis } from "../trajectory/basis.js";
import { independentOrder, placed } from "../trajectory/causal_order.js";
import { decodeVectors } from "../trajectory/coefficient_coding.js";

/**
 * @param {import("../wasm/kernels.js").Kernels} kernels
 * @param {Uint8Array} data section `trajectories.s` @param {string} name of the section, for messages
 * @param {Float64Array} samples (S, R) what the planes hold, steps, flat; filled with the slots' coefficients, model units
 * @param {{frames: number, components: number, step: number}} segment n, R, and the quantisation step, model units
 * @param {{rows: object[], clusters: number, slots: number}} blend its matrix (S, 4K) as kernels take it, K, and S
 * @param {import("../format/budget.js").Budget} budget
 * @returns {import("../trajectory/basis.js").Basis}
 * @throws {GeometryVideoError} the section is not as gvpipe writes it
 */
export function decodeSegment(kernels, data, name, samples, { frames, components, step }, { rows, clusters, slots }, budget) {
  const cursor = new Cursor(data, name);
  const [head, coded] = [cursor.block(), cursor.block()];
  const basis = decodeBasis(kernels, head, frames, slots, step, name, 3, budget);
  if (basis.components !== components) throw cursor.corrupt(`${basis.components} components where the header says ${components}`);
  const order = placed(kernels, independentOrder(4 * clusters));
  const transforms = decodeVectors(kernels, order, coded, components, step, name);
  readOutliers(cursor, samples);
  const [predicted] = kernels.call("multiply", ...rows, transforms); // (S, R)
  const own = kernels.view(predicted);
  for (let i = 0; i < samples.length; i++) samples[i] = samples[i] * step + own[i];
  kernels.free(...order, transforms, predicted);
  return basis;
}

/** Coefficients that planes cannot hold. */
function readOutliers(cursor, samples) {
  const count = cursor.varint(samples.length, "the number of outliers");
  const gaps = decodeIntegers(cursor.block(), count, null, cursor.name);
  const values = decodeIntegers(cursor.rest(), count, null, cursor.name);
  for (let i = 0, at = 0; i < count; i++) {
    at += gaps[i];
    if (gaps[i] < (i ? 1 : 0) || at >= samples.length) throw cursor.corrupt("an outlier's place is out of range");
    samples[at] = values[i];
  }
}
