/** The mesh that attributes lie on, as it is before they are decoded. Mirrors `gvpipe.attributes.surface`. */

import { previousEqual } from "../format/points.js";
import { numberByFirst, oppositeCorners } from "./corners.js";

export class Surface {
  #places = null;
  #opposite = null;

  /**
   * @param {import("../wasm/kernels.js").Kernels} kernels
   * @param {Uint32Array} faces (3T) vertices, in their final order
   * @param {number} nVertices
   * @param {Float32Array|null} positions (V, 3) of frame 0; null where attributes are predicted without geometry
   * @param {number} nParts
   */
  constructor(kernels, faces, nVertices, positions, nParts) {
    this.kernels = kernels;
    this.faces = faces;
    this.nVertices = nVertices;
    this.positions = positions;
    this.nParts = nParts;
  }

  /** (V) a number for each vertex, equal where positions are; without positions all differ. */
  get places() {
    if (this.#places) return this.#places;
    this.#places = Uint32Array.from({ length: this.nVertices }, (_, v) => v);
    if (this.positions) {
      const bits = new Int32Array(this.positions.map((c) => c + 0).buffer); // no negative zeros
      const previous = previousEqual(bits, 3);
      previous.forEach((twin, v) => twin >= 0 && (this.#places[v] = this.#places[twin]));
    }
    return this.#places;
  }

  /** Whether positions are known, some are shared, and every vertex is a corner. */
  get mayWeld() {
    const isUsed = new Uint8Array(this.nVertices);
    for (let c = 0; c < this.faces.length; c++) isUsed[this.faces[c]] = 1;
    return this.places.some((place, v) => place !== v) && isUsed.every((used) => used);
  }

  /** The surface with vertices of one position as one, numbered by the first corner that uses each. */
  welded() {
    const { faces, places, positions } = this;
    const welded = numberByFirst(Uint32Array.from(faces, (vertex) => places[vertex]), this.nVertices);
    const count = welded.reduce((most, vertex) => Math.max(most, vertex + 1), 0);
    const own = new Float32Array(3 * count);
    for (let c = faces.length - 1; c >= 0; c--) own.set(positions.subarray(3 * faces[c], 3 * faces[c] + 3), 3 * welded[c]);
    return new Surface(this.kernels, welded, count, own, this.nParts);
  }

  /** (3T) `oppositeCorners` of the faces. */
  get opposite() {
    return (this.#opposite ??= oppositeCorners(this.faces));
  }
}
