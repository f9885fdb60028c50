/**
 * Range-coded integers that come block by block, as kernels take them. Mirrors the reading half of `gvpipe.entropy.block_coder`;
 * `docs/format.md`, section 6.
 */

import { BLOCK_CODER_PARAMETRIC as PARAMETRIC } from "../constants.js";
import { Cursor } from "./cursor.js";
import { MAX_TOKENS, TABLE_TOTAL, normalised } from "./integers.js";
import { N_RATIOS, magnitudeTable } from "./parametric_tables.js";
import { WordStream, categoricalEdges } from "./word_stream.js";

/** What is wrong, by a kernel's status. */
export const PROBLEMS = ["", "a context is used that has no table", "its range-coded data do not decode", "a value is out of range"];

export class BlockStream {
  #cursor;
  #words;

  /**
   * @param {import("../wasm/kernels.js").Kernels} kernels
   * @param {Uint8Array} data @param {number} nContexts C @param {string} name of the section, for messages
   */
  constructor(kernels, data, nContexts, name) {
    const cursor = new Cursor(data, name);
    if (cursor.varint(nContexts, "the context count") !== nContexts) throw cursor.corrupt("its context count does not fit its content");
    const tables = Array.from({ length: nContexts }, () => readEdges(cursor));
    if (cursor.left % 4) throw cursor.corrupt("its words are not whole");
    this.#cursor = cursor;
    this.#words = new WordStream(kernels, cursor.words(cursor.left / 4));
    /** The members of Python's `BlockStream`. */
    this.arrays = [...this.#words.arrays, ...placeTables(kernels, tables)];
  }

  /** Throw if a kernel's status is an error. */
  check(status) {
    if (status) throw this.#cursor.corrupt(PROBLEMS[status]);
  }

  /** Throw if a word is left. */
  end() {
    if (!this.#words.isAtEnd) throw this.#cursor.corrupt("range-coded data are left over");
  }
}

/** Edges of tables (C, N + 1), and how many symbols each has (C), as kernels take them. */
export function placeTables(kernels, tables) {
  const width = Math.max(1, ...tables.map((edges) => edges.length));
  const edges = kernels.array("uint64", [tables.length, width]);
  const halves = kernels.words(edges);
  tables.forEach((own, context) => own.forEach((edge, i) => (halves[2 * (context * width + i)] = edge)));
  return [edges, kernels.whole(tables.map((own) => Math.max(0, own.length - 1)))];
}

/** Edges of a context's symbols; [] where it is empty. */
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
