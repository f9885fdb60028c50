/**
 * Causal orders: in which order vectors are coded, and from which decoded ones each is predicted. Mirrors the tuple of
 * `gvpipe.trajectory.causal_order`; orders themselves are found by kernels.
 *
 * @typedef {object} CausalOrder of n vectors
 * @property {ArrayLike<number>} order (n) vectors
 * @property {ArrayLike<number>} starts (n + 1) bounds of each vector's causal neighbours in `neighbours`
 * @property {ArrayLike<number>} neighbours vectors, each earlier in `order`
 * @property {ArrayLike<number>} weights prior means of their weights @property {ArrayLike<number>} variances
 * @property {ArrayLike<number>} ringSizes (n) how many of the first neighbours lie next to the vector
 * @property {ArrayLike<number>} blocks bounds in `order` of the blocks that are entropy coded at once
 * @property {boolean} affine whether the weights of a vector's neighbours sum to one
 */

const TYPES = { order: "int32", starts: "int32", neighbours: "int32", weights: "float64", variances: "float64", ringSizes: "int32", blocks: "int32" };

/**
 * @param {import("../wasm/kernels.js").Kernels} kernels @param {CausalOrder} causal
 * @returns {(import("../wasm/kernels.js").KernelArray|boolean)[]} its members, as kernels take them
 */
export function placed(kernels, causal) {
  return [...Object.entries(TYPES).map(([name, type]) => kernels.array(type, [causal[name].length], causal[name])), causal.affine];
}

/** Mirror of `placed`, for what a kernel returned. @returns {CausalOrder} */
export function taken(kernels, arrays) {
  const named = Object.keys(TYPES).map((name, i) => [name, kernels.view(arrays[i]).slice()]);
  return { ...Object.fromEntries(named), affine: Boolean(arrays[arrays.length - 1]) };
}

/** The causal order of vectors that come by number, none predicted from another. @param {number} n @returns {CausalOrder} */
export function independentOrder(n) {
  const order = Int32Array.from({ length: n }, (_, i) => i);
  const none = new Float64Array(0);
  return { order, starts: new Int32Array(n + 1), neighbours: [], weights: none, variances: none, ringSizes: new Int32Array(n), blocks: [0, n], affine: false };
}
