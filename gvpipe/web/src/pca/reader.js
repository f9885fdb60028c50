/**
 * From a `pca` bitstream to positions, any frame in any order, at any level of detail, by Python's kernels. Mirrors the codec's reader.
 * Frames are distinct ones here (`format/repeated_frames.js`).
 */

import { HIERARCHY_MAX_WAVES as MAX_WAVES } from "../constants.js";
import { inSlices } from "../format/slices.js";
import { decodeTopology } from "../format/topology_only.js";
import { decodeBasis, splitBasis } from "../trajectory/basis.js";
import { placed, taken } from "../trajectory/causal_order.js";
import { askParallelograms, keepHierarchy } from "../trajectory/hierarchy_budget.js";
import { Segment } from "../trajectory/segment.js";
import { SECTION as STILL, readStill } from "../trajectory/still_points.js";
import { coefficientSteps } from "./coefficients.js";
import { VERSION, readHeader } from "./header.js";

export { VERSION };

const KEPT = 3; // segments: the one shown and the next, and the one shown at another level

export class PcaReader {
  #payload;
  #header;
  #kernels;
  #topology;
  #mesh; // triangles over points, as kernels have them
  #hierarchy; // {order, blocks, waves}
  #still;
  #causal;
  #segments = new Map(); // "segment level" -> Job, the one used last at the end

  /**
   * @param {import("../format/payload.js").Payload} payload `section` may return promises
   * @param {import("../wasm/kernels.js").Kernels} kernels
   * @returns {Promise<PcaReader>}
   * @throws {GeometryVideoError} a section is not as gvpipe writes it, or takes more than its file may
   */
  static async open(payload, kernels) {
    const header = readHeader(payload.header);
    const order = await payload.section("order");
    const topology = await decodeTopology(kernels, await payload.section("mesh"), order, payload.header);
    const still = payload.sections.has(STILL) ? await payload.section(STILL) : null;
    return new PcaReader(payload, header, kernels, topology, still);
  }

