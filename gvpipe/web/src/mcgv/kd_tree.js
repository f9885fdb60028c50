/**
 * Placement by halving: each slot's pixel, from the base frame's integers alone. Mirrors `gvcodecs.mcgv.layout.kd_tree`, but cell by
 * cell, not level by level; `docs/format.md`, section 5.1. All sums stay below 2^53.
 */

import {
  DIRECTIONS_COMMON as COMMON,
  KD_TREE_FRAME as FRAME,
  KD_TREE_MAX_COORDINATE as MAX_COORDINATE,
  KD_TREE_MOMENT_BITS as MOMENT_BITS,
  KD_TREE_SPREAD as SPREAD,
} from "../constants.js";
import { corrupt } from "../format/errors.js";

const FEW = 24; // vertices that are sorted by insertion

const DIRECTIONS = directions();
/** COMMON times the spread along each direction, as factors of the moments xx, yy, zz, xy, xz, yz. */
const TERMS = DIRECTIONS.map(([x, y, z]) =>
  [x * x, y * y, z * z, 2 * x * y, 2 * x * z, 2 * y * z].map((term) => term * weight([x, y, z])),
);
const NONE = [0, 0, 0];

/**
 * @param {Int32Array} points (S, 3) slots of the base frame on its lattice, flat; called vertices below
 * @param {ArrayLike<number>|null} groups (S) slots that belong together, such as clusters with a motion each
 * @param {{width: number, height: number, block: number}} plane pixels; holds all slots
 * @returns {Uint32Array} (S) row-major index of each slot's pixel, all distinct
 */
export function place(points, groups, { width, height, block }) {
  checkLattice(points);
  const order = Uint32Array.from({ length: points.length / 3 }, (_, v) => v);
  const cells = [{ start: 0, end: order.length, x: 0, y: 0, width, height, across: NONE, down: NONE }];
  const spread = spreadGroups(points, groups);
  return fill(cells, order, spread, width, block, momentShift(spread));
}

/** Throw for points (V, 3) on too fine a lattice. */
export function checkLattice(points) {
  if (points.some((c) => c >= MAX_COORDINATE)) throw corrupt("mesh", "its lattice is too fine for placement by halves");
}

/**
 * Halve cells down to single pixels.
 *
 * @param {object[]} cells each with vertices, no more than pixels; emptied
 * @param {Uint32Array} order vertices, which `start` and `end` of the cells are places in; sorted
 * @param {Int32Array} points (V, 3) all coordinates from 0, flat
 * @param {number} width of the plane @param {number} block pixels
 * @param {number|null} shift of moments where cells turn as their vertices do; null: they keep their directions
 * @returns {Uint32Array} (V) pixels
 */
export function fill(cells, order, points, width, block, shift) {
  const pixels = new Uint32Array(order.length);
  while (cells.length) {
    const cell = cells.pop();
    if (cell.width > 1 || cell.height > 1) cells.push(...halve(cell, order, points, shift, block));
    else pixels[order[cell.start]] = cell.y * width + cell.x;
  }
  return pixels;
}

/** Bits that the second moments of points, from 0, do without. */
export function momentShift(points) {
  const largest = points.reduce((a, b) => Math.max(a, b), 0);
  return Math.max(0, 32 - Math.clz32(largest) - MOMENT_BITS);
}

/** The direction in which vertices spread most, and the one of those at 60 degrees or more from it. */
export function widestPair(vertices, points, shift) {
  return pairOf(scoresOf(moments(vertices, points, shift)));
}

function pairOf(scores) {
  const one = DIRECTIONS[firstLargest(scores)];
  const isFar = (d) => 4 * dot(d, one) ** 2 * weight(d) * weight(one) <= COMMON ** 2;
  return [one, DIRECTIONS[firstLargest(scores.map((score, i) => (isFar(DIRECTIONS[i]) ? score : -1)))]];
}

/** Points with groups moved apart; all coordinates from 0. */
function spreadGroups(points, groups) {
  const spread = Int32Array.from(points);
  const n = points.length / 3;
  if (groups) {
    const counts = [];
    const sums = []; // (groups, 3) flat
    const total = [0, 0, 0];
    for (let v = 0; v < n; v++) {
      counts[groups[v]] = (counts[groups[v]] ?? 0) + 1;
      for (let axis = 0; axis < 3; axis++) {
        sums[3 * groups[v] + axis] = (sums[3 * groups[v] + axis] ?? 0) + points[3 * v + axis];
        total[axis] += points[3 * v + axis];
      }
    }
    for (let i = 0; i < spread.length; i++) {
      const group = groups[Math.floor(i / 3)];
      spread[i] += SPREAD * (Math.floor(sums[3 * group + (i % 3)] / counts[group]) - Math.floor(total[i % 3] / n));
    }
  }
  for (let axis = 0; axis < 3; axis++) {
    let least = Infinity;
    for (let i = axis; i < spread.length; i += 3) least = Math.min(least, spread[i]);
    for (let i = axis; i < spread.length; i += 3) spread[i] -= least;
  }
  return spread;
}

