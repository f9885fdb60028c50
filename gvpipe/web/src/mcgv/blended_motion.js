/** Blended prediction: weights once, transforms as trajectories. Mirrors `gvcodecs.mcgv.blended_motion`. */

import { Blend } from "./blending.js";
import { Segments } from "./motion.js";
import { Points } from "./points.js";
import { Trajectories } from "./trajectories.js";
import { decodeWeights } from "./weight_coding.js";

/** @implements {import("./motion.js").Motion} */
export class BlendedMotion {
  /**
   * @param {import("../format/payload.js").Payload} payload
   * @param {import("./header.js").Header} header
   * @param {import("../format/base_mesh.js").BaseMesh} base
   * @param {Float64Array} positions (V, 3) of the base frame, model units, flat
   */
  constructor(payload, header, base, positions) {
    const points = new Points(base.points, base.faces, base.visits);
    const weights = decodeWeights(payload.section("weights"), points.earlierNeighbours(), header.clusters);
    const own = new Float64Array(3 * points.members.length);
    points.members.forEach((v, p) => own.set(positions.subarray(3 * v, 3 * v + 3), 3 * p));
    this.blend = new Blend(own, weights, header.clusters);
    this.point = points.point;
    this.predicted = new Float64Array(own.length);
    this.segments = new Segments(payload.header.frames, header.segments, (name, frames) =>
      new Trajectories(payload.section(name), header.clusters, frames, header.transformStep, name),
    );
  }

  addTo(frame, levels) {
    const [trajectories, place] = this.segments.locate(frame);
    const { blend, point, predicted } = this;
    blend.predict(blend.transforms(trajectories.rows(place)), predicted);
    for (let v = 0, i = 0; v < point.length; v++, i += 3) {
      const p = 3 * point[v];
      levels[i] += predicted[p];
      levels[i + 1] += predicted[p + 1];
      levels[i + 2] += predicted[p + 2];
    }
  }

  extend(box) {
    for (let frame = 0; frame < this.segments.frames; frame++) {
      const [trajectories, place] = this.segments.locate(frame);
      this.blend.extend(box, this.blend.transforms(trajectories.rows(place)));
    }
  }
}
