/**
 * Range-coded integers that are read one by one, the context of each known from those before. Mirrors
 * `gvpipe.entropy.serial_coder` and the tables of `gvpipe.entropy.serial_tables`.
 */

import { TOKENS_CHUNK as CHUNK, TOKENS_DIRECT as DIRECT } from "../constants.js";
import { Cursor } from "./cursor.js";
import { MAX_TOKENS, TABLE_TOTAL, normalised, unfold } from "./integers.js";
import { N_RATIOS, magnitudeTable } from "./parametric_tables.js";
import { RangeDecoder } from "./range_decoder.js";
import { categoricalEdges } from "./word_stream.js";

export class SerialDecoder {
  #cursor;
  #edges; // of each context's symbols; empty: nothing is coded in it; two: all of its tokens are 0
  #coder;

  /** @param {Uint8Array} data @param {number} nContexts @param {string} name of the section, for messages */
  constructor(data, nContexts, name) {
    this.#cursor = new Cursor(data, name);
    this.#edges = readTables(this.#cursor, nContexts);
    if (this.#cursor.left % 4) throw this.#cursor.corrupt("its words are not whole");
    this.#coder = new RangeDecoder(this.#cursor.words(this.#cursor.left / 4), name);
  }

  /** The next value, magnitude below 2^39. */
  value(context) {
    const edges = this.#edges[context];
    const coder = this.#coder;
    if (!edges.length) throw this.corrupt("a context is used that has no table");
    const token = edges.length > 2 ? coder.symbol(edges) : 0;
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
    return this.#cursor.corrupt(what);
  }

  /** Check that no word is left. */
  end() {
    if (!this.#coder.exhausted) throw this.corrupt("range-coded data are left over");
  }
}

function readTables(cursor, nContexts) {
  const mask = cursor.take(Math.ceil(nContexts / 8));
  const isUsed = (context) => (mask[context >> 3] >> (context & 7)) & 1;
  for (let context = nContexts; context < 8 * mask.length; context++) {
    if (isUsed(context)) throw cursor.corrupt("a context is used that does not exist");
  }
  const tables = [];
  for (let context = 0; context < nContexts; context++) {
    tables.push(isUsed(context) ? categoricalEdges(normalised(readTable(cursor))) : []);
  }
  return tables;
}

function readTable(cursor) {
  const size = cursor.varint(MAX_TOKENS, "a table's number of tokens");
  if (size === 0) {
    const [zero, ratio] = cursor.take(2);
    if (ratio >= N_RATIOS) throw cursor.corrupt(`a table has ratio ${ratio}`);
    return magnitudeTable(zero, ratio);
  }
  const frequencies = [];
  while (frequencies.length < size) {
    frequencies.push(cursor.varint(TABLE_TOTAL, "a frequency"));
    if (frequencies.at(-1) > 0) continue;
    const more = cursor.varint(size - frequencies.length, "the number of zeros");
    for (let i = 0; i < more; i++) frequencies.push(0);
  }
  if (frequencies.at(-1) === 0) throw cursor.corrupt("a frequency table ends in zero");
  return frequencies;
}
