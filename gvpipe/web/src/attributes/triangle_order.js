/** The order and rotation of triangles that a codec does not keep: parts, polygons. Mirrors `gvpipe.attributes.triangle_order`. */

import { PART_KERNELS_N_PART_CONTEXTS as N_PART_CONTEXTS, POLYGON_KERNELS_N_CONTEXTS as N_POLYGON_CONTEXTS } from "../constants.js";
import { Cursor } from "../format/cursor.js";
import { SerialStream } from "../format/serial_stream.js";
import { oppositeCorners } from "./corners.js";

const [PARTS, POLYGONS] = [1, 2]; // flags

/**
 * @param {import("../wasm/kernels.js").Kernels} kernels
 * @param {Uint8Array} data section `arrangement`; empty: there is nothing to say
 * @param {Uint32Array} decoded (3T) the codec's triangles
 * @param {number} nParts
 * @param {number[]|null} vertexStarts (nParts + 1) first vertex of each part, if each has vertices of its own
 * @param {string} name of the section, for messages
 * @returns {{faces: Uint32Array, partStarts: number[], polygons: Int32Array|null}} (3T) triangles part after part, (nParts + 1) first
 *   triangle of each part, (P) corners of each polygon
 */
export function decodeArrangement(kernels, data, decoded, nParts, vertexStarts, name) {
  const cursor = new Cursor(data, name);
  const flags = data.length ? cursor.u8() : 0;
  if (flags > (PARTS | POLYGONS) || (data.length && !flags)) throw cursor.corrupt("unknown flags");
  const ranges = vertexStarts && partRanges(decoded, vertexStarts);
  let parts = ranges ?? new Int32Array(decoded.length / 3);
  if (parts.some((part) => part >= nParts)) throw cursor.corrupt("a vertex has no part");
  if (flags & PARTS) parts = decodeParts(kernels, cursor.block(), decoded, ranges, nParts, name);
  const { order, starts } = groupByPart(parts, nParts);
  const polygons = flags & POLYGONS ? decodePolygons(kernels, cursor.rest(), decoded, order, parts, name) : null;
  cursor.end();
  const faces = new Uint32Array(decoded.length);
  for (let t = 0; t < order.length; t++) {
    const from = 3 * order[polygons ? polygons.triangles[t] : t];
    const apex = polygons ? polygons.apexes[t] : 0;
    for (let k = 0; k < 3; k++) faces[3 * t + k] = decoded[from + ((apex + k) % 3)];
  }
  return { faces, partStarts: starts, polygons: polygons && Int32Array.from(polygons.sizes) };
}

/** (T) the part of each triangle's first vertex. */
function partRanges(decoded, vertexStarts) {
  const parts = new Int32Array(decoded.length / 3);
  for (let t = 0; t < parts.length; t++) {
    let [low, high] = [0, vertexStarts.length]; // the first start beyond the vertex
    while (low < high) {
      const middle = (low + high) >> 1;
      if (vertexStarts[middle] <= decoded[3 * t]) low = middle + 1;
      else high = middle;
    }
    parts[t] = low - 1;
  }
  return parts;
}

function decodeParts(kernels, data, decoded, ranges, nParts, name) {
  const own = kernels.fresh();
  const stream = new SerialStream(own, data, N_PART_CONTEXTS, name);
  const parts = own.array("int64", [decoded.length / 3]);
  own.call("code_parts", ...stream.arrays, own.whole(oppositeCorners(decoded)), own.whole(ranges ?? []), parts, nParts);
  stream.end();
  return Int32Array.from(own.numbers(parts));
}

/** Triangles in order of their parts, each part's in the order given; and the first of each part, then T. */
function groupByPart(parts, nParts) {
  const starts = new Array(nParts + 1).fill(0);
  for (const part of parts) starts[part + 1]++;
  for (let part = 0; part < nParts; part++) starts[part + 1] += starts[part];
  const next = starts.slice();
  const order = new Int32Array(parts.length);
  for (let t = 0; t < parts.length; t++) order[next[parts[t]]++] = t;
  return { order, starts };
}

/** Triangles in their final order, the corner with which each begins, and the corners of polygons. */
function decodePolygons(kernels, data, decoded, order, parts, name) {
  const own = kernels.fresh();
  const stream = new SerialStream(own, data, N_POLYGON_CONTEXTS, name);
  const flat = new Uint32Array(decoded.length);
  order.forEach((from, t) => flat.set(decoded.subarray(3 * from, 3 * from + 3), 3 * t));
  const soup = [own.array("int32", [order.length, 3], flat), own.whole(oppositeCorners(flat)), own.whole(order.map((t) => parts[t]))];
  const fans = Array.from({ length: 5 }, () => own.array("int64", [0])); // an encoder's
  const result = own.call("code_polygons", ...stream.arrays, ...soup, ...fans);
  stream.end();
  const [triangles, apexes, sizes] = result.map((array) => own.numbers(array));
  return { triangles, apexes, sizes };
}
