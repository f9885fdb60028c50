/** The mesh that attributes lie on, as it is before they are decoded. Mirrors `gvpipe.attributes.surface`. */

import { previousEqual } from "../format/points.js";
import { oppositeCorners } from "./corners.js";

export class Surface {
  #places = null;
  #opposite = null;

  /**
   * @param {Uint32Array} faces (3T) vertices, in their final order
   * @param {number} nVertices
   * @param {Float32Array|null} positions (V, 3) of frame 0; null where attributes are predicted without geometry
   * @param {number} nParts
   */
  constructor(faces, nVertices, positions, nParts) {
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

  /** (3T) `oppositeCorners` of the faces. */
  get opposite() {
    return (this.#opposite ??= oppositeCorners(this.faces));
  }
}
