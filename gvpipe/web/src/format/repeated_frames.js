/**
 * Frames that repeat the frame before them: the file codes only *distinct* frames, and for how many frames each is shown. Mirrors
 * `gvpipe.coding.repeated_frames`; `docs/format.md`, section 10.
 */

import { REPEATED_FRAMES_SECTION as SECTION } from "../constants.js";
import { Cursor } from "./cursor.js";
import { decodeIntegers } from "./integers.js";
import { Payload } from "./payload.js";

const PER_RUN = 80; // bytes

export class RepeatedFrames {
  /**
   * @param {number} frames F
   * @param {Uint32Array|null} starts (D) the frame at which each distinct frame is shown first; null: no frame repeats another
   */
  constructor(frames, starts = null) {
    this.frames = frames;
    this.starts = starts;
    /** D, the number of distinct frames. */
    this.distinct = starts ? starts.length : frames;
    /** Frames that come at once, of a file that is still written; 0: it is finished. */
    this.clip = 0;
  }

  /** That a file in which no frame repeats another has so many frames by now. @param {number} frames @param {number} clip as above */
  grow(frames, clip) {
    this.frames = this.distinct = frames;
    this.clip = clip;
  }

  /** Which distinct frame a frame shows, 0..D - 1. */
  distinctOf(frame) {
    if (!this.starts) return frame;
    let [low, high] = [0, this.distinct - 1]; // the last that starts at the frame or before
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.starts[middle] <= frame) low = middle;
      else high = middle - 1;
    }
    return low;
  }

  /** The frame that shows a distinct frame first; F for the one after the last. */
  frameOf(distinct) {
    return distinct < this.distinct ? (this.starts?.[distinct] ?? distinct) : this.frames;
  }

  /** The payload as the codec knows it: of the distinct frames. */
  distinctPayload({ header, sections, budget }) {
    return new Payload({ ...header, frames: this.distinct }, sections, budget);
  }
}

/**
 * @param {Payload} payload
 * @returns {RepeatedFrames}
 * @throws {GeometryVideoError} the runs are not those of the header's number of frames
 */
export function readRepeatedFrames({ header: { frames }, sections, budget }) {
  if (!sections.has(SECTION)) return new RepeatedFrames(frames);
  const cursor = new Cursor(sections.get(SECTION), SECTION);
  const distinct = cursor.varint(frames, "the number of distinct frames");
  budget.keep(`${distinct} distinct frames`, PER_RUN * distinct);
  const repeats = decodeIntegers(cursor.rest(), distinct, null, SECTION); // run lengths less 1
  const starts = new Uint32Array(distinct);
  let end = 0;
  for (let d = 0; d < distinct; d++) {
    starts[d] = end;
    end += repeats[d] + 1;
    if (repeats[d] < 0 || end > frames) break;
  }
  if (end !== frames || repeats.some((n) => n < 0)) throw cursor.corrupt(`its runs do not add up to ${frames} frames`);
  return new RepeatedFrames(frames, starts);
}
