/** Cells of a grid by a walk from the surface inwards, from bytes. Mirrors `gvpipe.connectivity.cell_traversal`. */

import {
  CELLS_SIZES as SIZES,
  CELLS_VOLUMES as VOLUMES,
  CELL_KERNELS_N_CONTEXTS as N_CONTEXTS,
  CELL_POSES_KINDS as KINDS,
  CELL_POSES_MOST_FACES as MOST_FACES,
  CELL_POSES_MOST_NODES as MOST_NODES,
  CELL_POSES_MOST_POSES as MOST_POSES,
  CELL_TRAVERSAL_KEEPS as KEEPS,
  CELL_TRAVERSAL_RANKED as RANKED,
} from "../constants.js";
import { Cursor } from "../format/cursor.js";
import { previousEqual } from "../format/points.js";
import { SerialStream } from "../format/serial_stream.js";
import { cornersOf, readTypes, withMiddles } from "./middles.js";
import { checkOrder, inflateAll } from "./cells.js";
import { cornerOf, edgesOf, polygonStarts } from "./grid_faces.js";
import { fromPlanes } from "./planes.js";

/**
 * @param {import("../wasm/kernels.js").Kernels} given kernels, whose memory is not used
 * @param {Uint8Array} data the section @param {{faces: Int32Array, polygons: Int32Array|null}} surface
 * @param {{vertices: number, points: number, cells: number}} counts points of the surface and in all, and M
 * @param {{name: string, isLinear: boolean}} about the section's name, for messages, and whether cells have corners alone
 * @returns {Promise<import("./grid_faces.js").Cells>} in the source's order, if it was kept
 * @throws {GeometryVideoError} it is not as gvpipe writes it
 */
export async function decodeWalk(given, data, { faces, polygons }, counts, { name, isLinear }) {
  const kernels = given.fresh();
  const cursor = new Cursor(data, name);
  const head = isLinear ? { types: KINDS, corners: counts.points, isLate: false } : readTypes(cursor, counts);
  const flags = cursor.u8();
  const [keeps, isRanked] = [(flags & KEEPS) !== 0, (flags & RANKED) !== 0];
  const marked = markedSeeds(faces, polygons, cursor.block(), isLinear ? [3, 4] : [3, 4, 6, 8], cursor);
  const sides = [];
  const seeds = walkingOrder(marked.map((seed) => cornersOf(seed, head.isLate, sides)));
  const stream = new SerialStream(kernels, cursor.block(), N_CONTEXTS, name);
  const source = [[0], [0, MOST_NODES], [0, MOST_FACES], [0]].map((shape) => kernels.array("int64", shape));
  const shapes = [kernels.whole(seeds.flatMap(({ nodes }) => nodes), [seeds.length, 4]), kernels.whole(seeds.map(({ size }) => size))];
  const limits = [counts.vertices, head.corners, counts.cells];
  const found = kernels.call("code_cells", ...stream.arrays, ...placedPoses(kernels), ...source, ...shapes, ...limits, keeps, isRanked);
  stream.end();
  const coded = { kinds: kernels.numbers(found[0]), nodes: kernels.numbers(found[1]), width: MOST_NODES, types: head.types };
  const walk = isLinear ? coded : withMiddles(coded, sides, head.corners, counts.points, cursor);
  if (!keeps) {
    cursor.end();
    return asCells(walk, null, null);
  }
  const sources = fromPlanes(await inflateAll(cursor.block(), 4 * counts.cells, cursor), counts.cells);
  const nInner = counts.points - counts.vertices;
  const inner = fromPlanes(await inflateAll(cursor.rest(), 4 * nInner, cursor), nInner);
  checkOrder(sources, 0, counts.cells, cursor);
  checkOrder(inner, counts.vertices, counts.points, cursor);
  return asCells(walk, sources, { inner, vertices: counts.vertices });
}

/** Polygons with a cell behind them: `{nodes, size}`; the fourth node of a triangle is 0. */
function markedSeeds(faces, polygons, mask, sizes, cursor) {
  const starts = polygonStarts(faces, polygons);
  if (mask.length && mask.length !== Math.ceil(starts.length / 8)) {
    throw cursor.corrupt(`it has marks of ${8 * mask.length} polygons, and there are ${starts.length}`);
  }
  const seeds = [];
  for (let p = 0; p < starts.length; p++) {
    if (mask.length && !((mask[p >> 3] >> (7 - (p & 7))) & 1)) continue;
    const size = polygons ? polygons[p] : 3;
    if (!sizes.includes(size)) throw cursor.corrupt(`it has cells behind polygons of more than ${sizes.at(-1)} corners`);
    seeds.push({ nodes: Array.from({ length: Math.max(size, 4) }, (_, i) => (i < size ? cornerOf(faces, starts[p], i) : 0)), size });
  }
  return seeds;
}

