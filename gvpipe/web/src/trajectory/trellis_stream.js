/** Integers of residuals on a trellis, as kernels take them. Mirrors `gvpipe.trajectory.trellis_coding`; `docs/format.md`, section 6. */

import {
  TOKENS_MAX_TOKENS as MAX_TOKENS,
  TRELLIS_SHAPES as SHAPES,
  TRELLIS_TREND_SHAPES as TREND_SHAPES,
  TRELLIS_TREND_ZEROS as TREND_ZEROS,
  TRELLIS_ZEROS as ZEROS,
} from "../constants.js";
import { PROBLEMS } from "../format/block_stream.js";
import { Cursor } from "../format/cursor.js";
import { magnitudeTable } from "../format/parametric_tables.js";
import { WordStream } from "../format/word_stream.js";

export class TrellisStream {
  #cursor;
  #words;

  /**
   * @param {import("../wasm/kernels.js").Kernels} kernels @param {Uint8Array} data
   * @param {boolean} followsTrends how contexts are found @param {string} name of the section, for messages
   */
  constructor(kernels, data, followsTrends, name) {
    const cursor = new Cursor(data, name);
    if (cursor.left % 4) throw cursor.corrupt("its words are not whole");
    this.#cursor = cursor;
    this.#words = new WordStream(kernels, cursor.words(cursor.left / 4));
    /** The members of Python's `LearningStream`. */
    this.arrays = [...this.#words.arrays, kernels.array("int64", [SHAPES.length * ZEROS.length, MAX_TOKENS], firstTables(followsTrends))];
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

/** Mirrors `gvpipe.trajectory.trellis.first_tables`. */
function firstTables(followsTrends) {
  const [shapes, zerosOf] = followsTrends ? [TREND_SHAPES, TREND_ZEROS] : [SHAPES, ZEROS];
  const tables = new BigInt64Array(shapes.length * zerosOf.length * MAX_TOKENS).fill(1n);
  shapes.forEach((shape, context) => {
    zerosOf.forEach((zeros, quantiser) => {
      const first = (zerosOf.length * context + quantiser) * MAX_TOKENS;
      magnitudeTable(zeros[context], shape).forEach((frequency, token) => (tables[first + token] = BigInt(frequency)));
    });
  });
  return tables;
}
