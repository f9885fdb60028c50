/** Blended prediction: weights once, transforms as trajectories. Mirrors `gvcodecs.mcgv.blended_motion`. */

import { Blend } from "./blending.js";
import { Segments } from "./motion.js";
import { Trajectories } from "./trajectories.js";
import { decodeWeights } from "./weight_coding.js";

const LOOKS = 2 ** 24; // products that a look at the whole motion may take: some hundredths of a second

/** @implements {import("./motion.js").Motion} */
export class BlendedMotion {
  /**
   * @param {import("../format/payload.js").Payload} payload
   * @param {import("./header.js").Header} header
   * @param {Float64Array} base (V, 3) model units, flat
   * @param {import("./points.js").Points} points of the base frame
   */
  constructor(payload, header, base, points) {
    const weights = decodeWeights(payload.section("weights"), points.earlierNeighbours(), header.clusters);
    const { members } = points;
    const own = Float64Array.from({ length: 3 * members.length }, (_, i) => base[3 * members[Math.floor(i / 3)] + (i % 3)]);
    this.blend = new Blend(own, weights, header.clusters);
    this.point = points.point;
    this.predicted = new Float64Array(own.length); // (P, 3) of the frame last asked for
    this.segments = new Segments(payload.header.frames, header.segments, (name, frames) =>
      new Trajectories(payload.section(name), header.clusters, frames, header.transformStep, name),
    );
  }

  addTo(frame, levels) {
    const { point, predicted } = this;
    this.#predict(frame);
    for (let v = 0, i = 0; v < point.length; v++, i += 3) {
      const p = 3 * point[v];
      levels[i] += predicted[p];
      levels[i + 1] += predicted[p + 1];
      levels[i + 2] += predicted[p + 2];
    }
  }

  /** Looks at every frame, or at as many, evenly spaced, as `LOOKS` allows; all segments are decoded. */
  extend(box) {
    const { segments, predicted } = this;
    for (let s = 0; s < segments.count; s++) {
      const { n, basis } = segments.get(s);
      const frames = segments.start(s + 1) - segments.start(s);
      const products = segments.count * (3 * n * basis.components + 8 * predicted.length); // of a frame
      const looks = Math.min(frames, Math.max(2, Math.floor(LOOKS / products)));
      for (let i = 0; i < looks; i++) {
        this.#predict(segments.start(s) + Math.floor((i * (frames - 1)) / Math.max(1, looks - 1)));
        stretch(box, predicted);
      }
    }
  }

  /** Fill `predicted` with a frame's points. */
  #predict(frame) {
    const [trajectories, place] = this.segments.locate(frame);
    this.blend.predict(this.blend.transforms(trajectories.rows(place)), this.predicted);
  }
}

/** Make a box hold points (P, 3), flat. */
function stretch({ min, max }, points) {
  for (let axis = 0; axis < 3; axis++) {
    let low = min[axis];
    let high = max[axis];
    for (let i = axis; i < points.length; i += 3) {
      if (!(points[i] >= low)) low = points[i]; // NaN too
      if (!(points[i] <= high)) high = points[i];
    }
    min[axis] = low;
    max[axis] = high;
  }
}
