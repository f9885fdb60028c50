/** The coefficients of a segment: some components first, along triangles. Mirrors `gvcodecs.pca.coefficients`. */

import { PCA_COEFFICIENTS_FIRST_STEP as FIRST_STEP, PCA_COEFFICIENTS_MOST_FIRST as MOST_FIRST } from "../constants.js";
import { Cursor } from "../format/cursor.js";
import { MAX_VALUES, vectorSteps } from "../trajectory/coefficient_coding.js";

/**
 * `vectorSteps` of a section of coefficients.
 *
 * @param {import("../wasm/kernels.js").Kernels} kernels
 * @param {(import("../wasm/kernels.js").KernelArray|boolean)[]} causal the order along the hierarchy
 * @param {(() => (import("../wasm/kernels.js").KernelArray|boolean)[])|null} findFirst makes that of first components, null: none come first
 * @param {Uint8Array} data @param {number} components R @param {number} step D @param {string} name of the section, for messages
 * @param {object} how as of `vectorSteps`
 * @returns {Generator<undefined, import("../wasm/kernels.js").KernelArray>} (n, R) float64, by point
 * @throws {GeometryVideoError} the bytes are not as gvpipe writes them
 */
export function* coefficientSteps(kernels, causal, findFirst, data, components, step, name, how) {
  if (!findFirst) return yield* vectorSteps(kernels, causal, data, components, step, name, how);
  const cursor = new Cursor(data, name);
  const known = cursor.varint(Math.min(MOST_FIRST, components), "the number of first components");
  if (!known) return yield* vectorSteps(kernels, causal, cursor.rest(), components, step, name, how);
  if (causal[0].shape[0] * components > MAX_VALUES) throw cursor.corrupt(`${causal[0].shape[0]} vectors of ${components} components`);
  const block = cursor.block();
  const first = findFirst();
  const beginning = how.given && columns(kernels, how.given, known);
  const begun = yield* vectorSteps(kernels, first, block, known, FIRST_STEP * step, name, { given: beginning, rounds: true });
  kernels.free(...first);
  const given = how.given ?? kernels.array("float64", [begun.shape[0], components]);
  const [from, to] = [kernels.view(begun), kernels.view(given)];
  for (let i = 0; i < begun.shape[0]; i++) to.set(from.subarray(i * known, (i + 1) * known), i * components);
  return yield* vectorSteps(kernels, causal, cursor.rest(), components, step, name, { ...how, given, known });
}

/** The first columns of an array (n, R). */
function columns(kernels, array, count) {
  const [rows, components] = array.shape;
  const first = kernels.array("float64", [rows, count]);
  const [from, to] = [kernels.view(array), kernels.view(first)];
  for (let i = 0; i < rows; i++) to.set(from.subarray(i * components, i * components + count), i * count);
  return first;
}
