/** An animated field as files have it: segments, decoded when one of their frames is asked for. Mirrors `gvpipe.fields.reader`. */

import { corrupt } from "../format/errors.js";
import { readHead } from "./head.js";
import { fromOctahedral } from "./octahedral.js";
import { restored } from "./reduction.js";

const KEPT_BYTES = 64 * 2 ** 20; // of decoded segments
const KEPT_SEGMENTS = 2; // at least: the one shown and the next

export class CodedField {
  #head = null; // once its section is here
  #opening = null; // promise of that
  #fetch;
  #host;
  #isOctahedral;
  #reduction;
  #segments = new Map(); // number -> values (n, R, C), the one used last at the end
  #loading = new Map(); // number -> promise

  /**
   * @param {object} entry of section `asset`, checked
   * @param {{frameCount: number, rowCount: number, isOctahedral: boolean, reduction: import("./reduction.js").Reduction}} shape F, R,
   *   whether its vectors are coded as two coordinates, and what of it is coded once
   * @param {import("./field_host.js").FieldHost} host @param {import("../format/payload.js").Payload} payload with its section, or to load it from
   */
  constructor(entry, { frameCount, rowCount, isOctahedral, reduction }, host, payload) {
    this.name = entry.name;
    this.kind = entry.kind;
    this.domain = entry.domain;
    this.unit = entry.unit;
    /** Of the values: `float64` where they have an offset. */
    this.type = reduction.offsets ? "float64" : entry.type;
    this.codedType = entry.type;
    this.components = entry.components || 1;
    this.frameCount = frameCount;
    this.rowCount = rowCount;
    this.section = entry.section;
    /** Largest difference of a value from the source's; degrees of normals. */
    this.bound = entry.bound;
    /** `[low, high]` of all components, or null if all are holes. */
    this.range = entry.range;
    /** What colours of this type count as 1. */
    this.fullScale = entry.fullScale;
    /** Largest length of a vector in what was decoded. */
    this.largest = 0;
    /** `[low, high]` of each component in what was decoded, of vectors of 2 or 3. */
    this.extents = Array.from({ length: this.components }, () => [0, 0]);
    this.#host = host;
    this.#isOctahedral = isOctahedral;
    this.#reduction = reduction;
    this.#fetch = payload.late.get(entry.section);
    if (!this.#fetch) this.#take(payload.section(entry.section));
  }

  /** A promise of frame k: (R, C) values in an array of the field's type, NaN for holes. @returns {Promise<Float32Array|Int32Array>} */
  async frame(k) {
    if (!Number.isInteger(k) || k < 0 || k >= this.frameCount) throw new RangeError(`frame ${k}: there are ${this.frameCount}`);
    await this.#opened();
    const number = this.#numberOf(k);
    return this.#frameOf(await this.#load(number), k, number).slice();
  }

  /**
   * Fill `values (R, C)` with frame k if it is in memory, and load what comes next.
   * @returns {boolean} whether it was
   */
  read(k, values) {
    if (!this.#head) return false;
    const number = this.#numberOf(k);
    const segment = this.#segments.get(number);
    if (!segment) return false;
    this.#segments.delete(number); // to come last
    this.#segments.set(number, segment);
    values.set(this.#frameOf(segment, k, number));
    const next = (number + 1) % this.#head.segments.length;
    if (!this.#segments.has(next)) this.#load(next).catch(() => {}); // reported when it is shown
    return true;
  }

  /** Frame k (R, C), if it is in memory, else null: not copied, of use until the next call. */
  values(k) {
    const segment = this.#head && this.#segments.get(this.#numberOf(k));
    return segment ? this.#frameOf(segment, k, this.#numberOf(k)) : null;
  }

  /** The numbers of a row in frame k, if it is in memory, else null. @returns {Float32Array|null} */
  row(k, row) {
    return this.values(k)?.subarray(row * this.components, (row + 1) * this.components) ?? null;
  }

  /** A promise that frame k is in memory. */
  async load(k) {
    await this.#opened();
    await this.#load(this.#numberOf(k));
  }

  /** Have the section here, which may have to be fetched; what fails is tried again by the next call. */
  async #opened() {
    if (this.#head) return;
    this.#opening ??= this.#fetch()
      .then((data) => this.#take(data))
      .finally(() => (this.#opening = null));
    await this.#opening;
  }

  #take(data) {
    const head = readHead(data, this.frameCount, this.#reduction.polygons?.length ?? this.rowCount, this.section);
    if (head.components !== (this.#isOctahedral ? 2 : this.#reduction.components) || head.type !== this.codedType) {
      throw corrupt(this.section, "it does not hold what section 'asset' lists");
    }
    this.#head = head;
  }

  /** The segment that has frame k. */
  #numberOf(k) {
    const { bounds } = this.#head;
    let number = Math.floor((k * (bounds.length - 1)) / this.frameCount); // even cuts: this one or the next
    while (bounds[number + 1] <= k) number++;
    return number;
  }

  #frameOf(segment, k, number) {
    const size = this.rowCount * this.components;
    const start = (k - this.#head.bounds[number]) * size;
    return segment.subarray(start, start + size);
  }

  #load(number) {
    if (this.#segments.has(number)) return Promise.resolve(this.#segments.get(number));
    if (!this.#loading.has(number)) {
      const loading = this.#decode(number).finally(() => this.#loading.delete(number));
      this.#loading.set(number, loading);
    }
    return this.#loading.get(number);
  }

  async #decode(number) {
    const { segments, bounds, components, type } = this.#head;
    const [start, stop] = [bounds[number], bounds[number + 1]];
    const { frameCount, section } = this;
    const domain = this.#reduction.polygons ? "polygon" : this.domain;
    const job = { data: segments[number].slice(), start, stop, frameCount, components, type, domain, name: section };
    const decoded = await this.#host.decode(job);
    const values = this.#isOctahedral ? fromOctahedral(decoded) : restored(decoded, this.#reduction);
    if (this.components > 1) this.largest = Math.max(this.largest, longest(values, this.components));
    if (this.components === 2 || this.components === 3) widen(this.extents, values);
    this.#segments.set(number, values);
    for (const old of this.#segments.keys()) {
      if (this.#segments.size <= KEPT_SEGMENTS || this.#segments.size * values.byteLength <= KEPT_BYTES) break;
      this.#segments.delete(old);
    }
    return values;
  }
}

/** Make room for the values of each component; holes need none. */
function widen(extents, values) {
  extents.forEach((extent, c) => {
    let [low, high] = extent;
    for (let i = c; i < values.length; i += extents.length) {
      if (values[i] < low) low = values[i];
      if (values[i] > high) high = values[i];
    }
    extents[c] = [low, high];
  });
}

/** The largest length of the rows of `values (n, C)`; holes count for nothing. */
function longest(values, components) {
  let most = 0;
  for (let i = 0; i < values.length; i += components) {
    let sum = 0;
    for (let c = i; c < i + components; c++) sum += values[c] * values[c];
    if (sum > most) most = sum;
  }
  return Math.sqrt(most);
}

/** The frame of a field that frame k of the video shows: one that stands still has one. @param {{frameCount: number}} field @param {number} k */
export function frameOf(field, k) {
  return Math.min(k, field.frameCount - 1);
}
