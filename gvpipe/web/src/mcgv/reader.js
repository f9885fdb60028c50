/** From an `mcgv` bitstream and the levels of its pictures to positions, any frame in any order. Mirrors the codec's reader. */

import { decodeBase } from "../format/base_mesh.js";
import { AGAIN, GeometryVideoError } from "../format/errors.js";
import { AffineMotion } from "./affine_motion.js";
import { BlendedMotion } from "./blended_motion.js";
import { readHeader } from "./header.js";
import { decodeClusters, decodePixels, decodeVertexClusters } from "./layout.js";
import { place } from "./placement.js";
import { Points } from "./points.js";

const ZERO = 128; // the level of a zero residual

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
    this.header = header;
    this.faces = base.faces;
    this.basePoints = base.points;
    const { origin, baseStep, width, height } = header;
    const positions = Float64Array.from(base.points, (index, i) => origin[i % 3] + index * baseStep);
    const points = new Points(base.points, base.faces, base.visits);
    const { pixels, clusters } = layOut(payload, header, base, points);
    this.motion =
      header.prediction === "affine"
        ? new AffineMotion(payload, header, positions, clusters)
        : new BlendedMotion(payload, header, positions, points);
    const plane = width * height;
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
    this.motion.addTo(frame, positions);
  }

  /** The box that the whole motion stays in, but for residuals; model units. Decodes, and so checks, all transforms. */
  bounds() {
    const box = { min: [Infinity, Infinity, Infinity], max: [-Infinity, -Infinity, -Infinity] };
    this.motion.extend(box);
    if (![...box.min, ...box.max].every(Number.isFinite)) {
      throw new GeometryVideoError("corrupt", `its motion leaves all bounds; ${AGAIN}`);
    }
    return box;
  }
}

/** The vertices' pixels, and their clusters where they follow one each. */
function layOut(payload, header, base, points) {
  const isAffine = header.prediction === "affine";
  if (header.placement === "halves") {
    const clusters = isAffine ? decodeVertexClusters(payload.section("clusters"), base.visits, header) : null;
    return { pixels: place(base.points, clusters ?? points.components(), header), clusters };
  }
  const pixels = decodePixels(payload.section("pixels"), base.visits, header);
  return { pixels, clusters: isAffine ? decodeClusters(payload.section("clusters"), pixels, header) : null };
}
