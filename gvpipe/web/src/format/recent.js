/** The latest few of things that take time to make. */

const KEPT = 4;

export class Recent {
  /** @param {(key: number) => object} make */
  constructor(make) {
    this.make = make;
    this.kept = new Map();
  }

  get(key) {
    if (!this.kept.has(key)) {
      this.kept.set(key, this.make(key));
      if (this.kept.size > KEPT) this.kept.delete(this.kept.keys().next().value);
    }
    return this.kept.get(key);
  }
}
