/** Blended prediction: weights once, transforms as trajectories. Mirrors `gvcodecs.mcgv.motion.blended`. */

import { Blend } from "./skinning.js";
import { Segments } from "./contract.js";
import { Trajectories } from "./skinning_coding.js";
import { decodeWeights } from "./weight_coding.js";

const LOOKS = 2 ** 24; // products that a look at the whole motion may take: some hundredths of a second

/** @implements {import("./contract.js").Motion} */
export class BlendedMotion {
  /**
   * @param {import("../format/payload.js").Payload} payload
   * @param {import("./header.js").Header} header
   * @param {import("./surface.js").Surface} surface of the base frame
   */
  constructor(payload, header, { base, point, members, points }) {
    const weights = decodeWeights(payload.section("weights"), points.causalNeighbours(), header.clusters);
    const own = Float64Array.from({ length: 3 * members.length }, (_, i) => base[3 * members[Math.floor(i / 3)] + (i % 3)]);
    this.blend = new Blend(own, weights, header.clusters);
    this.point = point;
    this.moved = new Float64Array(own.length); // (P, 3) of the frame last asked for
    this.segments = new Segments(
      payload.header.frames,
      header.segments,
      (name, frames) =>
      new Trajectories(payload.section(name), header.clusters, frames, header.transformStep, name, payload.budget),
      payload.sections,
    );
  }

  predict(frame, predicted) {
    const { point, moved } = this;
    this.#move(frame);
    for (let slot = 0, i = 0; slot < point.length; slot++, i += 3) {
      const p = 3 * point[slot];
      predicted[i] = moved[p];
      predicted[i + 1] = moved[p + 1];
      predicted[i + 2] = moved[p + 2];
    }
  }

  /** Looks at every frame, or at as many, evenly spaced, as `LOOKS` allows; all segments that are here are decoded. */
  extend(box) {
    const { segments, moved } = this;
    for (const s of segments.here()) {
      const { n, basis } = segments.get(s);
      const frames = segments.start(s + 1) - segments.start(s);
      const products = segments.count * (3 * n * basis.components + 8 * moved.length); // of a frame
      const looks = Math.min(frames, Math.max(2, Math.floor(LOOKS / products)));
      for (let i = 0; i < looks; i++) {
        this.#move(segments.start(s) + Math.floor((i * (frames - 1)) / Math.max(1, looks - 1)));
        stretch(box, moved);
      }
    }
  }

  /** Fill `moved` with a frame's points. */
  #move(frame) {
    const [trajectories, place] = this.segments.locate(frame);
    this.blend.predict(this.blend.transforms(trajectories.rows(place)), this.moved);
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
