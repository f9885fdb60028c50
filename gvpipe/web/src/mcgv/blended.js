/** Blended prediction: weights once, transforms as trajectories. Mirrors `gvcodecs.mcgv.motion.blended`. */

import { stretch } from "../format/points.js";
import { Blend } from "./skinning.js";
import { Trajectories } from "./skinning_coding.js";
import { decodeWeights } from "./weight_coding.js";

/** @implements {import("./contract.js").Motion} */
export class BlendedMotion {
  #kernels;
  #header;
  #budget;
  #blend;
  #moved; // (S, 3) of the frame last asked for

  /**
   * @param {import("../wasm/kernels.js").Kernels} kernels
   * @param {Uint8Array} data section `weights`
   * @param {import("./header.js").Header} header
   * @param {import("./surface.js").Surface} surface of the base frame @param {import("../format/budget.js").Budget} budget of the file
   */
  constructor(kernels, data, header, { base, points }, budget) {
    const weights = decodeWeights(kernels, data, points.causalNeighbours(), header.clusters);
    this.#kernels = kernels;
    this.#header = header;
    this.#budget = budget;
    this.#blend = new Blend(base, weights, header.clusters);
    this.#moved = new Float64Array(base.length);
  }

  decode(data, name, frames) {
    const { clusters, transformStep } = this.#header;
    return new Trajectories(this.#kernels.fresh(), data, this.#blend, clusters, frames, transformStep, name, this.#budget);
  }

  predict(trajectories, place, predicted) {
    this.#move(trajectories, place);
    predicted.set(this.#moved);
  }

  /** Looks at every frame, or at as many, evenly spaced, as `looks` allows. */
  extend(box, trajectories, frames, looks) {
    const products = 3 * trajectories.n * trajectories.basis.components + 8 * this.#moved.length; // of a frame
    const count = Math.min(frames, Math.max(2, Math.floor(looks / products)));
    for (let i = 0; i < count; i++) {
      this.#move(trajectories, Math.floor((i * (frames - 1)) / Math.max(1, count - 1)));
      stretch(box, this.#moved);
    }
  }

  #move(trajectories, place) {
    this.#blend.predict(this.#blend.transforms(trajectories.rows(place)), this.#moved);
  }
}
