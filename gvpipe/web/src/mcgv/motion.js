/** What the reader knows of a prediction, whichever it is. Mirrors `gvcodecs.mcgv.motion` and `gvpipe.segments`. */

const KEPT = 4; // segments that stay decoded

/**
 * @typedef {object} Motion
 * @property {(frame: number, levels: Float32Array) => void} addTo adds a frame's prediction (V, 3), model units, flat
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
    this.decode = decode;
    this.kept = new Map();
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
    if (!this.kept.has(s)) {
      this.kept.set(s, this.decode(`transforms.${s}`, this.start(s + 1) - this.start(s)));
      if (this.kept.size > KEPT) this.kept.delete(this.kept.keys().next().value);
    }
    return this.kept.get(s);
  }
}
