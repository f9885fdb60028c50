/**
 * From an `mcgv` bitstream and the levels of its pictures to positions, any frame in any order. Mirrors the codec's reader.
 * Frames are distinct ones here (`format/repeated_frames.js`).
 *
 * It runs beside the page, which alone can decode pictures, and hands in their levels.
 */

import { Displacements } from "../format/displacements.js";
import { AGAIN, GeometryVideoError, corrupt } from "../format/errors.js";
import { Recent } from "../format/recent.js";
import { AffineMotion } from "./affine.js";
import { BlendedMotion } from "./blended.js";
import { VERSION, readHeader } from "./header.js";
import { decodeClusters, decodePixels, decodeSlotClusters } from "./layout_coding.js";
import { place } from "./kd_tree.js";
import { SECTIONS, placeSlots } from "./placement.js";
import { readSurface } from "./surface.js";

export { VERSION };

const OUTLIERS = "outliers"; // what the pictures cannot hold
const LOOKS = 2 ** 24; // products that a look at the motion may take: some hundredths of a second
const SEGMENTS_LOOKED_AT = 8; // of a whole file, at first

/**
 * What is read of pictures.
 *
 * @typedef {object} Planes
 * @property {[number, number]} size of a picture, pixels @property {Uint32Array} samples indices of the samples that are read
 * @property {import("./header.js").Profile} profile of the video
 */

export class McgvReader {
  #payload;
  #header;
  #surface;
  #motion;
  #outliers;
  #segments;
  #predicted; // (S, 3)
  #placed;
  #looked = new Set(); // segments that a box holds

  /** @type {Planes|null} the x, y and z planes of a picture, one below the other; null without pictures */
  planes;

  /**
   * @param {import("../format/payload.js").Payload} payload `section` may return promises
   * @param {import("../wasm/kernels.js").Kernels} kernels
   * @returns {Promise<McgvReader>}
   * @throws {GeometryVideoError} a section is not as gvpipe writes it, or takes more than its file may
   */
  static async open(payload, kernels) {
    const header = readHeader(payload.header);
    if (header.outliers !== payload.sections.has(OUTLIERS)) {
      throw new GeometryVideoError("corrupt", `its header and its section '${OUTLIERS}' do not fit; ${AGAIN}`);
    }
    const surface = await readSurface(payload, header, kernels);
    const { pixels, motion } = await readMotion(payload, header, surface, kernels);
    const data = header.outliers ? await payload.section(OUTLIERS) : null;
    const outliers = data && new Displacements(data, payload.header.frames, surface.nSlots, OUTLIERS);
    outliers?.check();
    return new McgvReader(payload, header, surface, pixels, motion, outliers);
  }

