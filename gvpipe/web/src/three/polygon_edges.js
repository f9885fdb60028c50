/** The edges of polygons, without the diagonals of the fans that their triangles are. */

/**
 * @param {Uint32Array} index (3T) vertices of triangles
 * @param {Int32Array|null} polygons corners of each, whose triangles are a fan around its first corner; null: all are triangles
 * @param {[number, number][]} ranges of triangles whose edges are wanted, in order
 * @returns {Uint32Array} (2E) both vertices of each edge; an edge of two polygons is there twice
 */
export function polygonEdges(index, polygons, ranges) {
  const isFirst = new Uint8Array(index.length / 3 + 1).fill(polygons ? 0 : 1); // triangle of its polygon
  isFirst[index.length / 3] = 1;
  if (polygons) polygons.reduce((t, corners) => ((isFirst[t] = 1), t + corners - 2), 0);
  const edges = new Uint32Array(2 * index.length);
  let end = 0;
  const add = (a, b) => {
    edges[end++] = index[a];
    edges[end++] = index[b];
  };
  for (const [start, stop] of ranges) {
    for (let t = start; t < stop; t++) {
      const corner = 3 * t;
      if (isFirst[t]) add(corner, corner + 1);
      add(corner + 1, corner + 2);
      if (isFirst[t + 1]) add(corner + 2, corner);
    }
  }
  return edges.slice(0, end);
}
