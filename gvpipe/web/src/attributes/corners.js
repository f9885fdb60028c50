/** Corners of triangles: corner 3 t + k is vertex k of triangle t. Mirrors what `gvpipe.mesh` knows of them. */

function nextCorner(corner) {
  return corner % 3 < 2 ? corner + 1 : corner - 2;
}

function previousCorner(corner) {
  return corner % 3 > 0 ? corner - 1 : corner + 2;
}

/**
 * (3T) the corner opposite to each corner across the edge between the two other vertices, -1 without one. Corners across one
 * edge are paired in ascending order: the first with the second, the third with the fourth.
 *
 * @param {ArrayLike<number>} flat (3T) vertices
 */
export function oppositeCorners(flat) {
  const opposite = new Int32Array(flat.length).fill(-1);
  const bits = Math.max(4, Math.ceil(Math.log2(flat.length + 1)) + 1);
  const mask = 2 ** bits - 1;
  const firsts = new Int32Array(2 ** bits).fill(-1); // open addressing: slot -> the first corner of an edge
  const pending = new Int32Array(flat.length).fill(-1); // of a first corner, the one that waits for its other side
  for (let c = 0; c < flat.length; c++) {
    const a = flat[nextCorner(c)];
    const b = flat[previousCorner(c)];
    if (a === b) continue;
    const low = Math.min(a, b);
    const high = Math.max(a, b);
    const hash = Math.imul(Math.imul(low, 0x9e3779b1) ^ high, 0x85ebca6b);
    let slot = (hash ^ (hash >>> 15)) & mask;
    while (firsts[slot] >= 0 && !isEdge(flat, firsts[slot], low, high)) slot = (slot + 1) & mask;
    if (firsts[slot] < 0) firsts[slot] = c;
    const first = firsts[slot];
    const other = pending[first];
    pending[first] = other < 0 ? c : -1;
    if (other < 0) continue;
    opposite[c] = other;
    opposite[other] = c;
  }
  return opposite;
}

function isEdge(flat, corner, low, high) {
  const a = flat[nextCorner(corner)];
  const b = flat[previousCorner(corner)];
  return (a === low && b === high) || (a === high && b === low);
}

/** Number (n) numbers 0, 1, ... by where they come first; those given lie below `limit`. */
export function numberByFirst(numbers, limit) {
  const rank = new Int32Array(limit).fill(-1);
  const result = new Uint32Array(numbers.length);
  let count = 0;
  for (let i = 0; i < numbers.length; i++) {
    if (rank[numbers[i]] < 0) rank[numbers[i]] = count++;
    result[i] = rank[numbers[i]];
  }
  return result;
}