/** Cut a cell across its longer side; return the halves that hold vertices. Sorts its part of `order`. */
function halve(cell, order, points, shift, block) {
  const isWide = cell.width >= cell.height;
  const longer = isWide ? cell.width : cell.height;
  const { across, down } = turn(cell, order, points, shift, isWide);
  sortAlong(order.subarray(cell.start, cell.end), points, isWide ? across : down);
  const first = longer >= 2 * block ? Math.floor(longer / block / 2) * block : Math.floor(longer / 2);
  const middle = cell.start + Math.floor((2 * (cell.end - cell.start) * first + longer) / (2 * longer));
  const cut = (start, end, offset, side) => ({
    start, end, across, down,
    x: cell.x + (isWide ? offset : 0),
    y: cell.y + (isWide ? 0 : offset),
    width: isWide ? side : cell.width,
    height: isWide ? cell.height : side,
  });
  const halves = [cut(cell.start, middle, 0, first), cut(middle, cell.end, first, longer - first)];
  return halves.filter((half) => half.end > half.start);
}

/** A cell's directions after a look at its vertices. */
function turn(cell, order, points, shift, isWide) {
  const { across, down } = cell;
  if (shift === null) return { across, down };
  const isFrame = cell.width === FRAME && cell.height === FRAME;
  if (!isFrame && cell.width <= FRAME && cell.height <= FRAME) return { across, down };
  const scores = scoresOf(moments(order.subarray(cell.start, cell.end), points, shift));
  if (!isFrame) {
    const one = DIRECTIONS[firstLargest(scores)];
    return isWide ? { across: towards(one, across), down } : { across, down: towards(one, down) };
  }
  const [one, two] = pairOf(scores);
  const swap = likeness(two, across) + likeness(one, down) > likeness(one, across) + likeness(two, down);
  return { across: towards(swap ? two : one, across), down: towards(swap ? one : two, down) };
}

/** Second moments of vertices about their mean: xx, yy, zz, xy, xz, yz. */
function moments(vertices, points, shift) {
  const sums = [0, 0, 0];
  for (const v of vertices) for (let axis = 0; axis < 3; axis++) sums[axis] += points[3 * v + axis];
  const [meanX, meanY, meanZ] = sums.map((sum) => Math.floor(sum / vertices.length));
  let [xx, yy, zz, xy, xz, yz] = [0, 0, 0, 0, 0, 0];
  for (const v of vertices) {
    const x = (points[3 * v] - meanX) >> shift;
    const y = (points[3 * v + 1] - meanY) >> shift;
    const z = (points[3 * v + 2] - meanZ) >> shift;
    xx += x * x;
    yy += y * y;
    zz += z * z;
    xy += x * y;
    xz += x * z;
    yz += y * z;
  }
  return [xx, yy, zz, xy, xz, yz];
}

function scoresOf(m) {
  return TERMS.map((t) => t[0] * m[0] + t[1] * m[1] + t[2] * m[2] + t[3] * m[3] + t[4] * m[4] + t[5] * m[5]);
}

/** Sort vertices along a direction, stably. */
function sortAlong(vertices, points, direction) {
  const n = vertices.length;
  const [a, b, c] = direction;
  const keys = new Float64Array(n);
  let least = Infinity;
  for (let i = 0; i < n; i++) {
    const v = 3 * vertices[i];
    keys[i] = a * points[v] + b * points[v + 1] + c * points[v + 2];
    least = Math.min(least, keys[i]);
  }
  if (n <= FEW) return insertionSort(vertices, keys);
  for (let i = 0; i < n; i++) keys[i] = (keys[i] - least) * n + i;
  keys.sort();
  const before = vertices.slice();
  for (let i = 0; i < n; i++) vertices[i] = before[keys[i] % n];
  return undefined;
}

function insertionSort(vertices, keys) {
  for (let i = 1; i < keys.length; i++) {
    const [vertex, key] = [vertices[i], keys[i]];
    let j = i;
    for (; j > 0 && keys[j - 1] > key; j--) {
      keys[j] = keys[j - 1];
      vertices[j] = vertices[j - 1];
    }
    keys[j] = key;
    vertices[j] = vertex;
  }
}

/** The 49 directions with coordinates -2..2, without common factors, one of each two opposite ones; lexicographic. */
function directions() {
  const found = [];
  const steps = [-2, -1, 0, 1, 2];
  for (const x of steps) {
    for (const y of steps) {
      for (const z of steps) {
        const isAhead = x > 0 || (x === 0 && (y > 0 || (y === 0 && z > 0)));
        if (isAhead && [x, y, z].some((c) => c % 2)) found.push([x, y, z]);
      }
    }
  }
  return found;
}

/** COMMON over the squared length. */
function weight(d) {
  return COMMON / Math.max(dot(d, d), 1);
}

function dot(a, b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/** COMMON squared times the squared cosine between two directions; 0 where one is unknown. */
function likeness(one, two) {
  return dot(one, two) ** 2 * weight(one) * weight(two);
}

function towards(direction, before) {
  return dot(direction, before) < 0 ? direction.map((c) => -c) : direction;
}

function firstLargest(values) {
  return values.reduce((best, value, i) => (value > values[best] ? i : best), 0);
}
