/** Points: what a blend moves, the mesh's points that move. Mirrors `gvcodecs.mcgv.base.welded_points`. */

export class Points {
  /**
   * @param {Int32Array} faces (T, 3) triangles over points, flat; -1 for those that never move: sides that lack one count not
   * @param {number} n P
   */
  constructor(faces, n) {
    this.faces = faces;
    this.n = n;
  }

  /**
   * Adjacent points of lower number. Mirrors `gvcodecs.mcgv.base.causal_neighbours`.
   *
   * @returns {{starts: Int32Array, neighbours: Int32Array}} `starts` (P + 1) bounds in `neighbours`; each point's are ascending
   */
  causalNeighbours() {
    const { n } = this;
    const counts = new Int32Array(n + 1); // by lower point: the pairs are sorted by it first, then by the higher one
    this.#eachSide((low) => counts[low + 1]++);
    for (let p = 0; p < n; p++) counts[p + 1] += counts[p];
    const highs = new Int32Array(counts[n]);
    this.#eachSide((low, high) => (highs[counts[low]++] = high)); // counts now end where they began
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
    const neighbours = new Int32Array(starts[n]);
    const filled = starts.slice();
    eachEdge((low, high) => (neighbours[filled[high]++] = low));
    return { starts, neighbours };
  }

  /** (P) the connected piece of the surface that each point belongs to. */
  pieces() {
    const parent = Int32Array.from({ length: this.n }, (_, p) => p); // each a point of its piece: itself, or one of lower number
    const root = (p) => {
      while (parent[p] !== p) p = parent[p] = parent[parent[p]];
      return p;
    };
    this.#eachSide((low, high) => {
      const [a, b] = [root(low), root(high)];
      parent[Math.max(a, b)] = Math.min(a, b);
    });
    return parent.map((_, p) => root(p));
  }

  /** Call `use(low, high)` for every side of a triangle between two different points. */
  #eachSide(use) {
    const { faces } = this;
    for (let i = 0; i < faces.length; i++) {
      const [a, b] = [faces[i], faces[i % 3 === 2 ? i - 2 : i + 1]];
      if (a !== b && a >= 0 && b >= 0) use(Math.min(a, b), Math.max(a, b));
    }
  }
}
