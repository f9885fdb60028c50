/**
 * What the reader knows of the base frame. Mirrors `gvcodecs.mcgv.base.surface`.
 *
 * A *slot* is what a picture has a pixel for: a point that moves. All vertices of a point show one position, and vertices that
 * stand still have neither sample nor motion.
 */

import { SURFACE_STILL as STILL } from "../constants.js";
import { checkCounts } from "../format/base_mesh.js";
import { corrupt } from "../format/errors.js";
import { decodePoints } from "../format/welded_mesh.js";
import { decodeFlags } from "../format/still_vertices.js";
import { Points } from "./welded_points.js";

export class Surface {
  /**
   * @param {object} parts
   * @param {Uint32Array} parts.faces (T, 3) triangles over V vertices, flat
   * @param {Int32Array} parts.basePoints (V, 3) base positions, lattice units, flat
   * @param {Int32Array} parts.slot (V) the slot of each vertex; -1: it never moves
   * @param {Int32Array} parts.lattice (S, 3) the slots' base positions, lattice units, flat
   * @param {Points} parts.points what joins the slots
   * @param {import("./header.js").Header} header
   */
  constructor(parts, { origin, baseStep }) {
    Object.assign(this, parts);
    const place = (index, i) => origin[i % 3] + index * baseStep;
    /** (S, 3) the slots' base positions, model units, flat. */
    this.base = Float64Array.from(this.lattice, place);
    /** The vertices that never move, and where they stay: (V, 3) model units, flat; empty if all move. */
    this.still = Uint32Array.from(this.slot.keys()).filter((v) => this.slot[v] < 0);
    this.rest = this.still.length ? Float32Array.from(this.basePoints, place) : new Float32Array(0);
  }

  get nSlots() {
    return this.points.n;
  }

  /** Fill `positions (V, 3)` from those of the slots (S, 3); model units, flat. */
  spread(placed, positions) {
    const { slot, rest } = this;
    for (let v = 0, i = 0; v < slot.length; v++, i += 3) {
      const [from, at] = slot[v] < 0 ? [rest, i] : [placed, 3 * slot[v]];
      positions[i] = from[at];
      positions[i + 1] = from[at + 1];
      positions[i + 2] = from[at + 2];
    }
  }

  /** Make a box hold the vertices that never move. */
  extend({ min, max }) {
    for (const v of this.still) {
      for (let axis = 0; axis < 3; axis++) {
        min[axis] = Math.min(min[axis], this.rest[3 * v + axis]);
        max[axis] = Math.max(max[axis], this.rest[3 * v + axis]);
      }
    }
  }
}

/**
 * @param {import("../format/payload.js").Payload} payload
 * @param {import("./header.js").Header} header @param {import("../wasm/kernels.js").Kernels} kernels
 * @returns {Promise<Surface>}
 */
export async function readSurface(payload, header, kernels) {
  const { faces, point, lattice, pointFaces } = await decodePoints(
    kernels,
    await payload.section("mesh"),
    await payload.section("order"),
    payload.header,
  );
  checkCounts(payload.header, point.length, faces);
  const n = lattice.length / 3;
  const still = payload.sections.has(STILL) ? decodeFlags(await payload.section(STILL), n, STILL) : new Uint8Array(n);
  const moves = Int32Array.from(still.keys()).filter((p) => !still[p]);
  if (!moves.length) throw corrupt(STILL, "one point at least has samples");
  const slots = new Int32Array(n).fill(-1); // of the points
  moves.forEach((p, slot) => (slots[p] = slot));
  const parts = {
    faces,
    basePoints: gather(lattice, point),
    slot: point.map((p) => slots[p]),
    lattice: gather(lattice, moves),
    points: new Points(Int32Array.from(pointFaces, (p) => slots[p]), moves.length),
  };
  return new Surface(parts, header);
}

/** Rows of three, flat, one for each of the numbers. */
function gather(rows, numbers) {
  return Int32Array.from({ length: 3 * numbers.length }, (_, i) => rows[3 * numbers[Math.floor(i / 3)] + (i % 3)]);
}
