/**
 * Polygons put together from triangles: each is a fan around its apex. Mirrors `gvpipe.attributes.polygon_kernels`, which describes
 * how the options of a fan are ranked.
 */

const MOST_RANKED = 8; // corners of a polygon whose options are ranked
const [SIZES, RANKS, EXPLICIT] = [0, 6, 27]; // first contexts of a size, of an option, of what is coded without options
export const N_POLYGON_CONTEXTS = EXPLICIT + 5;
const WIDTH = MOST_RANKED + 1;

export class PolygonDecoder {
  /**
   * @param {import("../format/serial_decoder.js").SerialDecoder} coder
   * @param {Uint32Array} flat (3T) triangles grouped by parts @param {Int32Array} opposite (3T) @param {Int32Array} parts (T)
   */
  constructor(coder, flat, opposite, parts) {
    this.coder = coder;
    this.flat = flat;
    this.opposite = opposite;
    this.parts = parts;
    const n = parts.length;
    this.isUsed = new Uint8Array(n);
    /** (T) triangles in their final order, and the corner 0..2 with which each begins. */
    this.triangles = new Int32Array(n);
    this.apexes = new Int32Array(n);
    this.edgeNumbers = new Int32Array(3 * n).fill(-1); // of a used triangle's edges in its polygon; -1: a diagonal
    this.edgeSizes = new Int32Array(3 * n);
    this.learned = new Int32Array(WIDTH ** 3).fill(-1); // by a neighbour's size, its edge and a size: the number of the edge
    this.stamps = new Float64Array(n); // the walk that last saw a triangle
    this.walks = 0;
    this.count = 0; // triangles arranged
  }

  /** @returns {number[]} corners of each polygon */
  decode() {
    const { coder, parts, isUsed } = this;
    const sizes = [];
    let size = 3;
    for (let t = 0; t < parts.length; t++) {
      if (isUsed[t]) continue;
      size += coder.value(SIZES + Math.min(size, 8) - 3);
      if (!(size >= 3 && size <= parts.length - this.count + 2)) throw coder.corrupt(`a polygon has ${size} corners`);
      if (!this.#decodeFan(t, size)) throw coder.corrupt("a polygon's triangles are missing");
      this.#noteEdges(size);
      sizes.push(size);
      this.count += size - 2;
    }
    return sizes;
  }

  /** Append the fan of a polygon that has triangle t first in order; false if there is none. */
  #decodeFan(t, size) {
    const { coder } = this;
    if (size <= MOST_RANKED) {
      const options = this.#findOptions(t, size);
      const n = options.length;
      let margin = 0;
      if (n > 0 && options[0].score > 0) margin = n === 1 || options[0].score > options[1].score ? 2 : 1;
      const rank = coder.folded(RANKS + 3 * Math.min(n, 6) + margin);
      if (rank < n) return this.#walk(t, size, options[rank].place, options[rank].apex);
    }
    const place = coder.folded(EXPLICIT);
    const apex = coder.folded(EXPLICIT + 1);
    if (place > size - 3 || apex > 2) return false;
    if (size > MOST_RANKED && coder.folded(EXPLICIT + 2) === 0) return this.#walk(t, size, place, apex);
    return this.#decodeMembers(t, size, place, apex);
  }

  /** Each triangle of a fan by its number; false if they are none. */
  #decodeMembers(t, size, place, ownApex) {
    const { coder, triangles, apexes, isUsed, parts, count } = this;
    for (let i = 0; i < size - 2; i++) {
      let [triangle, apex] = [t, ownApex];
      if (i !== place) {
        triangle = t + coder.folded(EXPLICIT + 3);
        apex = coder.folded(EXPLICIT + 4);
        if (triangle === t || triangle >= parts.length || apex > 2) return false;
        if (isUsed[triangle] || parts[triangle] !== parts[t]) return false;
      }
      triangles[count + i] = triangle;
      apexes[count + i] = apex;
    }
    for (let i = count; i < count + size - 2; i++) {
      if (isUsed[triangles[i]]) return false; // one triangle twice
      isUsed[triangles[i]] = 1;
      if (i > count && !this.#followsInFan(i)) return false;
    }
    return true;
  }

