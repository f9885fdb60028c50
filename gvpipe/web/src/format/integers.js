/** Blocks of range-coded integers. Mirrors `gvpipe.entropy.integers.decode_integers`; `docs/format.md`, section 3. */

import {
  INTEGERS_MAX_CONTEXTS as MAX_CONTEXTS,
  TOKENS_DIRECT as DIRECT,
  TOKENS_MAX_TOKENS as MAX_TOKENS,
  TOKENS_TABLE_TOTAL as TABLE_TOTAL,
} from "../constants.js";
import { Cursor } from "./cursor.js";
import { RangeDecoder } from "./range_decoder.js";
import { categoricalEdges } from "./word_stream.js";

export { DIRECT, MAX_TOKENS, TABLE_TOTAL };

/**
 * @param {Uint8Array} data one whole block
 * @param {number} count how many integers; checked by the caller against its own limits
 * @param {ArrayLike<number>|null} contexts which table each value uses, or null: one for all
 * @param {string} name of the section, for messages
 * @returns {Float64Array} signed integers, magnitude below 2^39
 */
export function decodeIntegers(data, count, contexts, name) {
  const cursor = new Cursor(data, name);
  const groups = groupPositions(contexts ?? new Uint8Array(count), count, contexts === null ? 1 : 0);
  if (cursor.varint(MAX_CONTEXTS, "the context count") !== groups.length) {
    throw cursor.corrupt("its context count does not fit its content");
  }
  const tables = groups.map((group) => readTable(cursor, group.length));
  const words = cursor.words(cursor.varint(cursor.left, "the word count"));
  const decoder = new RangeDecoder(words, name);
  const tokens = new Uint8Array(count);
  groups.forEach((group, c) => {
    if (tables[c].length > 1 && group.length) {
      const symbols = decoder.categorical(categoricalEdges(normalised(tables[c])), group.length);
      for (let i = 0; i < group.length; i++) tokens[group[i]] = symbols[i];
    }
  });
  return untokenise(tokens, cursor);
}

function readTable(cursor, isUsed) {
  const size = cursor.varint(MAX_TOKENS, "a table's token count");
  const table = Array.from({ length: size }, () => cursor.varint(TABLE_TOTAL, "a frequency"));
  if (isUsed && !table.some((frequency) => frequency > 0)) throw cursor.corrupt("a frequency table is empty");
  return table;
}

/** Frequencies as weights: integer by integer, one correctly rounded quotient each. */
export function normalised(table) {
  const sum = table.reduce((a, b) => a + b, 0);
  return table.map((frequency) => frequency / sum);
}

/** Positions of each context's values, in order: contexts 0 up to the highest, or the `least` many. */
function groupPositions(contexts, count, least) {
  const sizes = [];
  for (let i = 0; i < count; i++) {
    while (sizes.length <= contexts[i]) sizes.push(0);
    sizes[contexts[i]]++;
  }
  while (sizes.length < least) sizes.push(0);
  const groups = sizes.map((size) => new Uint32Array(size));
  const filled = new Uint32Array(sizes.length);
  for (let i = 0; i < count; i++) groups[contexts[i]][filled[contexts[i]]++] = i;
  return groups;
}

function untokenise(tokens, cursor) {
  const values = new Float64Array(tokens.length);
  const large = [];
  for (let i = 0; i < tokens.length; i++) {
    const token = tokens[i];
    if (token < DIRECT) values[i] = unfold(token);
    else (large[token - DIRECT] ??= []).push(i);
  }
  const widthOf = (above) => (above >> 1) + 3; // bits that follow raw
  const total = large.reduce((sum, positions, above) => sum + positions.length * widthOf(above), 0);
  const bits = new BitReader(cursor.take(Math.ceil(total / 8)));
  cursor.end();
  large.forEach((positions, above) => {
    const width = widthOf(above);
    const top = (2 + (above & 1)) * 2 ** width;
    for (const i of positions) values[i] = unfold(top + bits.read(width));
  });
  return values;
}

/** 0, 1, 2, 3, ... to 0, -1, 1, -2, ... */
export function unfold(u) {
  return u % 2 ? (u + 1) / -2 : u / 2;
}

/** Numbers of up to 38 bits, most significant bit first. */
class BitReader {
  constructor(data) {
    this.data = data;
    this.position = 0;
  }

  read(width) {
    let value = 0;
    while (width > 0) {
      const inByte = this.position & 7;
      const count = Math.min(8 - inByte, width);
      value = value * 2 ** count + ((this.data[this.position >> 3] >> (8 - inByte - count)) & ((1 << count) - 1));
      this.position += count;
      width -= count;
    }
    return value;
  }
}
