/** The published prediction: one affine transform per cluster and frame. Mirrors `gvcodecs.mcgv.motion.affine`. */

import { Segments } from "./contract.js";
import { AffinePredictor } from "./affine_fit.js";
import { decodeTransforms } from "./affine_coding.js";

/** @implements {import("./contract.js").Motion} */
export class AffineMotion {
  /**
   * @param {import("../format/payload.js").Payload} payload
   * @param {import("./header.js").Header} header
   * @param {import("./surface.js").Surface} surface of the base frame
   * @param {Uint16Array} clusters (S)
   */
  constructor(payload, header, surface, clusters) {
    this.predictor = new AffinePredictor(surface.base, clusters, header.clusters);
    const { rest } = this.predictor;
    this.segments = new Segments(
      payload.header.frames,
      header.segments,
      (name, frames) =>
      decodeTransforms(payload.section(name), frames, rest, header.transformStep, name),
      payload.sections,
    );
  }

  predict(frame, predicted) {
    const [transforms, place] = this.segments.locate(frame);
    const size = this.predictor.rest.length;
    this.predictor.predict(transforms.subarray(place * size, (place + 1) * size), predicted);
  }

  extend(box) {
    for (const s of this.segments.here()) this.predictor.extend(box, this.segments.get(s));
  }
}
