/**
 * Range-coded integers that kernels read one by one, the context of each known from those before. Mirrors the reading half of
 * `gvpipe.entropy.serial_coder`, and the tables of `gvpipe.entropy.serial_tables`.
 */

import { Cursor } from "./cursor.js";
import { MAX_TOKENS, TABLE_TOTAL, normalised } from "./integers.js";
import { N_RATIOS, magnitudeTable } from "./parametric_tables.js";
import { PROBLEMS, placeTables } from "./block_stream.js";
import { WordStream, categoricalEdges } from "./word_stream.js";

export class SerialStream {
  #kernels;
  #cursor;
  #words;
  #progress;

  /**
   * @param {import("../wasm/kernels.js").Kernels} kernels
   * @param {Uint8Array} data @param {number} nContexts @param {string} name of the section, for messages
   */
  constructor(kernels, data, nContexts, name) {
    this.#kernels = kernels;
    this.#cursor = new Cursor(data, name);
    const tables = readTables(this.#cursor, nContexts);
    if (this.#cursor.left % 4) throw this.#cursor.corrupt("its words are not whole");
    this.#words = new WordStream(kernels, this.#cursor.words(this.#cursor.left / 4));
    this.#progress = kernels.array("int64", [2]);
    const none = kernels.array("int64", [0]);
    /** The members of Python's `SerialCoder`, of a decoder. */
    this.arrays = [...this.#words.arrays, ...placeTables(kernels, tables), none, none, this.#progress, false];
  }

  /** Throw if a kernel met an error, or left words unread. */
  end() {
    const status = Number(this.#kernels.view(this.#progress)[1]);
    if (status) throw this.#cursor.corrupt(PROBLEMS[status]);
    if (!this.#words.isAtEnd) throw this.#cursor.corrupt("range-coded data are left over");
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
