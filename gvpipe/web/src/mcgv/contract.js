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
   * @param {Map<string, Uint8Array>} sections of the file that are here
   */
  constructor(frames, count, decode, sections) {
    this.frames = frames;
    this.count = count;
    this.sections = sections;
    this.recent = new Recent((s) => decode(this.name(s), this.start(s + 1) - this.start(s)));
  }

  /** First frame of a segment; F for the one after the last. */
  start(s) {
    return Math.floor((s * this.frames) / this.count);
  }

  /** The segment that holds a frame, and the frame's place in it. */
  locate(frame) {
    const s = this.#number(frame);
    return [this.get(s), frame - this.start(s)];
  }

  #number(frame) {
    return Math.floor(((frame + 1) * this.count - 1) / this.frames);
  }

  /** The name of a segment's section. */
  name(s) {
    return `transforms.${s}`;
  }

  /** The names of the sections of the segments that hold frames `first` to `last`. */
  names(first, last) {
    const [begin, end] = [first, last].map((frame) => this.#number(frame));
    return Array.from({ length: end - begin + 1 }, (_, i) => this.name(begin + i));
  }

  /** The numbers of the segments that can be decoded: all, but of a file that comes in parts. */
  here() {
    const numbers = Array.from({ length: this.count }, (_, s) => s);
    const here = numbers.filter((s) => this.sections.has(this.name(s)));
    return here.length ? here : numbers; // so that a section that is missing is an error
  }

  get(s) {
    return this.recent.get(s);
  }
}
