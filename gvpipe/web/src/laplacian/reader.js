/**
 * From a `laplacian` bitstream to positions, any frame in any order, by Python's kernels. Mirrors the codec's reader. Frames are
 * distinct ones here (`format/repeated_frames.js`).
 */

import { LAPLACIAN_AVERAGE_CODING_FARTHEST as FARTHEST, LAPLACIAN_AVERAGE_CODING_NAME as AVERAGE } from "../constants.js";
import { Cursor } from "../format/cursor.js";
import { corrupt } from "../format/errors.js";
import { decodeTopology } from "../format/topology_only.js";
import { decodeBasis, splitBasis } from "../trajectory/basis.js";
import { keepHierarchy } from "../trajectory/hierarchy_budget.js";
import { Segment } from "../trajectory/segment.js";
import { SECTION as STILL, readStill } from "../trajectory/still_points.js";
import { Domain, Surface } from "./domain.js";
import { VERSION, needsAverage, ofAverage, readHeader } from "./header.js";

export { VERSION };

const KEPT = 2; // segments: the one shown and the next

export class LaplacianReader {
  #payload;
  #header;
  #kernels;
  #topology;
  #still;
  #domain;
  #segments = new Map(); // number -> promise, the one used last at the end

  /**
   * @param {import("../format/payload.js").Payload} payload `section` may return promises
   * @param {import("../wasm/kernels.js").Kernels} kernels
   * @returns {Promise<LaplacianReader>}
   * @throws {GeometryVideoError} a section is not as gvpipe writes it, or takes more than its file may
   */
  static async open(payload, kernels) {
    const header = readHeader(payload.header);
    const order = await payload.section("order");
    const topology = await decodeTopology(kernels, await payload.section("mesh"), order, payload.header);
    const still = payload.sections.has(STILL) ? await payload.section(STILL) : null;
    const average = needsAverage(header.coding) ? await payload.section(AVERAGE) : null;
    return new LaplacianReader(payload, header, kernels, topology, still, average);
  }

  constructor(payload, header, kernels, topology, still, average) {
    const { pointFaces, pointCount } = topology;
    this.#payload = payload;
    this.#header = header;
    this.#kernels = kernels;
    this.#topology = topology;
    this.#still = readStill(kernels, still, pointFaces, pointCount, payload.budget);
    keepHierarchy(payload.budget, pointCount, pointFaces.length / 3);
    const surface = new Surface(kernels, pointFaces, pointCount);
    const points = average && this.#decodeAverage(surface, average);
    this.#domain = new Domain(kernels, surface, points, header.coding, this.#still.flags, payload.budget);
  }

  /** `Uint32Array` (T, 3): triangles, flat. */
  get faces() {
    return this.#topology.faces;
  }

  /** `Int32Array` (V): the point of each vertex; vertices of one point have one trajectory. */
  get points() {
    return this.#topology.point;
  }

  /** Vertex counts of the levels of detail: there is one. */
  get levels() {
    return [this.#topology.point.length];
  }

  /** First frame of segment s; F for the one after the last. */
  segmentStart(s) {
    return Math.floor((s * this.#payload.header.frames) / this.#header.segments);
  }

  /**
   * Frames `start` to `stop`.
   *
   * @returns {Promise<Float32Array>} (stop - start, V, 3), model units
   * @throws {GeometryVideoError} a segment does not decode
   */
  async read(start, stop) {
    const { points } = this;
    const frames = new Float32Array(3 * points.length * (stop - start));
    for (let s = 0; s < this.#header.segments && this.#still.movingCount; s++) {
      const [begin, end] = [this.segmentStart(s), this.segmentStart(s + 1)];
      const [first, last] = [Math.max(start, begin), Math.min(stop, end)];
      if (first >= last) continue;
      const segment = await this.#segment(s);
      segment.read(first - begin, last - begin, points, frames.subarray(3 * points.length * (first - start)), first);
    }
    this.#still.overwrite(frames, points);
    return frames;
  }

  /** A decoded segment; the latest few are kept. @returns {Promise<Segment>} */
  #segment(s) {
    const segment = this.#segments.get(s) ?? this.#decode(s);
    this.#segments.delete(s);
    this.#segments.set(s, segment);
    if (this.#segments.size > KEPT) this.#segments.delete(this.#segments.keys().next().value);
    segment.catch(() => this.#segments.delete(s));
    return segment;
  }

  async #decode(s) {
    const { coding, steps } = this.#header;
    const { budget } = this.#payload;
    const names = ["basis", "anchors", "deltas"].map((name) => `${name}.${s}`);
    const sections = await Promise.all(names.map((name) => this.#payload.section(name)));
    const own = this.#kernels.fresh(); // whose memory is given back as a whole
    const frameCount = this.segmentStart(s + 1) - this.segmentStart(s);
    const step = steps[s] * coding.basisRatio;
    const basis = decodeBasis(own, sections[0], frameCount, this.#still.movingCount, step, names[0], 3, budget);
    const given = this.#still.count ? this.#still.given(own, ...splitBasis(own, basis), budget) : null;
    const held = given && own.view(given).slice();
    const decoded = this.#domain.decode(own, sections[1], sections[2], names.slice(1), basis.components, steps[s], held);
    const segment = new Segment(this.#kernels.fresh(), basis, this.#kernels.view(decoded), this.#topology.pointCount, false);
    this.#kernels.free(decoded);
    return segment;
  }

  /** The average mesh (P, 3), mean edge lengths. Mirrors `gvcodecs.laplacian.average_coding.decode_average`. */
  #decodeAverage(surface, data) {
    const { coding } = this.#header;
    const { budget } = this.#payload;
    const cursor = new Cursor(data, AVERAGE);
    const anchors = cursor.block();
    const kept = budget.kept;
    const domain = new Domain(this.#kernels, surface, null, ofAverage(coding), new Uint8Array(surface.pointCount), budget);
    const names = [AVERAGE, AVERAGE];
    const points = domain.decode(this.#kernels.fresh(), anchors, cursor.rest(), names, 3, coding.averageStep);
    domain.equations.free();
    budget.release(kept);
    if (!this.#kernels.view(points).every((value) => Math.abs(value) < FARTHEST)) {
      throw corrupt(AVERAGE, "a position is out of range");
    }
    return points;
  }
}
