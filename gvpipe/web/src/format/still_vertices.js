/** Flags as bytes. Mirrors `gvpipe.trajectory.still_vertices.decode_flags`; `docs/format.md`, section 5.5. */

import { Cursor } from "./cursor.js";
import { decodeIntegers } from "./integers.js";

/**
 * @param {Uint8Array} data @param {number} n how many flags
 * @param {string} name of the section, for messages
 * @returns {Uint8Array} (n) 0 or 1
 */
export function decodeFlags(data, n, name) {
  const cursor = new Cursor(data, name);
  const runs = cursor.varint(n, "the number of runs");
  const lengths = decodeIntegers(cursor.rest(), runs, null, name);
  const flags = new Uint8Array(n);
  let start = 0;
  lengths.forEach((length, i) => {
    const end = start + length;
    if (length < (i ? 1 : 0) || end >= n) throw cursor.corrupt("its runs do not fit");
    flags.fill(i % 2, start, end);
    start = end;
  });
  return flags.fill(runs % 2, start);
}
