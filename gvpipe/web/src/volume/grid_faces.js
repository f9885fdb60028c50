/** Where cells meet and where they end, and which rows numbers inside have. Mirrors `gvpipe.grids.borders` and `gvpipe.asset_coding.volume_rows`. */

import { CELLS_VOLUMES as VOLUMES } from "../constants.js";
import { previousEqual } from "../format/points.js";

/**
 * @typedef {object} Cells
 * @property {Uint8Array} types (M) VTK's number of each cell's type
 * @property {Int32Array} offsets (M + 1) where each cell's nodes start
 * @property {Int32Array} nodes points: first the surface's vertices, then inner points
 *
 * @param {Cells} cells @param {Int32Array} faces (3T) @param {Int32Array|null} polygons corners of each; null: all are triangles
 * @returns {{triangles: Int32Array, inner: Int32Array, edges: Int32Array}} `triangles` (M): the first triangle of the surface that
 *   belongs to a face of each cell, -1 for inner cells; `inner`: their numbers; `edges` (2E): pairs of inner cells that share a face
 */
export function cellRows(cells, faces, polygons) {
  const width = Math.max(polygons ? 4 : 3, ...[...VOLUMES].filter(([kind]) => cells.types.includes(kind)).flatMap(([, own]) => own.map((face) => face.length)));
  const { rows: known, owners } = facesOf(cells, width);
  const outlines = outlinesOf(faces, polygons, width);
  const rows = new Int32Array(known.length + outlines.length);
  rows.set(known);
  rows.set(outlines, known.length);
  const previous = previousEqual(rows, width);
  const triangles = new Int32Array(cells.types.length).fill(-1);
  const starts = polygonStarts(faces, polygons);
  for (let p = outlines.length / width - 1; p >= 0; p--) { // the first of several comes last
    let face = previous[owners.length + p];
    while (face >= owners.length) face = previous[face];
    if (face >= 0) triangles[owners[face]] = starts[p];
  }
  const number = new Int32Array(triangles.length).fill(-1);
  const inner = [];
  triangles.forEach((triangle, cell) => triangle < 0 && (number[cell] = inner.push(cell) - 1));
  const edges = [];
  for (let i = 0; i < owners.length; i++) {
    if (previous[i] < 0) continue;
    const [a, b] = [number[owners[previous[i]]], number[owners[i]]];
    if (a >= 0 && b >= 0) edges.push(a, b);
  }
  return { triangles, inner: Int32Array.from(inner), edges: Int32Array.from(edges) };
}

/** (2E) pairs of inner points, counted from 0, with an edge between them; a pair may be there more than once. */
export function pointEdges({ types, offsets, nodes }, nSurface) {
  const endsOf = new Map([...VOLUMES].map(([kind, faces]) => [kind, edgesOf(faces)]));
  const edges = [];
  for (let cell = 0; cell < types.length; cell++) {
    for (const [a, b] of endsOf.get(types[cell])) {
      const [from, to] = [nodes[offsets[cell] + a] - nSurface, nodes[offsets[cell] + b] - nSurface];
      if (from >= 0 && to >= 0) edges.push(from, to);
    }
  }
  return Int32Array.from(edges);
}

/** Pairs of nodes that follow each other around a face, each once. */
export function edgesOf(faces) {
  const pairs = faces.flatMap((face) => face.map((a, i) => [a, face[(i + 1) % face.length]].sort((x, y) => x - y).join()));
  return [...new Set(pairs)].map((pair) => pair.split(",").map(Number));
}

/** First triangle of each polygon. */
export function polygonStarts(faces, polygons) {
  if (!polygons) return Int32Array.from({ length: faces.length / 3 }, (_, t) => t);
  let next = 0;
  return polygons.map((corners) => (next += corners - 2) - (corners - 2));
}

/** All faces, in the order of types and then of cells: rising nodes in rows of `width`, -1 behind them, and the cell of each. */
function facesOf({ types, offsets, nodes }, width) {
  const kinds = [...VOLUMES].map(([kind, faces]) => ({ faces, cells: cellsOf(types, kind) }));
  const count = kinds.reduce((sum, { faces, cells }) => sum + faces.length * cells.length, 0);
  const [rows, owners] = [new Int32Array(width * count).fill(-1), new Int32Array(count)];
  let n = 0;
  for (const { faces, cells } of kinds) {
    for (const face of cells.length ? faces : []) {
      for (const cell of cells) {
        for (let i = 0; i < face.length; i++) insert(rows, width * n, i, nodes[offsets[cell] + face[i]]);
        owners[n++] = cell;
      }
    }
  }
  return { rows, owners };
}

function cellsOf(types, kind) {
  const found = [];
  types.forEach((type, cell) => type === kind && found.push(cell));
  return found;
}

/** The corners of each polygon as rows like those of faces; polygons of more corners than any face are rows of -1. */
function outlinesOf(faces, polygons, width) {
  const starts = polygonStarts(faces, polygons);
  const rows = new Int32Array(width * starts.length).fill(-1);
  starts.forEach((start, p) => {
    const corners = polygons ? polygons[p] : 3;
    if (corners > width) return;
    for (let i = 0; i < corners; i++) insert(rows, width * p, i, cornerOf(faces, start, i));
  });
  return rows;
}

/** Corner i of the polygon whose fan starts at a triangle. */
export function cornerOf(faces, start, i) {
  return i < 2 ? faces[3 * start + i] : faces[3 * (start + i - 2) + 2];
}

/** Put a number among the `count` rising ones of a row. */
function insert(rows, start, count, value) {
  let at = start + count;
  for (; at > start && rows[at - 1] > value; at--) rows[at] = rows[at - 1];
  rows[at] = value;
}
