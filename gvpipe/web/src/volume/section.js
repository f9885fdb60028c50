/** The section of a grid by a plane: cells as tetrahedra, each cut into triangles. Mirrors `gvpipe.rendering.cut`. */

import { CELLS_VOLUMES as VOLUMES } from "../constants.js";

/**
 * By type of cell: the nodes that its faces have, and fans of these faces around the first node, four nodes each.
 * @type {Map<number, {nodes: number[], tetrahedra: number[]}>}
 */
const FANS = new Map(
  [...VOLUMES].map(([kind, faces]) => {
    const nodes = [...new Set(faces.flat())].sort((a, b) => a - b);
    const others = faces.filter((face) => !face.includes(nodes[0]));
    const fan = (face) => face.slice(1, -1).flatMap((node, i) => [nodes[0], face[0], node, face[i + 2]]);
    return [kind, { nodes, tetrahedra: others.flatMap(fan) }];
  }),
);

/** Corners of triangles, each between two points, and the cell of each triangle; arrays that stay from cut to cut. */
export class Section {
  #capacity = 0;
  #heights = new Float64Array(0); // (N) above the plane
  #corners = new Int32Array(4); // of a tetrahedron

  constructor() {
    this.count = 0; // of triangles
    this.#grow();
  }

  #grow() {
    const [ends, parts, cells] = [this.ends, this.parts, this.cells];
    this.#capacity = 2 * this.#capacity || 1024;
    /** (3 count, 2) the points of each corner. */
    this.ends = new Int32Array(6 * this.#capacity);
    /** (3 count) how far from the first to the second it lies. */
    this.parts = new Float64Array(3 * this.#capacity);
    /** (count) the cell of each triangle. */
    this.cells = new Int32Array(this.#capacity);
    if (!ends) return;
    this.ends.set(ends);
    this.parts.set(parts);
    this.cells.set(cells);
  }

  /**
   * @param {{types: Uint8Array, offsets: Int32Array, nodes: Int32Array}} grid
   * @param {Float32Array} points (N, 3) @param {number} axis @param {number} place of the plane
   * @param {number} sign 1: what lies above is left out; -1: what lies below
   */
  cut({ types, offsets, nodes }, points, axis, place, sign) {
    this.count = 0;
    if (this.#heights.length !== points.length / 3) this.#heights = new Float64Array(points.length / 3);
    const heights = this.#heights;
    for (let i = 0; i < heights.length; i++) heights[i] = sign * (points[3 * i + axis] - place);
    for (let cell = 0; cell < types.length; cell++) {
      const { nodes: used, tetrahedra } = FANS.get(types[cell]);
      const start = offsets[cell];
      let low = 0;
      for (let i = 0; i < used.length; i++) if (heights[nodes[start + used[i]]] <= 0) low++;
      if (low === 0 || low === used.length) continue;
      for (let i = 0; i < tetrahedra.length; i += 4) this.#cutOne(nodes, start, tetrahedra, i, cell);
    }
  }

  /** The triangle of a tetrahedron with one corner on a side, or the two of one with two. */
  #cutOne(nodes, start, tetrahedra, first, cell) {
    const sorted = this.#corners; // those below, then those above, each in order
    let below = 0;
    for (let i = 0; i < 4; i++) if (this.#heights[nodes[start + tetrahedra[first + i]]] <= 0) below++;
    let [low, high] = [0, below];
    for (let i = 0; i < 4; i++) {
      const node = nodes[start + tetrahedra[first + i]];
      if (this.#heights[node] <= 0) sorted[low++] = node;
      else sorted[high++] = node;
    }
    const [a, b, c, d] = sorted;
    if (below === 2) {
      this.#add(a, c, a, d, b, d, cell);
      this.#add(a, c, b, d, b, c, cell);
    } else if (below === 1) {
      this.#add(a, b, a, c, a, d, cell);
    } else if (below === 3) {
      this.#add(d, a, d, b, d, c, cell);
    }
  }

  #add(a, b, c, d, e, f, cell) {
    if (this.count === this.#capacity) this.#grow();
    const corner = 3 * this.count;
    this.#place(corner, a, b);
    this.#place(corner + 1, c, d);
    this.#place(corner + 2, e, f);
    this.cells[this.count++] = cell;
  }

  #place(corner, one, other) {
    const [a, b] = one < other ? [one, other] : [other, one];
    const [from, to] = [this.#heights[a], this.#heights[b]];
    this.ends[2 * corner] = a;
    this.ends[2 * corner + 1] = b;
    this.parts[corner] = from === to ? 0 : Math.min(1, Math.max(0, from / (from - to)));
  }

  /** Swap two corners of a triangle. */
  turn(triangle) {
    const [b, c] = [3 * triangle + 1, 3 * triangle + 2];
    for (const [array, width] of [[this.ends, 2], [this.parts, 1]]) {
      for (let k = 0; k < width; k++) [array[width * b + k], array[width * c + k]] = [array[width * c + k], array[width * b + k]];
    }
  }

  /** Write where the corners of a triangle are. @param {number} triangle @param {Float32Array} points (N, 3) @param {Float32Array} positions */
  place(triangle, points, positions) {
    for (let corner = 3 * triangle; corner < 3 * triangle + 3; corner++) {
      const [a, b, part] = [3 * this.ends[2 * corner], 3 * this.ends[2 * corner + 1], this.parts[corner]];
      for (let k = 0; k < 3; k++) positions[3 * corner + k] = points[a + k] + part * (points[b + k] - points[a + k]);
    }
  }
}
