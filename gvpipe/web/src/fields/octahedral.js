/** Directions from octahedral coordinates. Mirrors `from_octahedral` of `gvpipe.fields.octahedral`. */

/** @param {Float32Array} coordinates (n, 2) @returns {Float32Array} (n, 3) unit vectors */
export function fromOctahedral(coordinates) {
  const vectors = new Float32Array((coordinates.length / 2) * 3);
  const cut = (value) => Math.min(Math.max(value, -1), 1);
  const fold = (own, other) => (1 - Math.abs(other)) * (own < 0 ? -1 : 1);
  for (let i = 0, at = 0; i < coordinates.length; i += 2, at += 3) {
    const [u, v] = [cut(coordinates[i]), cut(coordinates[i + 1])];
    const z = 1 - (Math.abs(u) + Math.abs(v));
    const [x, y] = z < 0 ? [fold(u, v), fold(v, u)] : [u, v];
    const length = Math.sqrt(x * x + y * y + z * z);
    vectors[at] = x / length;
    vectors[at + 1] = y / length;
    vectors[at + 2] = z / length;
  }
  return vectors;
}
