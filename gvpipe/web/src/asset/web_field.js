/**
 * An animated field in the coding made for browsers: levels, predicted from the frames before, deflated in groups of frames.
 * Mirrors `gvpipe.web.field_export`, which describes the bytes.
 */

import { FIELD_EXPORT_MAX_VALUES as MAX_VALUES, FIELD_EXPORT_ORDERS as ORDERS } from "../constants.js";
import { Cursor } from "../format/cursor.js";
import { corrupt } from "../format/errors.js";
import { inflate } from "../format/inflate.js";

const KEPT = 3; // groups in memory: the one shown, the next, and the one before

export class WebField {
  #data;
  #parents;
  #groupFrames;
  #low;
  #step;
  #starts; // of each group in the data, and the end
  #groups = new Map(); // group -> Uint16Array of levels (n, R, C), the latest used last
  #loading = new Map(); // group -> promise

  /**
   * @param {object} entry of section `asset`, checked
   * @param {Uint8Array} data its section
   * @param {number} frames F
   * @param {Int32Array} parents (R) the row that predicts each row (`findParents`)
   */
  constructor(entry, data, frames, parents) {
    const rows = parents.length;
    this.#parents = parents;
    this.name = entry.name;
    this.kind = entry.kind;
    this.domain = entry.domain;
    this.type = entry.type;
    this.unit = entry.unit;
    this.components = entry.components || 1;
    this.frameCount = frames;
    this.rowCount = rows;
    /** Largest difference of a value from the source's. */
    this.bound = entry.bound;
    /** `[low, high]` of all components, or null if all are holes. */
    this.range = entry.range;
    /** What colours of this type count as 1. */
    this.fullScale = entry.fullScale;
    const cursor = new Cursor(data, entry.section);
    this.#groupFrames = cursor.u32();
    this.#low = cursor.f64();
    this.#step = cursor.f64();
    /** Largest length of a vector. */
    this.largest = cursor.f64();
    const isSound = [this.#low, this.#step, this.largest].every(Number.isFinite) && this.#step > 0 && this.largest >= 0;
    if (!isSound || this.#groupFrames < 1 || this.#groupFrames > frames) throw cursor.corrupt("its head is not as gvpipe writes it");
    if (this.#groupFrames * rows * this.components > MAX_VALUES) throw cursor.corrupt("its groups are too large");
    const bytes = cursor.words(Math.ceil(frames / this.#groupFrames));
    this.#starts = [cursor.position];
    for (const count of bytes) this.#starts.push(this.#starts.at(-1) + count);
    cursor.take(this.#starts.at(-1) - cursor.position);
    cursor.end();
    this.#data = data;
  }

  /** A promise of frame k: (R, C) values, NaN for holes. @returns {Promise<Float32Array>} */
  async frame(k) {
    if (!Number.isInteger(k) || k < 0 || k >= this.frameCount) throw new RangeError(`frame ${k}: there are ${this.frameCount}`);
    const values = new Float32Array(this.rowCount * this.components);
    const group = Math.floor(k / this.#groupFrames);
    this.#fill(await this.#load(group), k, values);
    return values;
  }

  /**
   * Fill `values (R, C)` with frame k if it is in memory, and load what comes next.
   * @returns {boolean} whether it was
   */
  read(k, values) {
    const group = Math.floor(k / this.#groupFrames);
    const levels = this.#groups.get(group);
    if (!levels) return false;
    this.#groups.delete(group); // to come last
    this.#groups.set(group, levels);
    this.#fill(levels, k, values);
    const next = (group + 1) % (this.#starts.length - 1);
    if (!this.#groups.has(next)) this.#load(next).catch(() => {}); // reported when it is shown
    return true;
  }

  /** A promise that frame k is in memory. */
  async load(k) {
    await this.#load(Math.floor(k / this.#groupFrames));
  }

  #fill(levels, k, values) {
    const [low, step] = [this.#low, this.#step];
    const start = (k % this.#groupFrames) * values.length;
    for (let i = 0; i < values.length; i++) {
      const level = levels[start + i];
      values[i] = level ? low + step * (level - 1) : NaN;
    }
  }

  #load(group) {
    if (this.#groups.has(group)) return Promise.resolve(this.#groups.get(group));
    if (!this.#loading.has(group)) {
      const loading = this.#decode(group).finally(() => this.#loading.delete(group));
      this.#loading.set(group, loading);
    }
    return this.#loading.get(group);
  }

  async #decode(group) {
    const data = this.#data.subarray(this.#starts[group], this.#starts[group + 1]);
    const frames = Math.min(this.#groupFrames, this.frameCount - group * this.#groupFrames);
    const count = frames * this.rowCount * this.components;
    const wrong = (what) => corrupt(`field ${this.name}`, what);
    if (data.length < 1 || data[0] >= 2 * ORDERS) throw wrong("a group is not as gvpipe writes it");
    const planes = await inflate(data.subarray(1), 2 * count, wrong);
    if (planes.length !== 2 * count) throw wrong(`a group has ${planes.length} bytes, ${2 * count} are needed`);
    const levels = restore(planes, frames, this, this.#parents, data[0]);
    this.#groups.set(group, levels);
    if (this.#groups.size > KEPT) this.#groups.delete(this.#groups.keys().next().value);
    return levels;
  }
}

/** Levels (n, R, C) of two planes of bytes. Sums are modulo 2^16, as `Uint16Array` has them. */
function restore(planes, frames, { components }, parents, mode) {
  const order = mode % ORDERS;
  const isByRows = mode >= ORDERS;
  const count = planes.length / 2;
  const size = count / frames;
  const levels = new Uint16Array(count);
  for (let i = 0; i < count; i++) {
    const folded = planes[i] | (planes[count + i] << 8);
    levels[i] = folded & 1 ? ~(folded >> 1) : folded >> 1;
  }
  for (let frame = 0; frame < frames; frame++) {
    const start = frame * size;
    if (isByRows || order === 0 || frame === 0) {
      for (let row = 1; row < parents.length; row++) {
        const [own, parent] = [start + row * components, start + parents[row] * components];
        for (let i = 0; i < components; i++) levels[own + i] += levels[parent + i];
      }
    }
    if (order === 0 || frame === 0) continue;
    if (order === 1 || frame === 1) for (let i = start; i < start + size; i++) levels[i] += levels[i - size];
    else for (let i = start; i < start + size; i++) levels[i] += 2 * levels[i - size] - levels[i - 2 * size];
  }
  return levels;
}

/**
 * (R) the row that predicts each row: its last neighbour before it, without one the row before; -1 for row 0.
 *
 * @param {number} nRows @param {Uint32Array} indices (3T) of vertices; none for rows that are triangles
 */
export function findParents(nRows, indices) {
  const parents = new Int32Array(nRows).fill(-1);
  for (let c = 0; c < indices.length; c++) {
    const a = indices[c];
    const b = indices[c % 3 < 2 ? c + 1 : c - 2];
    if (a !== b) parents[Math.max(a, b)] = Math.max(parents[Math.max(a, b)], Math.min(a, b));
  }
  for (let row = 0; row < nRows; row++) if (parents[row] < 0) parents[row] = row - 1;
  return parents;
}
