/** Pictures that are decoded and kept, around the one that was asked for last; what is too far from it is freed. */

const MOST_BYTES = 64 * 2 ** 20; // ahead
const MOST_AHEAD = 16; // pictures
export const BEHIND = 4; // pictures that may still be shown: a clock finishes some before it shows them
const BEYOND = 16; // pictures that decoders give too early

export class KeptPictures {
  #kept = new Map(); // picture -> ImageBitmap
  #waiting = new Map(); // picture -> [{resolve, reject}]
  #shown = null; // that must stay, and its number
  #shownAs = -1;

  /** @param {number} count of all pictures @param {number} bytes of one */
  constructor(count, bytes) {
    this.count = count;
    /** The picture that was asked for last. */
    this.wanted = 0;
    /** Pictures that are decoded ahead of it. */
    this.ahead = Math.max(2, Math.min(MOST_AHEAD, count - 1, Math.floor(MOST_BYTES / bytes)));
  }

  has(picture) {
    return this.#kept.has(picture);
  }

  /** A promise that a picture is here. */
  when(picture) {
    if (this.#kept.has(picture)) return Promise.resolve();
    return new Promise((resolve, reject) => this.#waiting.set(picture, [...(this.#waiting.get(picture) ?? []), { resolve, reject }]));
  }

  /** The picture to be decoded next: one that is waited for, or is wanted soon; -1 for none. */
  get next() {
    for (let i = 0; i <= Math.min(this.ahead, this.count - 1); i++) {
      const picture = (this.wanted + i) % this.count;
      if (!this.#kept.has(picture)) return picture;
    }
    return [...this.#waiting.keys()].find((picture) => !this.#kept.has(picture)) ?? -1;
  }

  /** Whether a picture that is decoded now is of use. */
  isOfUse(picture) {
    return this.#waiting.has(picture) || (!this.#kept.has(picture) && this.#isNear(picture));
  }

  #isNear(picture) {
    const after = (picture - this.wanted + this.count) % this.count;
    return after <= this.ahead + BEYOND || this.count - after <= BEHIND;
  }

  add(picture, bitmap) {
    if (this.#kept.has(picture)) bitmap.close(); // it was decoded twice
    else this.#kept.set(picture, bitmap);
    for (const { resolve } of this.#waiting.get(picture) ?? []) resolve();
    this.#waiting.delete(picture);
  }

  /** Have others around a picture from now on. */
  want(picture) {
    this.wanted = picture;
    for (const [old, bitmap] of this.#kept) {
      if (this.#isNear(old) || this.#waiting.has(old)) continue;
      this.#kept.delete(old);
      if (bitmap !== this.#shown) bitmap.close();
    }
  }

  /** A picture that is shown from now on, and stays until another is; null if it is not here. */
  show(picture) {
    if (picture === this.#shownAs) return this.#shown;
    const bitmap = this.#kept.get(picture);
    if (!bitmap) return null;
    if (this.#shown && this.#kept.get(this.#shownAs) !== this.#shown) this.#shown.close();
    [this.#shown, this.#shownAs] = [bitmap, picture];
    return bitmap;
  }

  /** Tell all who wait that nothing comes. */
  fail(error) {
    const waiting = [...this.#waiting.values()].flat();
    this.#waiting.clear();
    for (const { reject } of waiting) reject(error);
  }

  close(error) {
    this.fail(error);
    for (const bitmap of new Set([...this.#kept.values(), this.#shown])) bitmap?.close();
    this.#kept.clear();
    this.#shown = null;
    this.#shownAs = -1;
  }
}
