/** The latest few of things that take time to make. */

const KEPT = 4;

export class Recent {
  /**
   * @param {(key: number) => object} make what fails, now or as a promise, is made anew when it is asked for again
   * @param {number} [most] that are kept
   */
  constructor(make, most = KEPT) {
    this.make = make;
    this.most = most;
    this.kept = new Map();
  }

  get(key) {
    if (!this.kept.has(key)) {
      const made = this.make(key);
      this.kept.set(key, made);
      if (made instanceof Promise) made.catch(() => this.kept.delete(key));
      if (this.kept.size > this.most) this.kept.delete(this.kept.keys().next().value);
    }
    return this.kept.get(key);
  }
}
