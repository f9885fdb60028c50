/** Values of an attribute from the integers that are coded. Mirrors `gvpipe.attributes.storage`. */

import { decodeIntegers } from "../format/integers.js";

export const [INTEGERS, FLOATS, STEPS, DIRECTIONS, TANGENTS, RANKS] = [0, 1, 2, 3, 4, 5];
const TYPES = [
  { name: "float32", array: Float32Array },
  { name: "int8", array: Int8Array, low: -(2 ** 7), high: 2 ** 7 - 1 },
  { name: "uint8", array: Uint8Array, low: 0, high: 2 ** 8 - 1 },
  { name: "int16", array: Int16Array, low: -(2 ** 15), high: 2 ** 15 - 1 },
  { name: "uint16", array: Uint16Array, low: 0, high: 2 ** 16 - 1 },
  { name: "int32", array: Int32Array, low: -(2 ** 31), high: 2 ** 31 - 1 },
  { name: "uint32", array: Uint32Array, low: 0, high: 2 ** 32 - 1 },
  { name: "int64", array: Float64Array, low: -(2 ** 63), high: 2 ** 63 }, // as doubles: exact up to 2^53
  { name: "uint64", array: Float64Array, low: 0, high: 2 ** 64 },
];
const word = new Float32Array(1);
const bits = new Int32Array(word.buffer);
const MAX_COMPONENTS = 64;
const MAX_N = 2 ** 20; // of the octahedral lattice
const MAX_STEP = Number.MAX_VALUE;

/**
 * @typedef {object} Storage
 * @property {number} id one of the above
 * @property {{name: string, array: Function}} type
 * @property {number} components
 * @property {number} step of STEPS @property {number} n of the lattice
 * @property {number[]} zeros entries that are zero and no direction @property {number[]} table of RANKS
 *
 * @param {import("../format/cursor.js").Cursor} cursor @param {number} nEntries
 * @returns {Storage}
 */
export function readStorage(cursor, nEntries) {
  const [id, typeNumber] = cursor.take(2);
  const type = TYPES[typeNumber];
  if (id > RANKS || !type) throw cursor.corrupt("an attribute has an unknown storage");
  if ((type.array === Float32Array) !== (id !== INTEGERS && id !== RANKS)) {
    throw cursor.corrupt(`an attribute of ${type.name} is stored as what it is not`);
  }
  const components = cursor.varint(MAX_COMPONENTS, "the number of components");
  const storage = { id, type, components, step: 1, n: 0, zeros: [], table: [] };
  if (id === STEPS) {
    storage.step = cursor.f64();
    if (!(storage.step > 0 && storage.step <= MAX_STEP)) throw cursor.corrupt("a step is out of range");
  }
  if (id === DIRECTIONS || id === TANGENTS) {
    if (components !== id) throw cursor.corrupt(`directions have ${components} components`); // DIRECTIONS is 3, TANGENTS 4
    storage.n = cursor.varint(MAX_N, "the octahedral lattice");
    if (storage.n === 0) throw cursor.corrupt("the octahedral lattice has no points");
    storage.zeros = readZeros(cursor, nEntries);
  }
  if (id === RANKS) storage.table = readTable(cursor, nEntries * components);
  return storage;
}

/** The values (N, C) of codes; throws for codes without a value. */
export function restore({ id, type, components, step, zeros, table }, codes, cursor) {
  const values = new type.array(codes.length);
  if (id === FLOATS) {
    for (let i = 0; i < codes.length; i++) values[i] = floatOf(codes[i]);
  } else if (id === STEPS) {
    for (let i = 0; i < codes.length; i++) values[i] = codes[i] * step;
  } else if (id === DIRECTIONS || id === TANGENTS) {
    for (let i = 0; i < codes.length; i += components) {
      const [x, y, z] = [codes[i], codes[i + 1], codes[i + 2]];
      const length = Math.sqrt(x * x + y * y + z * z);
      values.set([x / length, y / length, z / length], i);
      if (components === 4) values[i + 3] = codes[i + 3];
    }
    for (const zero of zeros) values.fill(0, components * zero, components * zero + 3);
  } else {
    restoreIntegers(values, codes, id === RANKS ? table : null, type, cursor);
  }
  if (type.array === Float32Array && !values.every(Number.isFinite)) throw cursor.corrupt("a value is not finite");
  return values;
}

function restoreIntegers(values, codes, table, type, cursor) {
  for (let i = 0; i < codes.length; i++) {
    const value = table ? table[codes[i]] : codes[i];
    if (value === undefined) throw cursor.corrupt("a rank is out of range");
    if (!(value >= type.low && value <= type.high)) throw cursor.corrupt(`a value does not fit ${type.name}`);
    values[i] = value;
  }
}

function readZeros(cursor, nEntries) {
  const count = cursor.varint(nEntries, "the number of zero directions");
  if (!count) return [];
  const zeros = [];
  let at = -1;
  for (const gap of decodeIntegers(cursor.block(), count, null, cursor.name)) {
    at += gap + 1;
    if (gap < 0 || at >= nEntries) throw cursor.corrupt("a zero direction is out of range");
    zeros.push(at);
  }
  return zeros;
}

function readTable(cursor, most) {
  const count = cursor.varint(most, "the number of distinct values");
  if (!count) return [];
  cursor.take(8);
  const table = [cursor.view.getBigInt64(cursor.position - 8, true)];
  const [low, high] = [0, 1].map(() => decodeIntegers(cursor.block(), count - 1, null, cursor.name));
  for (let i = 0; i < count - 1; i++) {
    if (!(low[i] >= 0 && high[i] >= 0 && low[i] < 2 ** 32 && high[i] < 2 ** 32)) {
      throw cursor.corrupt("a gap between values is out of range");
    }
    table.push(table[i] + (BigInt(high[i]) << 32n) + BigInt(low[i]) + 1n);
  }
  if (table.at(-1) >= 2n ** 63n) throw cursor.corrupt("distinct values are out of range");
  return table.map(Number);
}

/** The float32 of an ordered code, whose bits ascend as values do; NaN and infinities where the bits are theirs. */
function floatOf(code) {
  bits[0] = code >= 0 ? code : -(code + 1) - 2 ** 31;
  return word[0];
}
