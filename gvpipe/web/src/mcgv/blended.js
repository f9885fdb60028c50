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
  #point;
  #moved; // (P, 3) of the frame last asked for

  /**
   * @param {import("../wasm/kernels.js").Kernels} kernels
   * @param {Uint8Array} data section `weights`
   * @param {import("./header.js").Header} header
   * @param {import("./surface.js").Surface} surface of the base frame @param {import("../format/budget.js").Budget} budget of the file
   */
  constructor(kernels, data, header, { base, point, members, points }, budget) {
    const weights = decodeWeights(kernels, data, points.causalNeighbours(), header.clusters);
    const own = Float64Array.from({ length: 3 * members.length }, (_, i) => base[3 * members[Math.floor(i / 3)] + (i % 3)]);
    this.#kernels = kernels;
    this.#header = header;
    this.#budget = budget;
    this.#blend = new Blend(own, weights, header.clusters);
    this.#point = point;
    this.#moved = new Float64Array(own.length);
  }

  decode(data, name, frames) {
    const { clusters, transformStep } = this.#header;
    return new Trajectories(this.#kernels.fresh(), data, clusters, frames, transformStep, name, this.#budget);
  }

  predict(trajectories, place, predicted) {
    const [point, moved] = [this.#point, this.#moved];
    this.#move(trajectories, place);
    for (let slot = 0, i = 0; slot < point.length; slot++, i += 3) {
      const p = 3 * point[slot];
      predicted[i] = moved[p];
      predicted[i + 1] = moved[p + 1];
      predicted[i + 2] = moved[p + 2];
    }
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
