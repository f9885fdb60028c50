/** From an `mcgv` bitstream and the levels of its pictures to positions, any frame in any order. Mirrors the codec's reader. */

import { decodeBase } from "../format/base_mesh.js";
import { AGAIN, GeometryVideoError } from "../format/errors.js";
import { Moves } from "../format/moves.js";
import { AffineMotion } from "./affine_motion.js";
import { BlendedMotion } from "./blended_motion.js";
import { decodeCharts } from "./chart_coding.js";
import { placeCharts } from "./chart_placement.js";
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
    const { pixels, motion } = decodeMotion(payload, header, base);
    this.motion = motion;
    if (header.outliers !== payload.sections.has("outliers")) {
      throw new GeometryVideoError("corrupt", `its header and its section 'outliers' do not fit; ${AGAIN}`);
    }
    /** What the pictures cannot hold, then what a bound on every vertex needs. */
    this.moves = ["outliers", "corrections"]
      .filter((name) => payload.sections.has(name))
      .map((name) => new Moves(payload.section(name), payload.header.frames, base.visits.length, name));
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
    this.motion.addTo(frame, positions);
    for (const moves of this.moves) moves.apply(frame, positions);
  }

  /**
   * The box that the whole motion stays in, but for residuals; model units. Decodes, and so checks, all transforms and
   * moves.
   */
  bounds() {
    for (const moves of this.moves) moves.check();
    const box = { min: [Infinity, Infinity, Infinity], max: [-Infinity, -Infinity, -Infinity] };
    this.motion.extend(box);
    if (![...box.min, ...box.max].every(Number.isFinite)) {
      throw new GeometryVideoError("corrupt", `its motion leaves all bounds; ${AGAIN}`);
    }
    return box;
  }
}

/** The vertices' pixels, and how they move: clusters or pixels, whichever follows from the other, come second. */
function decodeMotion(payload, header, base) {
  const { origin, baseStep } = header;
  const positions = Float64Array.from(base.points, (index, i) => origin[i % 3] + index * baseStep);
  const charts = header.placement === "charts" ? decodePixels(payload.section("pixels"), base.visits, header) : null;
  if (header.prediction === "blended") {
    const points = new Points(base.points, base.faces, base.visits);
    const pixels = charts ?? placePoints(payload, header, base, points);
    return { pixels, motion: new BlendedMotion(payload, header, positions, points) };
  }
  const data = payload.section("clusters");
  const clusters = charts ? decodeClusters(data, charts, header) : decodeVertexClusters(data, base.visits, header);
  const pixels = charts ?? place(base.points, clusters, header);
  return { pixels, motion: new AffineMotion(payload, header, positions, clusters) };
}

/** The vertices' pixels where they follow from the base frame. */
function placePoints(payload, header, base, points) {
  if (header.placement === "halves") return place(base.points, points.pieces(), header);
  const charts = decodeCharts(payload.section("charts"), points.earlierNeighbours());
  return placeCharts(base.points, points.point.map((p) => charts[p]), header);
}
