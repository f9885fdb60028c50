/** Stretches of time as `HTMLMediaElement` gives them; browsers let no script make their own `TimeRanges`. */

export class TimeRanges {
  #ranges;

  /** @param {[number, number][]} ranges start and end of each, seconds */
  constructor(ranges) {
    this.#ranges = ranges;
  }

  get length() {
    return this.#ranges.length;
  }

  start(index) {
    return this.#at(index)[0];
  }

  end(index) {
    return this.#at(index)[1];
  }

  #at(index) {
    const range = this.#ranges[index];
    if (!range) throw new DOMException(`range ${index}: there are ${this.length}`, "IndexSizeError");
    return range;
  }
}
