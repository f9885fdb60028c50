/** The published prediction: one affine transform per cluster and frame. Mirrors `gvcodecs.mcgv.motion.affine`. */

import { AffinePredictor } from "./affine_fit.js";
import { decodeTransforms } from "./affine_coding.js";

/** @implements {import("./contract.js").Motion} */
export class AffineMotion {
  #predictor;
  #step;

  /**
   * @param {import("./header.js").Header} header
   * @param {import("./surface.js").Surface} surface of the base frame
   * @param {Uint16Array} clusters (S)
   */
  constructor(header, surface, clusters) {
    this.#predictor = new AffinePredictor(surface.base, clusters, header.clusters);
    this.#step = header.transformStep;
  }

  decode(data, name, frames) {
    return decodeTransforms(data, frames, this.#predictor.rest, this.#step, name);
  }

  predict(transforms, place, predicted) {
    const size = this.#predictor.rest.length;
    this.#predictor.predict(transforms.subarray(place * size, (place + 1) * size), predicted);
  }

  extend(box, transforms) {
    this.#predictor.extend(box, transforms);
  }
}