  constructor(payload, header, kernels, topology, still) {
    const { pointFaces, pointCount } = topology;
    keepHierarchy(payload.budget, pointCount, pointFaces.length / 3);
    this.#payload = payload;
    this.#header = header;
    this.#kernels = kernels;
    this.#topology = topology;
    this.#mesh = kernels.array("int32", [pointFaces.length / 3, 3], pointFaces);
    const hierarchy = kernels.call("build_order", this.#mesh, pointCount, MAX_WAVES);
    const [order, blocks, waves] = [0, 4, 5].map((i) => kernels.view(hierarchy[i]).slice());
    this.#hierarchy = { order, blocks, waves };
    this.#still = readStill(kernels, still, pointFaces, pointCount, payload.budget);
    const all = kernels.call("weigh_hierarchy", ...hierarchy, header.predictor === "kalman");
    this.#causal = taken(kernels, this.#leaveOut(kernels, all));
  }

  /** `Uint32Array` (T, 3): triangles of level 0, flat. */
  get faces() {
    return this.#topology.faces;
  }

  /** `Int32Array` (V): the point of each vertex; vertices of one point have one trajectory. */
  get points() {
    return this.#topology.point;
  }

  /** Vertex counts of the levels of detail, level 0 first. */
  get levels() {
    return [this.#topology.point.length, ...Array.from(this.#hierarchy.blocks.slice(1, -1)).reverse()];
  }

  /** First frame of segment s; F for the one after the last. */
  segmentStart(s) {
    return Math.floor((s * this.#payload.header.frames) / this.#header.segments);
  }

  /** Triangles (n, 3), flat, of a level, over the vertices that `read` returns for it. @returns {Uint32Array} */
  levelFaces(level) {
    if (level === 0) return this.faces;
    const [left] = this.#kernels.call("triangles_left", this.#mesh, this.#topology.pointCount, this.#hierarchy.waves.at(-1 - level));
    const numbers = new Uint32Array(this.#topology.pointCount);
    this.#alive(level).forEach((point, number) => (numbers[point] = number));
    const faces = Uint32Array.from(this.#kernels.view(left), (point) => numbers[point]);
    this.#kernels.free(left);
    return faces;
  }

  /**
   * Frames `start` to `stop` of a level.
   *
   * @returns {Promise<Float32Array>} (stop - start, V, 3), model units
   * @throws {GeometryVideoError} a segment does not decode
   */
  async read(start, stop, level = 0) {
    const points = level ? this.#alive(level) : this.points;
    const rows = level ? points.map((_, row) => row) : points; // of a segment's numbers
    const frames = new Float32Array(3 * points.length * (stop - start));
    for (let s = 0; s < this.#header.segments && this.#still.movingCount; s++) {
      const [begin, end] = [this.segmentStart(s), this.segmentStart(s + 1)];
      const [first, last] = [Math.max(start, begin), Math.min(stop, end)];
      if (first >= last) continue;
      const segment = await this.#segment(s, level);
      segment.read(first - begin, last - begin, rows, frames.subarray(3 * points.length * (first - start)), first);
    }
    this.#still.overwrite(frames, points);
    return frames;
  }

  /** Have segment s decoded while nothing is that is read. @throws {GeometryVideoError} it does not decode */
  async prepare(s, level = 0) {
    if (this.#still.movingCount) await this.#segment(s, level, false);
  }

  /** A decoded segment; the latest few are kept. @returns {Promise<Segment>} */
  #segment(s, level, isUrgent = true) {
    const key = `${s} ${level}`;
    const job = this.#segments.get(key) ?? { isUrgent, isDone: false };
    job.isUrgent ||= isUrgent;
    job.segment ??= this.#decode(s, level, job).finally(() => (job.isDone = true));
    this.#segments.delete(key);
    this.#segments.set(key, job);
    if (this.#segments.size > KEPT) this.#segments.delete(this.#segments.keys().next().value);
    job.segment.catch(() => this.#segments.get(key) === job && this.#segments.delete(key));
    return job.segment;
  }

  /** Whether a segment is being decoded that is read now. */
  get #isUrgent() {
    return [...this.#segments.values()].some(({ isUrgent, isDone }) => isUrgent && !isDone);
  }

  async #decode(s, level, job) {
    const { predictor, beta, steps } = this.#header;
    const { budget } = this.#payload;
    const sections = [await this.#payload.section(`basis.${s}`), await this.#payload.section(`coefficients.${s}`)];
    const kernels = this.#kernels.fresh(); // whose memory is given back as a whole
    const frameCount = this.segmentStart(s + 1) - this.segmentStart(s);
    const basis = decodeBasis(kernels, sections[0], frameCount, this.#still.movingCount, steps[s], `basis.${s}`, 3, budget);
    const isReversed = predictor === "lsp"; // the small ones come first
    const given = this.#given(kernels, basis, isReversed);
    const orders = [placed(kernels, this.#causal), this.#header.hasFirst ? () => this.#firstOrder(kernels) : null];
    const how = { predictor, beta, given, blocks: level ? this.#countBlocks(level) : null };
    const vectors = coefficientSteps(kernels, ...orders, sections[1], basis.components, steps[s], `coefficients.${s}`, how);
    const decoded = await inSlices(vectors, () => !job.isUrgent && this.#isUrgent);
    const chosen = level ? this.#alive(level) : null;
    return new Segment(this.#kernels.fresh(), basis, kernels.view(decoded), this.#topology.pointCount, isReversed, { chosen });
  }

  /** Coefficients of the still points, in the order of transmission. */
  #given(kernels, basis, isReversed) {
    if (!this.#still.count) return null;
    const given = this.#still.given(kernels, ...splitBasis(kernels, basis), this.#payload.budget);
    const values = kernels.view(given);
    for (let i = 0; isReversed && i < values.length; i += basis.components) values.subarray(i, i + basis.components).reverse();
    return given;
  }

  /** How many blocks of coefficients a level needs: those of its points that move. */
  #countBlocks(level) {
    const { flags } = this.#still;
    const moving = this.#alive(level).reduce((sum, point) => sum + 1 - flags[point], 0);
    return Array.from(this.#causal.blocks).findIndex((bound) => bound >= moving);
  }

  /** Points of a level above 0, ascending. */
  #alive(level) {
    const { order, blocks } = this.#hierarchy;
    return order.slice(0, blocks.at(-1 - level)).sort();
  }

  /** The order of first components, for one segment: it takes as much as the hierarchy. */
  #firstOrder(kernels) {
    const { pointFaces, pointCount } = this.#topology;
    askParallelograms(this.#payload.budget, pointCount, pointFaces.length / 3);
    const mesh = kernels.array("int32", [pointFaces.length / 3, 3], pointFaces);
    return this.#leaveOut(kernels, kernels.call("weigh_parallelograms", mesh, pointCount));
  }

  /** The order without the points that stand still. */
  #leaveOut(kernels, causal) {
    if (!this.#still.count) return causal;
    const { flags } = this.#still;
    const keep = Uint8Array.from(kernels.view(causal[0]), (point) => 1 - flags[point]);
    return kernels.call("keep_ranks", ...causal, kernels.array("bool", [keep.length], keep));
  }
}
