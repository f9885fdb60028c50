/**
 * From trajectory images back to frames, any of them, in any order, by Python's kernels. Mirrors `gvcodecs.mcgv.decoding.trajectory_reader`.
 * Frames are distinct ones here (`format/repeated_frames.js`).
 *
 * It runs beside the page, which alone can decode pictures: those of segment s are its section `pictures.s`, levels of all pixels.
 */

import {
  SKINNING_TOTAL as TOTAL,
  TRAJECTORY_READER_BYTES_PER_SAMPLE as BYTES_PER_SAMPLE,
  TRAJECTORY_READER_SECONDS_PER_SAMPLE as SECONDS_PER_SAMPLE,
} from "../constants.js";
import { AGAIN, GeometryVideoError, corrupt } from "../format/errors.js";
import { Recent } from "../format/recent.js";
import { MAX_VALUES } from "../trajectory/coefficient_coding.js";
import { Segment } from "../trajectory/segment.js";
import { PLANES, countPictures, readHeader } from "./header.js";
import { SECTIONS, placeSlots } from "./placement.js";
import { homogeneous } from "./skinning.js";
import { readSurface } from "./surface.js";
import { decodeSegment } from "./trajectory_coding.js";
import { decodeWeights } from "./weight_coding.js";

const KEPT = 2; // segments: the one shown and the next

export class TrajectoryReader {
  #payload;
  #header;
  #kernels;
  #surface;
  #pixels;
  #blend;
  #segments;
  #slots; // 0..S-1
  #placed; // (S, 3) of one frame

  /**
   * @param {import("../format/payload.js").Payload} payload `section` may return promises
   * @param {import("../wasm/kernels.js").Kernels} kernels
   * @returns {Promise<TrajectoryReader>}
   * @throws {GeometryVideoError} a section is not as gvpipe writes it, or takes more than its file may
   */
  static async open(payload, kernels) {
    const header = readHeader(payload.header);
    const surface = await readSurface(payload, header, kernels);
    const most = Math.max(...header.images.components) * surface.nSlots;
    if (most > MAX_VALUES) throw corrupt("header", `${most} coefficients in a segment`);
    const placement = SECTIONS[header.placement];
    const pixels = placeSlots(placement ? await payload.section(placement) : null, header, surface);
    const weights = await payload.section("weights");
    return new TrajectoryReader(payload, header, kernels, surface, pixels, weights);
  }

  constructor(payload, header, kernels, surface, pixels, weights) {
    this.#payload = payload;
    this.#header = header;
    this.#kernels = kernels;
    this.#surface = surface;
    this.#pixels = pixels;
    this.#blend = readBlend(kernels, weights, header, surface);
    this.#segments = new Recent((s) => this.#decode(s), KEPT);
    this.#slots = Int32Array.from({ length: surface.nSlots }, (_, slot) => slot);
    this.#placed = new Float32Array(3 * surface.nSlots);
  }

  /** `Uint32Array` (T, 3): triangles, flat. */
  get faces() {
    return this.#surface.faces;
  }

  /** `Int32Array` (V, 3): the base frame, lattice units, flat. */
  get basePoints() {
    return this.#surface.basePoints;
  }

  /** Vertex counts of the levels of detail: the whole mesh alone. */
  get levels() {
    return [this.#surface.basePoints.length / 3];
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
    const size = this.#surface.basePoints.length;
    const frames = new Float32Array(size * (stop - start));
    for (let s = 0; s < this.#header.segments; s++) {
      const [begin, end] = [this.segmentStart(s), this.segmentStart(s + 1)];
      for (let k = Math.max(start, begin); k < Math.min(stop, end); k++) {
        const segment = await this.#segments.get(s);
        segment.read(k - begin, k - begin + 1, this.#slots, this.#placed, k);
        this.#surface.spread(this.#placed, frames.subarray(size * (k - start), size * (k - start + 1)));
      }
    }
    return frames;
  }

  async #decode(s) {
    const { components, steps, fineness } = this.#header.images;
    const [name, slots, width] = [`trajectories.${s}`, this.#surface.nSlots, components[s]];
    const { budget } = this.#payload;
    budget.ask(`section '${name}'`, BYTES_PER_SAMPLE * width * slots, SECONDS_PER_SAMPLE * width * slots);
    const data = await this.#payload.section(name);
    const samples = this.#samples(await this.#payload.section(`pictures.${s}`), width, fineness);
    const segment = { frames: this.segmentStart(s + 1) - this.segmentStart(s), components: width, step: steps[s] };
    const kernels = this.#kernels.fresh(); // whose memory is given back as a whole
    const rows = this.#blend.rows.map(({ type, shape, values }) => kernels.array(type, shape, values));
    const basis = decodeSegment(kernels, data, name, samples, segment, { ...this.#blend, rows }, budget);
    return new Segment(this.#kernels.fresh(), basis, samples, slots, false, { base: this.#surface.base });
  }

  /** What a segment's planes hold at the slots' pixels: (S, R), steps, flat. */
  #samples(levels, components, fineness) {
    const pixels = this.#pixels;
    const plane = this.#header.width * this.#header.height;
    const zero = 2 ** (this.#header.profile.depth - 1);
    if (levels.length !== plane * PLANES * countPictures(components)) {
      throw new GeometryVideoError("corrupt", `its video has other pictures than the header says; ${AGAIN}`);
    }
    const samples = new Float64Array(pixels.length * components);
    for (let slot = 0, i = 0; slot < pixels.length; slot++) {
      for (let c = 0; c < components; c++, i++) samples[i] = (levels[plane * c + pixels[slot]] - zero) / fineness;
    }
    return samples;
  }
}

/** The blend's matrix (S, 4K), to be placed for each segment, K, and S. */
function readBlend(kernels, data, { clusters }, { base, points }) {
  const weights = decodeWeights(kernels, data, points.causalNeighbours(), clusters);
  const coordinates = homogeneous(base);
  const n = points.n;
  const rows = Float64Array.from({ length: 4 * n }, (_, i) => (i % 4 < 3 ? coordinates[3 * (i >> 2) + (i % 4)] : 1));
  const parts = Float64Array.from(weights.weights, (weight) => weight / TOTAL);
  const influences = parts.length / n;
  const given = [
    kernels.array("float64", [n, 4], rows),
    kernels.array("int32", [n, influences], weights.clusters),
    kernels.array("float64", [n, influences], parts),
  ];
  const [energies] = kernels.call("find_energies", ...given, clusters);
  const [inverse] = kernels.call("invert_factors", energies);
  const matrix = kernels.call("blend_rows", ...given, inverse);
  const taken = matrix.map((array) => ({ type: array.type, shape: array.shape, values: kernels.view(array).slice() }));
  kernels.free(...given, energies, inverse, ...matrix);
  return { rows: taken, clusters, slots: n };
}
