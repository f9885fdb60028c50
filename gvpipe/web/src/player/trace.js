/** A value of a field over time: at most so many frames, spread evenly, the first and the last among them. */

import { length } from "../fields/length.js";

const MOST = 200;

/** What is shown of a row of a field: the number, or the length of a vector. @returns {number|null} null: frame k is not in memory */
export function valueOf(field, k, row) {
  const numbers = field.row(k, row);
  return numbers && (numbers.length > 1 ? length(numbers, 0, numbers.length) : numbers[0]);
}

export class Trace {
  #isOver = false;
  #isLoading = false;
  #known = new Set(); // places in `frames` whose values are here

  /** @param {import("../fields/coded_field.js").CodedField} field @param {number} row a vertex or a triangle */
  constructor(field, row) {
    this.field = field;
    this.row = row;
    const count = Math.min(MOST, field.frameCount);
    this.frames = Array.from({ length: count }, (_, i) => Math.round((i * (field.frameCount - 1)) / Math.max(1, count - 1)));
    /** At `frames`; null where it is not known yet. @type {(number|null)[]} */
    this.values = new Array(count).fill(null);
  }

  /** Take what is in memory. @returns {boolean} whether anything is new */
  take() {
    let isNew = false;
    this.frames.forEach((k, i) => {
      if (this.#known.has(i)) return;
      this.values[i] = valueOf(this.field, k, this.row);
      if (this.values[i] === null) return;
      this.#known.add(i);
      isNew = true;
    });
    return isNew;
  }

  /**
   * Load what is not known, one part of the field after the other.
   *
   * @param {() => boolean} mayGoOn asked before each @param {() => void} changed called when values have come
   * @returns {Promise<void>} rejects if a part cannot be decoded
   */
  async load(mayGoOn, changed) {
    if (this.#isLoading) return;
    this.#isLoading = true;
    try {
      for (let i = 0; i < this.frames.length && !this.#isOver && mayGoOn(); i++) {
        if (this.#known.has(i)) continue;
        await this.field.load(this.frames[i]);
        if (!this.#isOver && this.take()) changed();
      }
    } finally {
      this.#isLoading = false;
    }
  }

  /** Load no more. */
  end() {
    this.#isOver = true;
  }
}