  constructor(payload, header, surface, pixels, motion, outliers) {
    this.#payload = payload;
    this.#header = header;
    this.#surface = surface;
    this.#motion = motion;
    this.#outliers = outliers;
    this.#segments = new Recent((s) => this.#decode(s));
    this.#predicted = new Float64Array(3 * surface.nSlots);
    this.#placed = new Float32Array(3 * surface.nSlots);
    const { width, height, profile } = header;
    const samples = new Uint32Array(pixels ? 3 * surface.nSlots : 0); // which one of a picture carries each coordinate
    pixels?.forEach((pixel, slot) => samples.set([pixel, pixel + width * height, pixel + 2 * width * height], 3 * slot));
    this.planes = pixels && { size: [width, 3 * height], samples, profile };
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
    return [this.#surface.slot.length];
  }

  /** First frame of segment s; F for the one after the last. */
  segmentStart(s) {
    return Math.floor((s * this.#payload.header.frames) / this.#header.segments);
  }

  /**
   * Frame `start`.
   *
   * @param {number} start @param {number} stop start + 1 @param {number} level 0
   * @param {Uint8Array|Uint16Array|null} levels (S, 3) of its picture's `planes.samples`; null without pictures
   * @returns {Promise<Float32Array>} (V, 3), model units
   * @throws {GeometryVideoError} its segment does not decode, or a position is not finite
   */
  async read(start, stop, level, levels) {
    const s = this.#segmentOf(start);
    const segment = await this.#segments.get(s);
    const [predicted, placed] = [this.#predicted, this.#placed];
    this.#motion.predict(segment, start - this.segmentStart(s), predicted);
    const step = this.#header.residualStep;
    const zero = 2 ** (this.#header.profile.depth - 1); // the level of no residual
    for (let i = 0; i < placed.length; i++) placed[i] = predicted[i] + step * (levels ? levels[i] - zero : 0); // rounded once
    this.#outliers?.apply(start, placed);
    const positions = new Float32Array(this.#surface.basePoints.length);
    this.#surface.spread(placed, positions);
    let sum = 0; // finite numbers of 32 bits have a finite sum in 64
    for (let i = 0; i < positions.length; i++) sum += positions[i];
    if (!Number.isFinite(sum)) {
      throw new GeometryVideoError("corrupt", `frame ${start} does not decode to finite positions; ${AGAIN}`);
    }
    return positions;
  }

  /** Have segment s decoded. @throws {GeometryVideoError} it does not decode */
  async prepare(s) {
    await this.#segments.get(s);
  }

  /**
   * Have a box hold the motion of segment s, but for residuals; of a file that is here as a whole the first call looks at others as well,
   * so that a page can frame the whole motion.
   *
   * @throws {GeometryVideoError} one of them does not decode, or moves too far; the box is as before
   */
  async extend(box, s) {
    const wider = structuredClone(box);
    const { segments } = this.#header;
    const isFirst = this.#payload.isWhole && !this.#looked.size;
    const most = isFirst ? Math.min(segments, SEGMENTS_LOOKED_AT) : 0;
    const numbers = [s, ...Array.from({ length: most }, (_, i) => Math.floor((i * (segments - 1)) / Math.max(1, most - 1)))];
    this.#surface.extend(wider);
    for (const number of numbers) {
      if (this.#looked.has(number)) continue;
      this.#looked.add(number);
      const frames = this.segmentStart(number + 1) - this.segmentStart(number);
      this.#motion.extend(wider, await this.#segments.get(number), frames, LOOKS / Math.max(1, most));
    }
    if (![...wider.min, ...wider.max].every(Number.isFinite)) {
      throw new GeometryVideoError("corrupt", `its motion leaves all bounds; ${AGAIN}`);
    }
    Object.assign(box, wider);
  }

  #segmentOf(frame) {
    return Math.floor(((frame + 1) * this.#header.segments - 1) / this.#payload.header.frames);
  }

  async #decode(s) {
    const name = `transforms.${s}`;
    return this.#motion.decode(await this.#payload.section(name), name, this.segmentStart(s + 1) - this.segmentStart(s));
  }
}

/** The slots' pixels, and how they move: clusters or pixels, whichever follows from the other, come second. */
async function readMotion(payload, header, surface, kernels) {
  const blended = async () => new BlendedMotion(kernels, await payload.section("weights"), header, surface, payload.budget);
  if (!header.pictures) return { pixels: null, motion: await blended() };
  if (header.prediction === "blended") {
    const placement = SECTIONS[header.placement];
    return { pixels: placeSlots(placement ? await payload.section(placement) : null, header, surface), motion: await blended() };
  }
  const { lattice, nSlots } = surface;
  const { width, height } = header;
  if (width * height < nSlots) throw corrupt("header", `planes of ${width}x${height} do not hold ${nSlots} samples`);
  const charts = header.placement === "charts" ? decodePixels(await payload.section("pixels"), nSlots, header) : null;
  const data = await payload.section("clusters");
  const clusters = charts ? decodeClusters(data, charts, header) : decodeSlotClusters(data, nSlots, header);
  return { pixels: charts ?? place(lattice, clusters, header), motion: new AffineMotion(header, surface, clusters) };
}
