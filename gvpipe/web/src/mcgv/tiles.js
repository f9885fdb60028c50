/**
 * Placement by tiles: charts become rectangles that fill the plane. Mirrors `gvcodecs.mcgv.layout.tiles`, but cell by cell, not
 * level by level; `docs/format.md`, section 5.5.
 */

import { checkLattice, fill, momentShift, widestPair } from "./kd_tree.js";

/**
 * @param {Int32Array} points (V, 3) base frame on its lattice, flat
 * @param {Int32Array} charts (V) of the vertices, 0..C-1, none empty
 * @param {{width: number, height: number, block: number}} plane pixels; holds all vertices
 * @returns {Uint32Array} (V) row-major index of each vertex' pixel, all distinct
 */
export function placeCharts(points, charts, { width, height, block }) {
  checkLattice(points);
  const own = fromZero(points);
  const shift = momentShift(own);
  const centres = centresOf(own, charts);
  const order = Uint32Array.from(charts, (_, v) => v);
  const [cells, tiles] = [[{ start: 0, end: order.length, x: 0, y: 0, width, height }], []];
  while (cells.length) {
    const cell = cells.pop();
    const vertices = order.subarray(cell.start, cell.end);
    if (vertices.every((v) => charts[v] === charts[vertices[0]])) {
      const [one, two] = widestPair(vertices, own, shift);
      tiles.push(cell.width >= cell.height ? { ...cell, across: one, down: two } : { ...cell, across: two, down: one });
      continue;
    }
    const [direction] = widestPair(vertices, centres, shift);
    const along = (v) => direction[0] * centres[3 * v] + direction[1] * centres[3 * v + 1] + direction[2] * centres[3 * v + 2];
    const members = new Map(); // of each chart, in order
    for (const v of vertices) {
      if (members.has(charts[v])) members.get(charts[v]).push(v);
      else members.set(charts[v], [v]);
    }
    const sorted = [...members.values()].sort(([v], [w]) => along(v) - along(w) || charts[v] - charts[w]);
    vertices.set(sorted.flat());
    cells.push(...cut(cell, sorted.map((part) => part.length)));
  }
  return fill(tiles, order, own, width, block, null);
}

/** Points with all coordinates from 0. */
function fromZero(points) {
  const least = [Infinity, Infinity, Infinity];
  points.forEach((c, i) => (least[i % 3] = Math.min(least[i % 3], c)));
  return points.map((c, i) => c - least[i % 3]);
}

/** (V, 3) flat: the mean of each vertex' chart, rounded down. */
function centresOf(points, charts) {
  const counts = [];
  const sums = []; // (C, 3) flat
  charts.forEach((chart, v) => {
    counts[chart] = (counts[chart] ?? 0) + 1;
    for (let axis = 0; axis < 3; axis++) sums[3 * chart + axis] = (sums[3 * chart + axis] ?? 0) + points[3 * v + axis];
  });
  return points.map((_, i) => {
    const chart = charts[Math.floor(i / 3)];
    return Math.floor(sums[3 * chart + (i % 3)] / counts[chart]);
  });
}

/** The two halves of a cell whose charts have so many vertices, in order. */
function cut({ start, end, x, y, width, height }, counts) {
  const n = end - start;
  const [longer, shorter] = [Math.max(width, height), Math.min(width, height)];
  let best = { worth: -1 };
  let kept = 0;
  for (const count of counts.slice(0, -1)) {
    kept += count;
    const least = Math.ceil(kept / shorter);
    const most = longer - Math.ceil((n - kept) / shorter);
    const isWhole = least <= most;
    const worth = Math.min(kept, n - kept) * (isWhole ? 2 : 1);
    if (worth > best.worth) best = { worth, kept, low: isWhole ? least : 1, high: isWhole ? most : longer - 1 };
  }
  const wanted = Math.floor((2 * longer * best.kept + n) / (2 * n));
  const first = Math.min(Math.max(wanted, best.low), best.high);
  const middle = start + Math.min(Math.max(best.kept, n - (longer - first) * shorter), first * shorter);
  return width >= height
    ? [
        { start, end: middle, x, y, width: first, height },
        { start: middle, end, x: x + first, y, width: width - first, height },
      ]
    : [
        { start, end: middle, x, y, width, height: first },
        { start: middle, end, x, y: y + first, width, height: height - first },
      ];
}
