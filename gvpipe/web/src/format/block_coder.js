/** Range-coded integers that come block by block. Mirrors `gvpipe.entropy.block_coder.BlockDecoder`; `docs/format.md`, section 6. */

import { BLOCK_CODER_PARAMETRIC as PARAMETRIC, TOKENS_CHUNK as CHUNK } from "../constants.js";
import { Cursor } from "./cursor.js";
import { DIRECT, MAX_TOKENS, TABLE_TOTAL, normalised, unfold } from "./integers.js";
import { N_RATIOS, magnitudeTable } from "./parametric_tables.js";
import { RangeDecoder, categoricalEdges } from "./range_decoder.js";

export class BlockDecoder {
  /** @param {Uint8Array} data @param {number} nContexts at most 256 @param {string} name of the section, for messages */
  constructor(data, nContexts, name) {
    this.cursor = new Cursor(data, name);
    if (this.cursor.varint(nContexts, "the context count") !== nContexts) {
      throw this.cursor.corrupt("its context count does not fit its content");
    }
    /** Edges of each context's symbols; empty: nothing is coded in it; two: all of its tokens are 0. */
    this.edges = Array.from({ length: nContexts }, () => readEdges(this.cursor));
    if (this.cursor.left % 4) throw this.cursor.corrupt("its words are not whole");
    this.coder = new RangeDecoder(this.cursor.words(this.cursor.left / 4), name);
  }

  /** @param {Uint8Array} contexts of the next block's values @param {Float64Array} values filled; magnitudes below 2^39 */
  take(contexts, values) {
    const n = contexts.length;
    const counts = new Int32Array(this.edges.length);
    for (let i = 0; i < n; i++) counts[contexts[i]]++;
    const symbols = this.edges.map((edges, context) => this.#tokens(edges, counts[context]));
    const next = new Int32Array(this.edges.length);
    let hasLarge = false;
    for (let i = 0; i < n; i++) {
      const token = symbols[contexts[i]]?.[next[contexts[i]]++] ?? 0;
      hasLarge ||= token >= DIRECT;
      values[i] = token;
    }
    if (hasLarge) this.#addLowBits(values);
    for (let i = 0; i < n; i++) values[i] = unfold(values[i]);
  }

  /** The next `count` tokens of a context; null: all of them are 0. */
  #tokens(edges, count) {
    if (count && !edges.length) throw this.cursor.corrupt("a context is used that has no table");
    return count && edges.length > 2 ? this.coder.categorical(edges, count) : null;
  }

  /** Tokens become folded values. */
  #addLowBits(values) {
    let large = [];
    values.forEach((token, i) => {
      if (token < DIRECT) return;
      const width = ((token - DIRECT) >> 1) + 3;
      large.push({ i, width });
      values[i] = (2 + (token & 1)) * 2 ** width;
    });
    for (let shift = 0; large.length; shift += CHUNK) {
      for (const { i, width } of large) {
        values[i] += this.coder.uniform(1 << Math.min(width - shift, CHUNK)) * 2 ** shift;
      }
      large = large.filter(({ width }) => width > shift + CHUNK);
    }
  }

  /** Check that no word is left. */
  end() {
    if (!this.coder.exhausted) throw this.cursor.corrupt("range-coded data are left over");
  }
}

function readEdges(cursor) {
  const kind = cursor.varint(MAX_TOKENS + 1, "a table's kind");
  if (kind === 0) return [];
  let frequencies;
  if (kind === PARAMETRIC) {
    const [zero, ratio] = cursor.take(2);
    if (ratio >= N_RATIOS) throw cursor.corrupt(`a table has ratio ${ratio}`);
    frequencies = magnitudeTable(zero, ratio);
  } else {
    frequencies = Array.from({ length: kind - 1 }, () => cursor.varint(TABLE_TOTAL, "a frequency"));
    if (!frequencies[frequencies.length - 1]) throw cursor.corrupt("a frequency table ends in zero");
  }
  return categoricalEdges(normalised(frequencies));
}
