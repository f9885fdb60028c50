/** Points: which rows of integers are equal, and boxes. */

/**
 * @param {ArrayLike<number>} rows n rows, flat
 * @param {number} width of a row
 * @returns {Int32Array} for each row the latest equal row before it, or -1
 */
export function previousEqual(rows, width) {
  const n = rows.length / width;
  const bits = Math.max(4, Math.ceil(Math.log2(n + 1)) + 1);
  const mask = 2 ** bits - 1;
  const latest = new Int32Array(2 ** bits).fill(-1); // open addressing: slot -> latest row of one value
  const previous = new Int32Array(n);
  for (let row = 0; row < n; row++) {
    let hash = 0;
    for (let i = 0; i < width; i++) hash = Math.imul(hash ^ rows[row * width + i], 0x9e3779b1) ^ (hash >>> 15);
    let slot = (hash ^ (hash >>> 16)) & mask;
    while (latest[slot] >= 0 && !equal(rows, width, latest[slot], row)) slot = (slot + 1) & mask;
    previous[row] = latest[slot];
    latest[slot] = row;
  }
  return previous;
}

function equal(rows, width, a, b) {
  for (let i = 0; i < width; i++) if (rows[a * width + i] !== rows[b * width + i]) return false;
  return true;
}

/** Make a box hold positions (V, 3), flat; it is not finite if one of them is not. */
export function stretch({ min, max }, positions) {
  for (let axis = 0; axis < 3; axis++) {
    let [low, high] = [min[axis], max[axis]];
    for (let i = axis; i < positions.length; i += 3) {
      if (!(positions[i] >= low)) low = positions[i]; // NaN too
      if (!(positions[i] <= high)) high = positions[i];
    }
    [min[axis], max[axis]] = [low, high];
  }
}
