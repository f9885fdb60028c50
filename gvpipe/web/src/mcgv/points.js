/** Vertices at one base position as one point. Mirrors `gvcodecs.mcgv.points`. */

import { previousEqual } from "../format/points.js";

export class Points {
  /**
   * @param {Int32Array} lattice (V, 3) base frame on its lattice, flat
   * @param {Uint32Array} faces (T, 3) flat
   * @param {Int32Array} visits (V) each vertex' place in the codec's order
   */
  constructor(lattice, faces, visits) {
    const n = visits.length;
    const order = new Int32Array(n); // vertices in the codec's order
    visits.forEach((place, v) => (order[place] = v));
    const ordered = new Int32Array(3 * n);
    for (let i = 0; i < ordered.length; i++) ordered[i] = lattice[3 * order[Math.floor(i / 3)] + (i % 3)];
    const previous = previousEqual(ordered, 3);
    const members = [];
    /** (V) the point of each vertex: points are numbered as their first vertices come in the codec's order. */
    this.point = new Int32Array(n);
    order.forEach((v, place) => {
      this.point[v] = previous[place] < 0 ? members.push(v) - 1 : this.point[order[previous[place]]];
    });
    /** (P) the first vertex of each point, in the codec's order. */
    this.members = Int32Array.from(members);
    this.faces = faces.map((v) => this.point[v]);
  }

  /**
   * Adjacent points of lower number: `earlier_neighbours` of `weight_coding`.
   *
   * @returns {{starts: Int32Array, near: Int32Array}} `starts` (P + 1) bounds in `near`; each point's are ascending
   */
  earlierNeighbours() {
    const { faces } = this;
    const n = this.members.length;
    const counts = new Int32Array(n + 1); // by lower point: the pairs are sorted by it first, then by the higher one
    const eachPair = (use) => {
      for (let i = 0; i < faces.length; i++) {
        const [a, b] = [faces[i], faces[i % 3 === 2 ? i - 2 : i + 1]];
        if (a !== b) use(Math.min(a, b), Math.max(a, b));
      }
    };
    eachPair((low) => counts[low + 1]++);
    for (let p = 0; p < n; p++) counts[p + 1] += counts[p];
    const highs = new Int32Array(counts[n]);
    eachPair((low, high) => (highs[counts[low]++] = high)); // counts now end where they began
    const latest = new Int32Array(n).fill(-1); // the lower point that a point was last met with
    const starts = new Int32Array(n + 1);
    const eachEdge = (use) => {
      latest.fill(-1);
      for (let low = 0, i = 0; low < n; low++) {
        for (; i < counts[low]; i++) {
          if (latest[highs[i]] === low) continue;
          latest[highs[i]] = low;
          use(low, highs[i]);
        }
      }
    };
    eachEdge((_, high) => starts[high + 1]++);
    for (let p = 0; p < n; p++) starts[p + 1] += starts[p];
    const near = new Int32Array(starts[n]);
    const filled = starts.slice();
    eachEdge((low, high) => (near[filled[high]++] = low));
    return { starts, near };
  }

  /** (V) the connected piece of the surface that each vertex belongs to. */
  pieces() {
    const { faces, point } = this;
    const parent = Int32Array.from(this.members, (_, p) => p); // each a point of its piece: itself, or one of lower number
    const root = (p) => {
      while (parent[p] !== p) p = parent[p] = parent[parent[p]];
      return p;
    };
    for (let i = 0; i < faces.length; i++) {
      if (i % 3 === 2) continue; // two sides join three points
      const [a, b] = [root(faces[i]), root(faces[i + 1])];
      parent[Math.max(a, b)] = Math.min(a, b);
    }
    return point.map((p) => root(p));
  }
}
