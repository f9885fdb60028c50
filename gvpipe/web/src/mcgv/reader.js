/**
 * From an `mcgv` bitstream and the levels of its pictures to positions, any frame in any order. Mirrors the codec's reader.
 * Frames are distinct ones here (`format/repeated_frames.js`).
 */

import { AGAIN, GeometryVideoError, corrupt } from "../format/errors.js";
import { Displacements } from "../format/displacements.js";
import { Kernels } from "../wasm/kernels.js";
import { AffineMotion } from "./affine.js";
import { BlendedMotion } from "./blended.js";
import { readHeader } from "./header.js";
import { decodeClusters, decodePixels, decodeSlotClusters } from "./layout_coding.js";
import { place } from "./kd_tree.js";
import { SECTIONS, placeSlots } from "./placement.js";
import { readSurface } from "./surface.js";

/**
 * What is read of pictures.
 *
 * @typedef {object} Planes
 * @property {[number, number]} size of a picture, pixels @property {Uint32Array} samples indices of the samples that are read
 * @property {import("./header.js").Profile} profile of the video
 */

export class McgvReader {
  /** @param {import("../format/payload.js").Payload} payload @param {Uint8Array} code of kernels @returns {Promise<McgvReader>} */
  static async open(payload, code) {
    const header = readHeader(payload.header);
    const kernels = await Kernels.open(code);
    return new McgvReader(payload, header, await readSurface(payload, header, kernels), kernels);
  }

  constructor(payload, header, surface, kernels) {
    this.header = header;
    /** The level of a zero residual. */
    this.zero = 2 ** (header.profile.depth - 1);
    this.surface = surface;
    const { pixels, motion } = decodeMotion(payload, header, surface, kernels);
    this.motion = motion;
    if (header.outliers !== payload.sections.has("outliers")) {
      throw new GeometryVideoError("corrupt", `its header and its section 'outliers' do not fit; ${AGAIN}`);
    }
    const displacementsOf = (name, n) =>
      payload.sections.has(name) ? [new Displacements(payload.section(name), payload.header.frames, n, name)] : [];
    /** What the pictures cannot hold. */
    this.outliers = displacementsOf("outliers", surface.nSlots);
    /** What a bound on every vertex needs. */
    this.corrections = displacementsOf("corrections", surface.slot.length);
    const plane = header.width * header.height;
    /** (S, 3) which sample of a picture carries each coordinate; null without pictures. */
    this.samples = pixels && new Uint32Array(3 * surface.nSlots);
    pixels?.forEach((pixel, slot) => this.samples.set([pixel, pixel + plane, pixel + 2 * plane], 3 * slot));
    this.predicted = new Float64Array(3 * surface.nSlots);
    this.placed = new Float32Array(3 * surface.nSlots);
  }

  get faces() {
    return this.surface.faces;
  }

  get basePoints() {
    return this.surface.basePoints;
  }

  /** `Uint8Array` (S, 3): the levels of a frame without a residual. */
  get zeroLevels() {
    return new Uint8Array(3 * this.surface.nSlots).fill(this.zero);
  }

  /** @returns {Planes} of a picture: the x, y and z planes, one below the other */
  get planes() {
    return { size: [this.header.width, 3 * this.header.height], samples: this.samples, profile: this.header.profile };
  }

  /** First frame of every segment, and their number at the end. */
  get segmentStarts() {
    const { segments } = this.motion;
    return Array.from({ length: segments.count + 1 }, (_, s) => segments.start(s));
  }

  /** The names of the sections that frames `first` to `last` need beside what all share. */
  sectionsOf(first, last) {
    return this.motion.segments.names(first, last);
  }

  /**
   * @param {number} frame
   * @param {Uint8Array|Uint16Array} levels (S, 3) of the picture's `samples`
   * @param {Float32Array} positions (V, 3) filled, model units
   * @throws {GeometryVideoError} one of them is not finite
   */
  rebuild(frame, levels, positions) {
    const { predicted, placed, zero } = this;
    const step = this.header.residualStep;
    this.motion.predict(frame, predicted);
    for (let i = 0; i < placed.length; i++) placed[i] = predicted[i] + step * (levels[i] - zero); // rounded once
    for (const moves of this.outliers) moves.apply(frame, placed);
    this.surface.spread(placed, positions);
    for (const moves of this.corrections) moves.apply(frame, positions);
    let sum = 0; // finite numbers of 32 bits have a finite sum in 64
    for (let i = 0; i < positions.length; i++) sum += positions[i];
    if (!Number.isFinite(sum)) {
      throw new GeometryVideoError("corrupt", `frame ${frame} does not decode to finite positions; ${AGAIN}`);
    }
  }

  /**
   * The box that the whole motion stays in, but for residuals; model units. Decodes, and so checks, all transforms and
   * moves; of a file that comes in parts, those of the segments that are here.
   */
  bounds() {
    for (const moves of [...this.outliers, ...this.corrections]) moves.check();
    const box = { min: [Infinity, Infinity, Infinity], max: [-Infinity, -Infinity, -Infinity] };
    this.motion.extend(box);
    this.surface.extend(box);
    if (![...box.min, ...box.max].every(Number.isFinite)) {
      throw new GeometryVideoError("corrupt", `its motion leaves all bounds; ${AGAIN}`);
    }
    return box;
  }
}

/** The slots' pixels, and how they move: clusters or pixels, whichever follows from the other, come second. */
function decodeMotion(payload, header, surface, kernels) {
  const { lattice, visits, nSlots } = surface;
  if (!header.pictures) return { pixels: null, motion: new BlendedMotion(payload, header, surface, kernels) };
  if (header.prediction === "blended") {
    const placement = SECTIONS[header.placement];
    const pixels = placeSlots(placement ? payload.section(placement) : null, header, surface);
    return { pixels, motion: new BlendedMotion(payload, header, surface, kernels) };
  }
  const { width, height } = header;
  if (width * height < nSlots) throw corrupt("header", `planes of ${width}x${height} do not hold ${nSlots} samples`);
  const charts = header.placement === "charts" ? decodePixels(payload.section("pixels"), visits, header) : null;
  const data = payload.section("clusters");
  const clusters = charts ? decodeClusters(data, charts, header) : decodeSlotClusters(data, visits, header);
  const pixels = charts ?? place(lattice, clusters, header);
  return { pixels, motion: new AffineMotion(payload, header, surface, clusters) };
}
