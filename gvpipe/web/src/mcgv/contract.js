/** What the reader knows of a prediction, whichever it is. Mirrors `gvcodecs.mcgv.motion.contract` and `gvpipe.container.segments`. */

import { Recent } from "../format/recent.js";

/**
 * @typedef {object} Motion
 * @property {(frame: number, predicted: Float64Array) => void} predict fills in a frame's prediction (S, 3), model units, flat
 * @property {(box: {min: number[], max: number[]}) => void} extend makes a box hold the prediction of all frames; decodes them
 */

/** Segments of a sequence: decoded when first asked for. */
export class Segments {
  /**
   * @param {number} frames F @param {number} count S
   * @param {(name: string, frames: number) => object} decode a segment, given its section's name and its frames
   */
  constructor(frames, count, decode) {
    this.frames = frames;
    this.count = count;
    this.recent = new Recent((s) => decode(`transforms.${s}`, this.start(s + 1) - this.start(s)));
  }

  /** First frame of a segment; F for the one after the last. */
  start(s) {
    return Math.floor((s * this.frames) / this.count);
  }

  /** The segment that holds a frame, and the frame's place in it. */
  locate(frame) {
    const s = Math.floor(((frame + 1) * this.count - 1) / this.frames);
    return [this.get(s), frame - this.start(s)];
  }

  get(s) {
    return this.recent.get(s);
  }
}