  /** Whether the triangle arranged at i continues the fan of the one before. */
  #followsInFan(i) {
    const { flat, triangles, apexes } = this;
    const vertex = (k, turn) => flat[3 * triangles[k] + ((apexes[k] + turn) % 3)];
    return vertex(i, 0) === vertex(i - 1, 0) && vertex(i, 1) === vertex(i - 1, 2);
  }

  /** Places and apexes that give a fan, the likeliest first. */
  #findOptions(t, size) {
    const options = [];
    for (let place = 0; place < size - 2; place++) {
      for (let apex = 0; apex < 3; apex++) {
        if (!this.#tryWalk(t, size, place, apex)) continue;
        const score = this.#score(size);
        let i = options.length;
        while (i > 0 && options[i - 1].score < score) i--;
        options.splice(i, 0, { place, apex, score });
      }
    }
    return options;
  }

  #walk(t, size, place, apex) {
    if (!this.#tryWalk(t, size, place, apex)) return false;
    for (let i = this.count; i < this.count + size - 2; i++) this.isUsed[this.triangles[i]] = 1;
    return true;
  }

  /** Put the fan of an option behind the triangles arranged; false if a triangle is missing. */
  #tryWalk(t, size, place, apex) {
    const { count } = this;
    this.stamps[t] = ++this.walks;
    this.triangles[count + place] = t;
    this.apexes[count + place] = apex;
    for (let i = place + 1; i < size - 2; i++) if (!this.#step(count + i - 1, 1)) return false;
    for (let i = place - 1; i >= 0; i--) if (!this.#step(count + i + 1, -1)) return false;
    return true;
  }

  /** Put the triangle that follows (1) or precedes (-1) the arranged one at a place beside it; false if there is none. */
  #step(at, direction) {
    const { flat, opposite, parts, isUsed, stamps, triangles, apexes } = this;
    const t = triangles[at];
    const apex = apexes[at];
    const [ahead, behind] = direction > 0 ? [1, 2] : [2, 1];
    const corner = opposite[3 * t + ((apex + ahead) % 3)];
    if (corner < 0) return false;
    const other = Math.floor(corner / 3);
    if (isUsed[other] || stamps[other] === this.walks || parts[other] !== parts[t]) return false;
    const turned = (corner + ahead) % 3;
    const shared = (turned + ahead) % 3;
    if (flat[3 * other + turned] !== flat[3 * t + apex]) return false;
    if (flat[3 * other + shared] !== flat[3 * t + ((apex + behind) % 3)]) return false;
    stamps[other] = this.walks;
    triangles[at + direction] = other;
    apexes[at + direction] = turned;
    return true;
  }

  /** The corner opposite to an edge of the polygon arranged last. */
  #edgeCorner(size, edge) {
    const { triangles, apexes, count } = this;
    const corner = (k, turn) => 3 * triangles[k] + ((apexes[k] + turn) % 3);
    if (edge === 0) return corner(count, 2);
    if (edge === size - 1) return corner(count + size - 3, 1);
    return corner(count + edge - 1, 0);
  }

  /** Where it is noted which edge of a polygon of `size` lies to the edge opposite to `corner`; -1: nothing is. */
  #lesson(corner, size) {
    if (corner < 0 || this.edgeNumbers[corner] < 0) return -1;
    return (this.edgeSizes[corner] * WIDTH + this.edgeNumbers[corner]) * WIDTH + size;
  }

  /** How many more edges of the fan just put lie to their neighbours as was learned, than do not. */
  #score(size) {
    let score = 0;
    for (let edge = 0; edge < size; edge++) {
      const lesson = this.#lesson(this.opposite[this.#edgeCorner(size, edge)], size);
      if (lesson < 0 || this.learned[lesson] < 0) continue;
      score += this.learned[lesson] === edge ? 1 : -1;
    }
    return score;
  }

  /** Note the edges of the polygon arranged last, and how they lie to those of its neighbours. */
  #noteEdges(size) {
    if (size > MOST_RANKED) return;
    for (let edge = 0; edge < size; edge++) {
      const lesson = this.#lesson(this.opposite[this.#edgeCorner(size, edge)], size);
      if (lesson >= 0) this.learned[lesson] = edge;
    }
    for (let edge = 0; edge < size; edge++) {
      const corner = this.#edgeCorner(size, edge);
      this.edgeNumbers[corner] = edge;
      this.edgeSizes[corner] = size;
    }
  }
}
