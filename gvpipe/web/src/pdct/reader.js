/**
 * From a `pdct` bitstream to positions, any frame in any order, by Python's kernels. Mirrors the codec's reader. Frames are distinct ones
 * here (`format/repeated_frames.js`).
 */

import { PDCT_READER_BYTES_PER_POINT as BYTES_PER_POINT, PDCT_READER_SECONDS_PER_POINT as SECONDS_PER_POINT } from "../constants.js";
import { checkCounts } from "../format/base_mesh.js";
import { previousEqual } from "../format/points.js";
import { Recent } from "../format/recent.js";
import { decodePoints } from "../format/welded_mesh.js";
import { Clip } from "./clip.js";
import { VERSION, readHeader } from "./header.js";
import { SECTION as STILL, decodeStill } from "./still_points.js";

export { VERSION };

const KEPT = 2; // clips: the one shown and the next

export class PdctReader {
  #payload;
  #header;
  #kernels;
  #mesh; // {faces, point, lattice}
  #shared; // (V) the point of each vertex; where frames are written as they come, that of the base frame
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
    const mesh = await decodePoints(kernels, ...sections, payload.header);
    checkCounts(payload.header, mesh.point.length, mesh.faces);
    const still = payload.sections.has(STILL) ? await payload.section(STILL) : null;
    return new PdctReader(payload, header, kernels, mesh, still);
  }

  constructor(payload, header, kernels, mesh, still) {
    const { lattice, point } = mesh;
    const [points, step] = [lattice.length / 3, header.base[3]];
    const base = Float64Array.from(lattice, (index, i) => header.base[i % 3] + index * step);
    this.#still = still ? decodeStill(still, base) : { points: new Int32Array(0), positions: new Float32Array(0) };
    const stands = new Uint8Array(points);
    for (const point of this.#still.points) stands[point] = 1;
    this.#surface = { base, traversal: Int32Array.from(stands.keys()).filter((p) => !stands[p]) };
    this.#shared = header.clip ? firstEqual(lattice, point) : point;
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

  /** `Int32Array` (V): the point of each vertex; where frames are written as they come, that of the base frame. */
  get points() {
    return this.#shared;
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
    points.forEach((p, i) => own.set(positions.subarray(3 * i, 3 * i + 3), 3 * p));
    const { point } = this.#mesh;
    for (let v = 0; v < point.length; v++) {
      for (let axis = 0; axis < 3; axis++) target[3 * v + axis] = own[3 * point[v] + axis];
    }
  }

  async #open(c) {
    const name = `clip.${c}`;
    const data = await this.#payload.section(name);
    const frames = this.segmentStart(c + 1) - this.segmentStart(c);
    return new Clip(this.#kernels.fresh(), data, frames, this.#surface, name, this.#payload.budget);
  }
}

/** (V) the first of the points at each vertex's base position. */
function firstEqual(lattice, point) {
  const first = new Int32Array(lattice.length / 3);
  previousEqual(lattice, 3).forEach((previous, p) => (first[p] = previous < 0 ? p : first[previous]));
  return point.map((p) => first[p]);
}
