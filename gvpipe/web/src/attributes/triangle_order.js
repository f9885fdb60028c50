/** The order and rotation of triangles that a codec does not keep: parts, polygons. Mirrors `gvpipe.attributes.triangle_order`. */

import { Cursor } from "../format/cursor.js";
import { SerialDecoder } from "../format/serial_decoder.js";
import { oppositeCorners } from "./corners.js";
import { N_POLYGON_CONTEXTS, PolygonDecoder } from "./polygons.js";

const [PARTS, POLYGONS] = [1, 2]; // flags
const N_PART_CONTEXTS = 3;

/**
 * @param {Uint8Array} data section `arrangement`; empty: there is nothing to say
 * @param {Uint32Array} decoded (3T) the codec's triangles
 * @param {number} nParts
 * @param {number[]|null} vertexStarts (nParts + 1) first vertex of each part, if each has vertices of its own
 * @param {string} name of the section, for messages
 * @returns {{faces: Uint32Array, partStarts: number[], polygons: Int32Array|null}} (3T) triangles part after part, (nParts + 1) first
 *   triangle of each part, (P) corners of each polygon
 */
export function decodeArrangement(data, decoded, nParts, vertexStarts, name) {
  const cursor = new Cursor(data, name);
  const flags = data.length ? cursor.u8() : 0;
  if (flags > (PARTS | POLYGONS) || (data.length && !flags)) throw cursor.corrupt("unknown flags");
  const ranges = vertexStarts && partRanges(decoded, vertexStarts);
  let parts = ranges ?? new Int32Array(decoded.length / 3);
  if (parts.some((part) => part >= nParts)) throw cursor.corrupt("a vertex has no part");
  if (flags & PARTS) parts = decodeParts(cursor.block(), decoded, ranges, nParts, name);
  const { order, starts } = groupByPart(parts, nParts);
  const polygons = flags & POLYGONS ? decodePolygons(cursor.rest(), decoded, order, parts, name) : null;
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

function decodeParts(data, decoded, ranges, nParts, name) {
  const coder = new SerialDecoder(data, N_PART_CONTEXTS, name);
  const opposite = oppositeCorners(decoded);
  const parts = new Int32Array(decoded.length / 3);
  let last = 0;
  for (let t = 0; t < parts.length; t++) {
    let [guess, context] = [last, 0];
    if (ranges) {
      [guess, context] = [ranges[t], 1];
    } else {
      const earlier = [0, 1, 2].map((k) => opposite[3 * t + k]).find((corner) => corner >= 0 && corner < 3 * t);
      if (earlier !== undefined) [guess, context] = [parts[Math.floor(earlier / 3)], 2];
    }
    last = guess + coder.value(context);
    if (!(last >= 0 && last < nParts)) throw coder.corrupt(`a triangle belongs to part ${last} of ${nParts}`);
    parts[t] = last;
  }
  coder.end();
  return parts;
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

function decodePolygons(data, decoded, order, parts, name) {
  const coder = new SerialDecoder(data, N_POLYGON_CONTEXTS, name);
  const flat = new Uint32Array(decoded.length);
  order.forEach((from, t) => flat.set(decoded.subarray(3 * from, 3 * from + 3), 3 * t));
  const decoder = new PolygonDecoder(coder, flat, oppositeCorners(flat), order.map((t) => parts[t]));
  const sizes = decoder.decode();
  coder.end();
  return { sizes, triangles: decoder.triangles, apexes: decoder.apexes };
}
