/**
 * Which copy of its point each corner uses, coded along edges. Mirrors `gvpipe.connectivity.edge_seams` and its kernels;
 * `docs/format.md`, section 5.8.
 */

import {
  EDGE_SEAM_KERNELS_LATER as LATER,
  EDGE_SEAM_KERNELS_LOOK as LOOK,
  EDGE_SEAM_KERNELS_NEW as NEW,
  EDGE_SEAM_KERNELS_SAME as SAME,
  EDGE_SEAM_KERNELS_SINGLE as SINGLE,
} from "../constants.js";
import { corrupt } from "./errors.js";
import { decodeIntegers } from "./integers.js";

/**
 * @param {Uint8Array} data the rest of section `mesh`
 * @param {Uint32Array} pointFaces (T, 3) triangles over points, flat @param {Int32Array} counts (P) copies of each point
 * @param {Uint32Array} corners of points with more than one copy, by point, then by number
 * @returns {Uint32Array} (3 T) the copy that each corner uses
 */
export function decodeSeams(data, pointFaces, counts, corners) {
  const copies = new Uint32Array(pointFaces.length);
  const told = []; // places in `corners` of those that are not their point's first
  const contexts = [];
  walk(pointFaces, counts, corners, copies, (i, context) => {
    told.push(i);
    contexts.push(context);
  });
  const places = decodeIntegers(data, told.length, Uint8Array.from(contexts), "mesh");
  let next = 0;
  walk(pointFaces, counts, corners, copies, null, () => places[next++]);
  return copies;
}

/** Tell each corner's context to `tell`; or, without, fill copies, each from its place, which `take` gives. */
function walk(flat, counts, corners, copies, tell, take) {
  for (let i = 0, begin = 0, used = 0; i < corners.length; i++) {
    const x = corners[i];
    const p = flat[x];
    if (i === 0 || flat[corners[i - 1]] !== p) {
      [begin, used] = [i, 1];
      continue;
    }
    let [done, single, later] = [0, 0, 0];
    const listed = []; // of [copy, reason]: best reason first, then highest number
    for (let j = Math.max(begin, i - LOOK); j < i; j++) {
      const y = corners[j];
      for (const own of others(x)) {
        const q = flat[own];
        for (const other of others(y)) {
          if (flat[other] !== q) continue;
          let reason = SAME;
          if (counts[q] === 1) {
            single++;
            reason = SINGLE;
          } else if (q >= p) {
            later++;
            reason = LATER;
          } else {
            done++;
            if (copies[own] !== copies[other]) continue;
          }
          if (!tell) note(listed, copies[y], reason);
        }
      }
    }
    if (tell) {
      tell(i, 9 * Math.min(done, 2) + 3 * Math.min(single, 2) + Math.min(later, 2));
      continue;
    }
    if (used < counts[p]) note(listed, used, NEW);
    const copy = copyAt(listed, used, take());
    if (copy < 0) throw corrupt("mesh", "a corner uses a copy that does not exist");
    copies[x] = copy;
    if (copy === used) used++;
  }
}

/** The next and the previous corner of a corner's triangle. */
function others(corner) {
  const first = corner - (corner % 3);
  return [first + ((corner + 1) % 3), first + ((corner + 2) % 3)];
}

function note(listed, copy, reason) {
  const at = listed.findIndex((one) => one[0] === copy);
  if (at >= 0) {
    if (listed[at][1] <= reason) return;
    listed.splice(at, 1);
  }
  let k = listed.length;
  while (k > 0 && (listed[k - 1][1] > reason || (listed[k - 1][1] === reason && listed[k - 1][0] < copy))) k--;
  listed.splice(k, 0, [copy, reason]);
}

/** The copy at a place: listed ones first, then the other used ones from the highest number down; -1 if there is none. */
function copyAt(listed, used, place) {
  if (place < 0) return -1;
  if (place < listed.length) return listed[place][0];
  const first = used - 1 - (place - listed.length);
  for (let copy = first; copy >= 0; ) {
    const above = listed.filter(([one]) => copy <= one && one < used).length;
    if (first - above === copy) return copy;
    copy = first - above;
  }
  return -1;
}
