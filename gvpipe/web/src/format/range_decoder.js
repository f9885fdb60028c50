/**
 * Range decoding: 32-bit words, 64-bit state, 24-bit precision, as `gvpipe/entropy/range_decoder.py`. The words are those of the
 * library constriction, which exists for neither JavaScript nor npm.
 *
 * Of the decoder's state only the difference between point and lower end matters, so (difference, range) are kept, each as two
 * halves of 32 bits in doubles: exact, and far faster than BigInt.
 *
 * Source: Bamler, Understanding Entropy Coding With Asymmetric Numeral Systems, 2022 (the library's paper); G. N. N. Martin,
 * Range encoding, 1979.
 */

import { RANGE_DECODER_PRECISION as PRECISION } from "../constants.js";
import { corrupt } from "./errors.js";

const WORD = 2 ** 32;
export const TOTAL = 2 ** PRECISION;

export class RangeDecoder {
  /** @param {Uint32Array} words @param {string} name of the section, for messages */
  constructor(words, name) {
    this.words = words;
    this.name = name;
    this.next = Math.min(2, words.length);
    this.high = words[0] ?? 0; // of the difference
    this.low = words[1] ?? 0;
    this.rangeHigh = WORD - 1;
    this.rangeLow = WORD - 1;
    this.productHigh = 0; // of the last product
    this.productLow = 0;
  }

  /** Decode `count` symbols of one categorical model: `edges` are its left cumulatives, then TOTAL. */
  categorical(edges, count) {
    const symbols = new Uint8Array(count);
    for (let i = 0; i < count; i++) symbols[i] = this.symbol(edges);
    return symbols;
  }

  /** Decode one symbol of such a model. */
  symbol(edges) {
    const top = edges.length - 2;
    const scale = this.#scale;
    const near = Math.floor((this.high * WORD + this.low) / scale); // of a rounded double: at most one off
    let first = search(edges, top, near);
    if (near - 1 < edges[first] || near + 1 >= edges[first + 1]) first = search(edges, top, this.#quantile());
    this.#advance(scale, edges[first], edges[first + 1] - edges[first]);
    return first;
  }

  /** Decode one symbol of 0..size-1 (size 2..2^24), all alike; the last takes what the division leaves. */
  uniform(size) {
    const share = Math.floor(TOTAL / size);
    const symbol = Math.min(Math.floor(this.#quantile() / share), size - 1);
    this.#advance(this.#scale, symbol * share, symbol < size - 1 ? share : TOTAL - symbol * share);
    return symbol;
  }

  /** Whether all may have been read: no words left, and no more difference than the encoder's last words can leave. */
  get exhausted() {
    const untouched = this.rangeHigh === WORD - 1 && this.rangeLow === WORD - 1;
    return this.next === this.words.length && (untouched || this.high < 1 || (this.high === 1 && this.low < WORD - 1));
  }

  get #scale() {
    return this.rangeHigh * 2 ** (32 - PRECISION) + Math.floor(this.rangeLow / TOTAL);
  }

  #quantile() {
    const scale = this.#scale;
    let quantile = Math.floor((this.high * WORD + this.low) / scale); // of a rounded double: at most one off
    let left = this.#beyond(scale, quantile);
    if (left < 0) left = this.#beyond(scale, --quantile);
    else if (left >= scale) left = this.#beyond(scale, ++quantile);
    if (quantile >= TOTAL) throw corrupt(this.name, "its range-coded data do not decode");
    return quantile;
  }

  /** difference - scale * factor; exact where it is small beside 2^53. */
  #beyond(scale, factor) {
    this.#multiply(scale, factor);
    return (this.high - this.productHigh) * WORD + (this.low - this.productLow);
  }

  #advance(scale, left, probability) {
    this.#multiply(scale, left);
    this.high -= this.productHigh;
    this.low -= this.productLow;
    if (this.low < 0) {
      this.low += WORD;
      this.high -= 1;
    }
    this.#multiply(scale, probability);
    this.rangeHigh = this.productHigh;
    this.rangeLow = this.productLow;
    if (this.rangeHigh === 0) {
      this.rangeHigh = this.rangeLow;
      this.rangeLow = 0;
      this.high = this.low;
      this.low = this.next < this.words.length ? this.words[this.next++] : 0;
    }
  }

  /** a (below 2^40) times b (at most 2^24) as two halves of 32 bits. */
  #multiply(a, b) {
    const upper = Math.floor(a / 2 ** 20) * b; // in units of 2^20; below 2^44
    const lower = (a % 2 ** 20) * b + (upper % 2 ** 12) * 2 ** 20;
    this.productHigh = Math.floor(upper / 2 ** 12) + Math.floor(lower / WORD);
    this.productLow = lower % WORD;
  }
}

/** The last of symbols 0..top whose left edge does not lie beyond a quantile. */
function search(edges, top, quantile) {
  let first = 0;
  let last = top;
  while (first < last) {
    const middle = (first + last + 1) >> 1;
    if (edges[middle] <= quantile) first = middle;
    else last = middle - 1;
  }
  return first;
}
