/** Cells of a grid, in order, and the order of the grid's points, from bytes. Mirrors `gvpipe.connectivity.cells`. */

import { CELLS_SIZES as SIZES, CELLS_VOLUMES as VOLUMES } from "../constants.js";
import { Cursor } from "../format/cursor.js";
import { inflate } from "../format/inflate.js";
import { fromPlanes } from "./planes.js";

const [IN_ORDER, BY_MASK, BY_PLACE] = [0, 1, 2];
const MOST_BYTES = 2 ** 31;

/**
 * @param {Uint8Array} data @param {number} nCells M @param {number} nPoints nodes are below @param {string} name of the section
 * @returns {Promise<import("./grid_faces.js").Cells>} nodes are numbered as the grid has them
 * @throws {GeometryVideoError} it holds other cells
 */
export async function decodeCells(data, nCells, nPoints, name) {
  const cursor = new Cursor(data, name);
  const runs = [];
  let count = 0;
  for (let left = cursor.varint(nCells, "the number of runs"); left > 0; left--) {
    const kind = cursor.u8();
    if (!VOLUMES.has(kind) || !SIZES.has(kind)) throw cursor.corrupt(`it has cells of type ${kind}`);
    runs.push([kind, cursor.varint(nCells, "a run")]);
    count += runs.at(-1)[1];
  }
  if (count !== nCells) throw cursor.corrupt(`it does not have ${nCells} cells`);
  const nNodes = runs.reduce((sum, [kind, cells]) => sum + SIZES.get(kind) * cells, 0);
  if (4 * nNodes > MOST_BYTES) throw cursor.corrupt(`it has ${nNodes} nodes`);
  const planes = await inflateAll(cursor.rest(), 4 * nNodes, cursor);
  const [types, offsets, nodes] = [new Uint8Array(nCells), new Int32Array(nCells + 1), new Int32Array(nNodes)];
  let [cell, at] = [0, 0];
  for (const [kind, cells] of runs) {
    const size = SIZES.get(kind) * cells;
    nodes.set(fromPlanes(planes.subarray(4 * at, 4 * (at + size)), cells), at);
    for (let i = 0; i < cells; i++, cell++) {
      types[cell] = kind;
      offsets[cell + 1] = offsets[cell] + SIZES.get(kind);
    }
    at += size;
  }
  if (!nodes.every((node) => node >= 0 && node < nPoints)) throw cursor.corrupt(`a cell has a node that is none of ${nPoints} points`);
  return { types, offsets, nodes };
}

/** (N) the place of each row's point in the grid, or null where they are in order. @throws {GeometryVideoError} */
export async function decodeOrder(data, nSurface, nPoints, name) {
  const cursor = new Cursor(data, name);
  const kind = cursor.u8();
  if (kind === IN_ORDER) return null;
  if (kind === BY_MASK) {
    const bits = await inflateAll(cursor.rest(), Math.ceil(nPoints / 8), cursor);
    const [surface, inner] = [[], []];
    for (let i = 0; i < nPoints; i++) ((bits[i >> 3] >> (7 - (i & 7))) & 1 ? surface : inner).push(i);
    if (surface.length !== nSurface) throw cursor.corrupt(`it has ${surface.length} points of the surface; ${nSurface} are needed`);
    return Int32Array.from([...surface, ...inner]);
  }
  if (kind !== BY_PLACE) throw cursor.corrupt(`it is of kind ${kind}`);
  const order = fromPlanes(await inflateAll(cursor.rest(), 4 * nPoints, cursor), nPoints);
  checkOrder(order, 0, nPoints, cursor);
  return order;
}

/** Bytes that inflate to exactly so many. */
export async function inflateAll(data, count, cursor) {
  const found = await inflate(data, count, (what) => cursor.corrupt(what));
  if (found.length !== count) throw cursor.corrupt(`it inflates to ${found.length} bytes; ${count} are needed`);
  return found;
}

/** Throw unless each number from `low` to `high` - 1 is there once. */
export function checkOrder(order, low, high, cursor) {
  const isThere = new Uint8Array(high - low);
  for (const value of order) {
    if (!(value >= low && value < high) || isThere[value - low]) throw cursor.corrupt("an order does not have each number once");
    isThere[value - low] = 1;
  }
}
