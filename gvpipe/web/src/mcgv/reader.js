/** From an `mcgv` bitstream and the levels of its pictures to positions, any frame in any order. Mirrors the codec's reader. */

import { decodeBase } from "../format/base_mesh.js";
import { AGAIN, GeometryVideoError } from "../format/errors.js";
import { readHeader } from "./header.js";
import { decodeClusters, decodePixels } from "./layout.js";
import { AffinePredictor } from "./prediction.js";
import { decodeTransforms } from "./transforms.js";

const ZERO = 128; // the level of a zero residual
const SEGMENTS_KEPT = 4; // whose transforms stay decoded

export class McgvReader {
  /** @param {import("../format/payload.js").Payload} payload @returns {Promise<McgvReader>} */
  static async open(payload) {
    const header = readHeader(payload.header);
    const base = await decodeBase(payload.section("mesh"), payload.section("order"));
    const { vertices, triangles } = payload.header;
    if (base.visits.length !== vertices || base.faces.length !== 3 * triangles) {
      throw new GeometryVideoError("corrupt", `the mesh has other counts than the header says; ${AGAIN}`);
    }
    return new McgvReader(payload, header, base);
  }

  constructor(payload, header, base) {
    this.payload = payload;
    this.header = header;
    this.faces = base.faces;
    this.basePoints = base.points;
    this.frames = payload.header.frames;
    const pixels = decodePixels(payload.section("pixels"), base.visits, header);
    const clusters = decodeClusters(payload.section("clusters"), pixels, header);
    const { origin, baseStep } = header;
    const points = Float64Array.from(base.points, (index, i) => origin[i % 3] + index * baseStep);
    this.predictor = new AffinePredictor(points, clusters, header.clusters);
    this.segments = new Map(); // segment -> its transforms, the latest decoded ones
    const plane = header.width * header.height;
    /** (V, 3) which sample of a picture carries each coordinate. */
    this.samples = new Uint32Array(base.points.length);
    pixels.forEach((pixel, v) => this.samples.set([pixel, pixel + plane, pixel + 2 * plane], 3 * v));
  }

  /** Width and height of a picture: the x, y and z planes, one below the other. */
  get pictureSize() {
    return [this.header.width, 3 * this.header.height];
  }

  /**
   * @param {number} frame
   * @param {Uint8Array} levels (V, 3) of the picture's `samples`
   * @param {Float32Array} positions (V, 3) filled, model units
   */
  rebuild(frame, levels, positions) {
    const step = this.header.residualStep;
    for (let i = 0; i < positions.length; i++) positions[i] = step * (levels[i] - ZERO);
    this.predictor.addTo(positions, this.#transforms(frame));
  }

  /** The box that the whole motion stays in, but for residuals; model units. Decodes, and so checks, all transforms. */
  bounds() {
    const box = { min: [Infinity, Infinity, Infinity], max: [-Infinity, -Infinity, -Infinity] };
    for (let s = 0; s < this.header.segments; s++) this.predictor.extend(box, this.#segment(s));
    return box;
  }

  #transforms(frame) {
    const s = Math.floor(((frame + 1) * this.header.segments - 1) / this.frames);
    const size = this.predictor.rest.length;
    const first = (frame - this.#start(s)) * size;
    return this.#segment(s).subarray(first, first + size);
  }

  #segment(s) {
    if (!this.segments.has(s)) {
      const name = `transforms.${s}`;
      const frames = this.#start(s + 1) - this.#start(s);
      const { rest } = this.predictor;
      this.segments.set(s, decodeTransforms(this.payload.section(name), frames, rest, this.header.transformStep, name));
      if (this.segments.size > SEGMENTS_KEPT) this.segments.delete(this.segments.keys().next().value);
    }
    return this.segments.get(s);
  }

  #start(segment) {
    return Math.floor((segment * this.frames) / this.header.segments);
  }
}
