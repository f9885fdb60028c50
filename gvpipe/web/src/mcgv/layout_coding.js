/**
 * Where each slot sits in the picture, and which cluster moves it. Mirrors `decode_pixels`, `decode_clusters` and
 * `decode_slot_clusters` of `gvcodecs.mcgv.layout.coding`; `docs/format.md`, section 5.
 */

import { CODING_CONTEXTS as CONTEXTS } from "../constants.js";
import { Cursor } from "../format/cursor.js";
import { corrupt } from "../format/errors.js";
import { decodeIntegers } from "../format/integers.js";

/**
 * @param {Uint8Array} data section `pixels`
 * @param {number} n S
 * @param {import("./header.js").Header} header
 * @returns {Uint32Array} (S) row-major index of each slot's pixel in a plane, all distinct
 */
export function decodePixels(data, n, { width, height }) {
  const cursor = new Cursor(data, "pixels");
  const columns = cursor.take(cursor.varint(cursor.left, "a length"));
  const dx = decodeIntegers(columns, n, null, "pixels");
  const dy = decodeIntegers(cursor.rest(), n, Uint8Array.from(dx, (d) => Math.min(Math.abs(d), CONTEXTS - 1)), "pixels");
  const taken = new Uint8Array(width * height);
  const pixels = new Uint32Array(n);
  for (let i = 0, x = 0, y = 0; i < n; i++) {
    x += dx[i];
    y += dy[i];
    if (x < 0 || x >= width || y < 0 || y >= height) throw cursor.corrupt("a pixel lies outside the plane");
    pixels[i] = y * width + x;
    if (taken[pixels[i]]++) throw cursor.corrupt("two slots share a pixel");
  }
  return pixels;
}

/**
 * @param {Uint8Array} data section `clusters`
 * @param {Uint32Array} pixels of `decodePixels`
 * @param {import("./header.js").Header} header
 * @returns {Uint16Array} (S) cluster of each slot, 0..K-1
 */
export function decodeClusters(data, pixels, { width, height, block, clusters }) {
  const across = width / block;
  const blocks = pixels.map((p) => Math.floor(p / width / block) * across + Math.floor((p % width) / block));
  const rank = new Int32Array(across * (height / block)).fill(-1);
  for (const b of blocks) rank[b] = 0;
  let used = 0;
  for (let b = 0; b < rank.length; b++) if (rank[b] === 0) rank[b] = used++;
  const byBlock = decodeRunning(data, used, clusters);
  return Uint16Array.from(blocks, (b) => byBlock[rank[b]]);
}

/**
 * @param {Uint8Array} data section `clusters` of placement halves
 * @param {number} n S
 * @param {import("./header.js").Header} header
 * @returns {Uint16Array} (S) cluster of each slot, 0..K-1
 */
export function decodeSlotClusters(data, n, { clusters }) {
  return Uint16Array.from(decodeRunning(data, n, clusters));
}

/** Clusters, each told by its difference from the one before. */
function decodeRunning(data, count, clusters) {
  const values = decodeIntegers(data, count, null, "clusters");
  for (let i = 0, cluster = 0; i < count; i++) {
    cluster += values[i];
    if (cluster < 0 || cluster >= clusters) throw corrupt("clusters", `a cluster is not in 0..${clusters - 1}`);
    values[i] = cluster;
  }
  return values;
}
