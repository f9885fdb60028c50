/** Nodes between the corners of quadratic cells. Mirrors `gvpipe.connectivity.cell_middles`. */

import {
  CELLS_SIZES as SIZES,
  CELL_MIDDLES_MIDDLES as MIDDLES,
  CELL_POSES_KINDS as KINDS,
  CELL_POSES_MOST_NODES as MOST_NODES,
} from "../constants.js";
import { previousEqual } from "../format/points.js";

/**
 * What a section of quadratic cells begins with.
 *
 * @returns {{types: number[], corners: number, isLate: boolean}} VTK's type of each kind of cells; points of the surface and inner
 *   corners; whether polygons begin in the middle of a side
 * @throws {GeometryVideoError} it is not as gvpipe writes it
 */
export function readTypes(cursor, counts) {
  const types = KINDS.map(() => cursor.u8());
  const fits = types.every((type, i) => type === 0 || type === KINDS[i] || MIDDLES.get(type)?.[0] === KINDS[i]);
  if (!fits || !types.some((type) => MIDDLES.has(type))) throw cursor.corrupt(`its kinds of cells are ${types}`);
  const corners = counts.vertices + cursor.varint(counts.points - counts.vertices, "a number");
  return { types, corners, isLate: cursor.u8() === 1 };
}

/** A polygon by its corners alone; its sides, `[end, end, middle]`, are added to `sides`. */
export function cornersOf({ nodes, size }, isLate, sides) {
  if (size < 6) return { nodes, size };
  const own = isLate ? [...nodes.slice(1, size), nodes[0]] : nodes.slice(0, size); // corner, middle, corner, ...
  for (let i = 0; i < size; i += 2) sides.push([own[i], own[(i + 2) % size], own[i + 1]]);
  const corners = own.filter((_, i) => i % 2 === 0);
  return { nodes: corners.length < 4 ? [...corners, 0] : corners, size: size / 2 };
}

/**
 * Cells with the nodes behind their corners: a vertex of the surface, that of an earlier cell, or the next new point.
 *
 * @param {{kinds: Int32Array, nodes: Int32Array, width: number, types: number[]}} walk
 * @throws {GeometryVideoError} there are not so many points
 */
export function withMiddles({ kinds, nodes, types }, sides, firstNew, nPoints, cursor) {
  const used = types.filter((type) => MIDDLES.has(type));
  const width = Math.max(...used.flatMap((type) => MIDDLES.get(type)[1].map((around) => around.length)));
  const most = Math.max(MOST_NODES, ...used.map((type) => SIZES.get(type)));
  const count = kinds.reduce((sum, kind) => sum + (MIDDLES.get(types[kind])?.[1].length ?? 0), sides.length);
  const keys = new Int32Array(width * count).fill(-1);
  const places = new Int32Array(count);
  const result = new Int32Array(most * kinds.length);
  let row = 0;
  const add = (key) => {
    key.sort((a, b) => a - b);
    keys.set(key, width * row);
    row++;
  };
  for (const [a, b] of sides) add([a, b]);
  kinds.forEach((kind, cell) => {
    const type = types[kind];
    if (!type) throw cursor.corrupt("it has cells of a kind without a type");
    result.set(nodes.subarray(MOST_NODES * cell, MOST_NODES * (cell + 1)), most * cell);
    const [linear, between] = MIDDLES.get(type) ?? [type, []];
    between.forEach((around, k) => {
      places[row] = most * cell + SIZES.get(linear) + k;
      add(around.map((corner) => nodes[MOST_NODES * cell + corner]));
    });
  });
  const previous = previousEqual(keys, width);
  const points = new Int32Array(count);
  let next = firstNew;
  for (let i = 0; i < count; i++) {
    points[i] = previous[i] >= 0 ? points[previous[i]] : i < sides.length ? sides[i][2] : next++;
    if (i >= sides.length) result[places[i]] = points[i];
  }
  if (next > nPoints) throw cursor.corrupt(`its cells have more nodes than the ${nPoints} points`);
  return { kinds, nodes: result, width: most, types };
}
