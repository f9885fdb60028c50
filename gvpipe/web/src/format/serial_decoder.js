/** Range-coded integers that are read one by one, the context of each known from those before. Mirrors `gvpipe.entropy.serial_coder`. */

import { TOKENS_CHUNK as CHUNK, TOKENS_DIRECT as DIRECT } from "../constants.js";
import { BlockDecoder } from "./block_coder.js";
import { unfold } from "./integers.js";

export class SerialDecoder {
  #blocks;

  /** @param {Uint8Array} data @param {number} nContexts at most 256 @param {string} name of the section, for messages */
  constructor(data, nContexts, name) {
    this.#blocks = new BlockDecoder(data, nContexts, name);
  }

  /** The next value, magnitude below 2^39. */
  value(context) {
    const { edges, coder, cursor } = this.#blocks;
    const own = edges[context];
    if (!own.length) throw cursor.corrupt("a context is used that has no table");
    const token = own.length > 2 ? coder.symbol(own) : 0;
    if (token < DIRECT) return unfold(token);
    const width = ((token - DIRECT) >> 1) + 3;
    let value = (2 + (token & 1)) * 2 ** width;
    for (let shift = 0; shift < width; shift += CHUNK) {
      value += coder.uniform(1 << Math.min(width - shift, CHUNK)) * 2 ** shift;
    }
    return unfold(value);
  }

  /** The next value, of those that are coded folded: a number from 0 up. */
  folded(context) {
    const value = this.value(context);
    return value < 0 ? -2 * value - 1 : 2 * value;
  }

  /** What is thrown for values that cannot be. */
  corrupt(what) {
    return this.#blocks.cursor.corrupt(what);
  }

  /** Check that no word is left. */
  end() {
    this.#blocks.end();
  }
}
