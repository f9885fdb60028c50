/** What a ray meets first: a triangle and its nearest vertex, or a point of a mesh without triangles. */

const APERTURE = 0.02; // how far beside the ray a point may lie, as a part of its distance

/**
 * @param {number[]} origin (3) @param {number[]} direction (3) of any length
 * @param {Float32Array} points (V, 3) @param {Uint32Array} indices (3T)
 * @param {[number, number][]} ranges of triangles that are there
 * @param {number} [most] how far the ray goes, in lengths of its direction
 * @returns {{triangle: number, vertex: number}|null} the vertex is that corner which is nearest to where the ray meets the triangle
 */
export function pickTriangle(origin, direction, points, indices, ranges, most = Infinity) {
  const [ox, oy, oz] = origin;
  const [dx, dy, dz] = direction;
  let nearest = most;
  let triangle = -1;
  for (const [start, stop] of ranges) {
    for (let t = start; t < stop; t++) {
      const a = 3 * indices[3 * t];
      const b = 3 * indices[3 * t + 1];
      const c = 3 * indices[3 * t + 2];
      const ux = points[b] - points[a];
      const uy = points[b + 1] - points[a + 1];
      const uz = points[b + 2] - points[a + 2];
      const vx = points[c] - points[a];
      const vy = points[c + 1] - points[a + 1];
      const vz = points[c + 2] - points[a + 2];
      const px = dy * vz - dz * vy;
      const py = dz * vx - dx * vz;
      const pz = dx * vy - dy * vx;
      const volume = ux * px + uy * py + uz * pz;
      if (volume === 0) continue; // seen from its side
      const sx = ox - points[a];
      const sy = oy - points[a + 1];
      const sz = oz - points[a + 2];
      const beta = (sx * px + sy * py + sz * pz) / volume; // where it meets the plane: alpha a + beta b + gamma c
      if (!(beta >= 0 && beta <= 1)) continue;
      const qx = sy * uz - sz * uy;
      const qy = sz * ux - sx * uz;
      const qz = sx * uy - sy * ux;
      const gamma = (dx * qx + dy * qy + dz * qz) / volume;
      if (!(gamma >= 0 && beta + gamma <= 1)) continue;
      const distance = (vx * qx + vy * qy + vz * qz) / volume;
      if (distance > 0 && distance < nearest) [nearest, triangle] = [distance, t];
    }
  }
  if (triangle < 0) return null;
  const met = [ox + nearest * dx, oy + nearest * dy, oz + nearest * dz];
  const corners = [0, 1, 2].map((corner) => indices[3 * triangle + corner]);
  const far = corners.map((v) => Math.hypot(...met.map((value, axis) => value - points[3 * v + axis])));
  return { triangle, vertex: corners[far.indexOf(Math.min(...far))] };
}

/** The foremost of the points beside the ray. @returns {{triangle: null, vertex: number}|null} */
export function pickPoint(origin, direction, points) {
  const size = Math.hypot(...direction);
  const axis = direction.map((value) => value / size);
  let nearest = Infinity;
  let vertex = -1;
  for (let v = 0; v < points.length / 3; v++) {
    const [x, y, z] = [points[3 * v] - origin[0], points[3 * v + 1] - origin[1], points[3 * v + 2] - origin[2]];
    const along = x * axis[0] + y * axis[1] + z * axis[2];
    const beside = Math.sqrt(Math.max(0, x * x + y * y + z * z - along * along));
    if (along > 0 && beside <= APERTURE * along && along < nearest) [nearest, vertex] = [along, v];
  }
  return vertex < 0 ? null : { triangle: null, vertex };
}