/** Neighbours close to each other, from the first of each piece outwards. */
function walkingOrder(seeds) {
  const owners = seeds.flatMap(({ size }, p) => new Array(size).fill(p));
  const ends = seeds.flatMap(({ nodes, size }) => nodes.slice(0, size).flatMap((a, i) => [a, nodes[(i + 1) % size]].sort((x, y) => x - y)));
  const previous = previousEqual(ends, 2);
  const others = seeds.map(() => []);
  previous.forEach((before, edge) => {
    if (before < 0) return;
    others[owners[before]].push(owners[edge]);
    others[owners[edge]].push(owners[before]);
  });
  for (const each of others) each.sort((a, b) => a - b);
  const isTaken = new Uint8Array(seeds.length);
  const order = [];
  for (let first = 0; first < seeds.length; first++) {
    if (isTaken[first]) continue;
    isTaken[first] = 1;
    let at = order.push(first) - 1;
    for (; at < order.length; at++) {
      for (const other of others[order[at]]) {
        if (isTaken[other]) continue;
        isTaken[other] = 1;
        order.push(other);
      }
    }
  }
  return order.map((p) => seeds[p]);
}

function asCells({ kinds, nodes, width, types: ofKinds }, sources, renamed) {
  const count = kinds.length;
  const rows = new Int32Array(count); // of the walk, for each cell
  for (let row = 0; row < count; row++) rows[sources ? sources[row] : row] = row;
  const types = Uint8Array.from(rows, (row) => ofKinds[kinds[row]]);
  const offsets = new Int32Array(count + 1);
  types.forEach((type, cell) => (offsets[cell + 1] = offsets[cell] + SIZES.get(type)));
  const result = new Int32Array(offsets[count]);
  for (let cell = 0; cell < count; cell++) {
    for (let i = offsets[cell]; i < offsets[cell + 1]; i++) {
      const node = nodes[width * rows[cell] + i - offsets[cell]];
      result[i] = renamed && node >= renamed.vertices ? renamed.inner[node - renamed.vertices] : node;
    }
  }
  return { types, offsets, nodes: result };
}

/** The tables of `gvpipe.connectivity.cell_poses`, as kernels take them. */
function placedPoses(kernels) {
  const n = KINDS.length;
  const tables = {
    nodes: new Int32Array(n * 2 * MOST_POSES * MOST_NODES),
    counts: new Int32Array(n * 2),
    alike: new Int32Array(n * 2 * MOST_POSES), // an encoder's
    sizes: Int32Array.from(KINDS, (kind) => SIZES.get(kind)),
    edges: new Int32Array(n * MOST_NODES * MOST_NODES),
    faces: new Int32Array(n * MOST_FACES * 4),
    faceSizes: new Int32Array(n * MOST_FACES),
  };
  KINDS.forEach((kind, number) => fillPoses(tables, number, VOLUMES.get(kind), SIZES.get(kind)));
  const shapes = [[n, 2, MOST_POSES, MOST_NODES], [n, 2], [n, 2, MOST_POSES], [n], [n, MOST_NODES, MOST_NODES], [n, MOST_FACES, 4], [n, MOST_FACES]];
  return Object.values(tables).map((table, i) => kernels.whole(table, shapes[i]));
}

function fillPoses(tables, number, faces, size) {
  const edge = (a, b) => (number * MOST_NODES + a) * MOST_NODES + b;
  for (const [a, b] of edgesOf(faces)) tables.edges[edge(a, b)] = tables.edges[edge(b, a)] = 1;
  faces.forEach((face, f) => {
    tables.faces.set(face, 4 * (number * MOST_FACES + f));
    tables.faceSizes[number * MOST_FACES + f] = face.length;
  });
  for (const face of faces) {
    for (let turn = 0; turn < face.length; turn++) {
      const front = [...face.slice(turn), ...face.slice(0, turn)];
      const near = (node) => front.flatMap((each, i) => (tables.edges[edge(node, each)] ? [i] : []));
      const others = Array.from({ length: size }, (_, node) => node).filter((node) => !front.includes(node));
      others.sort((a, b) => compareLists(near(a), near(b)) || a - b);
      const row = 2 * number + face.length - 3;
      tables.nodes.set([...front, ...others], (row * MOST_POSES + tables.counts[row]) * MOST_NODES);
      tables.counts[row]++;
    }
  }
}

/** As Python compares lists. */
function compareLists(a, b) {
  const at = a.findIndex((value, i) => i >= b.length || value !== b[i]);
  if (at < 0) return a.length - b.length;
  return at >= b.length ? 1 : a[at] - b[at];
}
