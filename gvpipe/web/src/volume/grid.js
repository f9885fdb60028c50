/** The grid of a volume from its sections, and the graphs of its rows; by kernels, in a worker. */

import {
  VOLUME_LIST_BY_CORNERS as BY_CORNERS,
  VOLUME_LIST_BY_WALK as BY_WALK,
  VOLUME_LIST_CELLS as CELLS,
  VOLUME_LIST_IN_ORDER as IN_ORDER,
  VOLUME_LIST_ORDER as ORDER,
} from "../constants.js";
import { corrupt } from "../format/errors.js";
import { decodeCells, decodeOrder } from "./cells.js";
import { cellRows, pointEdges } from "./grid_faces.js";
import { graphOrder } from "./row_graph.js";
import { decodeWalk } from "./walk.js";

/**
 * @param {import("../wasm/kernels.js").Kernels} kernels @param {{faces: Int32Array, polygons: Int32Array|null}} surface
 * @param {{sections: {cells: Uint8Array, order: Uint8Array}, counts: {vertices: number, inner: number, points: number, cells: number}}} volume
 * @returns {Promise<{grid: import("./volume.js").Grid, orders: {point: () => object, cell: () => object}}>} and the causal orders of
 *   inner points and inner cells
 * @throws {GeometryVideoError} it is not as gvpipe writes it
 */
export async function openGrid(kernels, surface, { sections, counts }) {
  const [way, data] = [sections.cells[0], sections.cells.subarray(1)];
  if (![IN_ORDER, BY_WALK, BY_CORNERS].includes(way)) throw corrupt(CELLS, `it is coded by way ${way}`);
  const order = await decodeOrder(sections.order, counts.vertices, counts.points, ORDER);
  const cells =
    way === IN_ORDER
      ? renumbered(await decodeCells(data, counts.cells, counts.points, CELLS), order)
      : await decodeWalk(kernels, data, surface, counts, { name: CELLS, isLinear: way === BY_WALK });
  const { triangles, inner, edges } = cellRows(cells, surface.faces, surface.polygons);
  const orders = {
    point: () => graphOrder(pointEdges(cells, counts.vertices), counts.inner),
    cell: () => graphOrder(edges, inner.length),
  };
  const rows = new Int32Array(counts.cells).fill(-1);
  inner.forEach((cell, row) => (rows[cell] = row));
  return { grid: { ...cells, triangles, inner, rows }, orders };
}

/** Cells whose nodes are rows, of cells whose nodes are the grid's points. */
function renumbered(cells, order) {
  if (!order) return cells;
  const row = new Int32Array(order.length);
  order.forEach((place, i) => (row[place] = i));
  return { ...cells, nodes: cells.nodes.map((node) => row[node]) };
}
