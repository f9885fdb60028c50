/**
 * From a `pdct` bitstream to positions, any frame in any order, by Python's kernels. Mirrors the codec's reader. Frames are distinct ones
 * here (`format/repeated_frames.js`).
 */

import { PDCT_READER_BYTES_PER_POINT as BYTES_PER_POINT, PDCT_READER_SECONDS_PER_POINT as SECONDS_PER_POINT } from "../constants.js";
import { checkCounts, decodeBase } from "../format/base_mesh.js";
import { previousEqual } from "../format/points.js";
import { Recent } from "../format/recent.js";
import { decodePoints } from "../format/welded_mesh.js";
import { Clip } from "./clip.js";
import { VERSION, VERSION_POINTS, readHeader } from "./header.js";
import { SECTION as STILL, decodeStill } from "./still_points.js";

export { VERSION };

const KEPT = 2; // clips: the one shown and the next

export class PdctReader {
  #payload;
  #header;
  #kernels;
  #mesh; // {faces, point, coded, lattice, traversal}
  #surface; // what clips share
  #still;
  #clips; // by number, promises

  /**
   * @param {import("../format/payload.js").Payload} payload `section` may return promises
   * @param {import("../wasm/kernels.js").Kernels} kernels
   * @returns {Promise<PdctReader>}
   * @throws {GeometryVideoError} a section is not as gvpipe writes it, or takes more than its file may
   */
  static async open(payload, kernels) {
    const header = readHeader(payload.header);
    const sections = [await payload.section("mesh"), await payload.section("order")];
    const read = payload.header.version === VERSION_POINTS ? readPoints : readVertices;
    const mesh = await read(kernels, ...sections, payload.header);
    checkCounts(payload.header, mesh.point.length, mesh.faces);
    const still = payload.sections.has(STILL) ? await payload.section(STILL) : null;
    return new PdctReader(payload, header, kernels, mesh, still);
  }

  constructor(payload, header, kernels, mesh, still) {
    const { lattice, traversal } = mesh;
    const [points, step] = [lattice.length / 3, header.base[3]];
    const base = Float64Array.from(lattice, (index, i) => header.base[i % 3] + index * step);
    this.#still = still ? decodeStill(still, base) : { points: new Int32Array(0), positions: new Float32Array(0) };
    const stands = new Uint8Array(points);
    for (const point of this.#still.points) stands[point] = 1;
    this.#surface = { base, traversal: traversal.filter((point) => !stands[point]) };
    payload.budget.keep(`${points} points`, BYTES_PER_POINT * points, SECONDS_PER_POINT * points);
    this.#clips = new Recent((c) => this.#open(c), KEPT);
    this.#payload = payload;
    this.#header = header;
    this.#kernels = kernels;
    this.#mesh = mesh;
  }

  /** `Uint32Array` (T, 3): triangles, flat. */
  get faces() {
    return this.#mesh.faces;
  }

  /** `Int32Array` (V): the point of each vertex; of versions 1 and 3, that of the base frame. */
  get points() {
    return this.#mesh.point;
  }

  /** Vertex counts of the levels of detail: the whole mesh alone. */
  get levels() {
    return [this.#mesh.point.length];
  }

  /** First frame of clip c; F for the one after the last. */
  segmentStart(c) {
    const { frames } = this.#payload.header;
    const { clip, clips } = this.#header;
    return clip ? Math.min(c * clip, frames) : Math.floor((c * frames) / clips);
  }

  /**
   * Frames `start` to `stop`.
   *
   * @returns {Promise<Float32Array>} (stop - start, V, 3), model units
   * @throws {GeometryVideoError} a clip does not decode
   */
  async read(start, stop) {
    const size = 3 * this.#mesh.point.length;
    const frames = new Float32Array(size * (stop - start));
    const own = new Float32Array(this.#surface.base.length); // of the points
    for (let c = 0; this.segmentStart(c) < stop; c++) {
      const [begin, end] = [this.segmentStart(c), this.segmentStart(c + 1)];
      for (let k = Math.max(start, begin); k < Math.min(stop, end); k++) {
        if (this.#surface.traversal.length) own.set((await this.#clips.get(c)).frame(k - begin));
        this.#spread(own, frames.subarray(size * (k - start), size * (k - start + 1)));
      }
    }
    return frames;
  }

  /** Make a box hold the seed vertices of clip c: they lie far from each other. */
  async extend(box, c) {
    if (this.#surface.traversal.length) (await this.#clips.get(c)).extend(box);
  }

  /** Fill `target (V, 3)` from positions of the points, which get those that stand still. */
  #spread(own, target) {
    const { points, positions } = this.#still;
    points.forEach((point, i) => own.set(positions.subarray(3 * i, 3 * i + 3), 3 * point));
    const { coded } = this.#mesh;
    for (let v = 0; v < coded.length; v++) {
      for (let axis = 0; axis < 3; axis++) target[3 * v + axis] = own[3 * coded[v] + axis];
    }
  }

  async #open(c) {
    const name = `clip.${c}`;
    const data = await this.#payload.section(name);
    const frames = this.segmentStart(c + 1) - this.segmentStart(c);
    return new Clip(this.#kernels.fresh(), data, frames, this.#surface, name, this.#payload.budget);
  }
}

/** Files of versions 1 and 3: every vertex is a point. */
async function readVertices(kernels, mesh, order, header) {
  const { points: lattice, faces, visits } = await decodeBase(kernels, mesh, order, header);
  const traversal = new Int32Array(visits.length); // the codec's order
  visits.forEach((visit, v) => (traversal[visit] = v));
  const point = new Int32Array(visits.length);
  previousEqual(lattice, 3).forEach((previous, v) => (point[v] = previous < 0 ? v : point[previous]));
  return { faces, point, coded: Int32Array.from(visits.keys()), lattice, traversal };
}

async function readPoints(kernels, mesh, order, header) {
  const { faces, point, lattice } = await decodePoints(kernels, mesh, order, false, false, header);
  return { faces, point, coded: point, lattice, traversal: Int32Array.from({ length: lattice.length / 3 }, (_, p) => p) };
}
