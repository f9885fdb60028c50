/** Rows of numbers as byte planes of their differences. Mirrors `gvpipe.connectivity.planes`. */

/** @param {Uint8Array} planes 4 k n bytes @param {number} count n rows @returns {Int32Array} (n, k) */
export function fromPlanes(planes, count) {
  const width = count ? planes.length / count / 4 : 0;
  const rows = new Int32Array(count * width);
  for (let k = 0; k < width; k++) {
    const at = (byte) => (4 * k + byte) * count;
    let value = 0;
    for (let row = 0; row < count; row++) {
      const [a, b, c, d] = [0, 1, 2, 3].map((byte) => planes[at(byte) + row]);
      const zigzag = (a | (b << 8) | (c << 16) | (d << 24)) >>> 0;
      value += zigzag & 1 ? -(zigzag >>> 1) - 1 : zigzag >>> 1;
      rows[row * width + k] = value;
    }
  }
  return rows;
}
