/** Range-coded words as kernels take them. Mirrors what `gvpipe.entropy.range_decoder` does before and after its loops. */

import { RANGE_DECODER_PRECISION as PRECISION } from "../constants.js";

const TOTAL = 2 ** PRECISION;
const UNTOUCHED = 2n ** 64n - 1n; // the range before anything is read

export class WordStream {
  #kernels;
  #state;
  #length;

  /** @param {import("../wasm/kernels.js").Kernels} kernels @param {Uint32Array} words */
  constructor(kernels, words) {
    const first = (BigInt(words[0] ?? 0) << 32n) | BigInt(words[1] ?? 0);
    this.#kernels = kernels;
    this.#state = kernels.array("uint64", [3], [first, UNTOUCHED, BigInt(Math.min(2, words.length))]);
    this.#length = words.length;
    /** State and words. */
    this.arrays = [this.#state, kernels.array("uint32", [words.length], words)];
  }

  /** Whether all may have been read: no words are left, and no more than the encoder's last words can leave. */
  get isAtEnd() {
    const [difference, extent, place] = this.#kernels.view(this.#state);
    return Number(place) === this.#length && (extent === UNTOUCHED || difference < 2n ** 33n - 1n);
  }
}

/**
 * The edges of symbols with these weights: every symbol gets one share of 2^24, the rest is dealt out in proportion, rounded
 * down at the edges. Sums, one quotient and one product per edge in doubles: the same on every machine.
 */
export function categoricalEdges(weights) {
  let sum = 0;
  for (const weight of weights) sum += weight;
  const scale = (TOTAL - weights.length) / sum;
  const edges = new Float64Array(weights.length + 1);
  let before = 0;
  weights.forEach((weight, i) => {
    edges[i] = Math.floor(before * scale) + i;
    before += weight;
  });
  edges[weights.length] = TOTAL;
  return edges;
}
