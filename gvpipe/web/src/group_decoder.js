/**
 * Groups of pictures by `VideoDecoder`: exact samples and numbers, whatever a browser's `<video>` makes of them.
 *
 * Where the decoder gives luma, that is read; where it gives grey as red, green and blue (Firefox), a table goes back.
 */

import { AGAIN, GeometryVideoError } from "./format/errors.js";
import { OF_GREY, ofLuma } from "./levels.js";

const LUMA = { 8: ["I420", "I420A", "NV12"], 10: ["I420P10", "I420AP10"] };
const COLOURS = { 8: ["BGRX", "BGRA", "RGBX", "RGBA"], 10: [] };
const REMEDY = "Chromium does; gvpipe export-html --convert makes a page for all browsers";
const TICK = 1000; // microseconds of a picture, for the decoder; so that its rounding changes no number
const QUEUED = 6; // pictures that the decoder has not begun
const TAKEN = 4; // pictures decoded and not yet read: large ones fill the memory

export class GroupDecoder {
  /**
   * @param {import("./track.js").Track} track
   * @param {[number, number]} size of a picture, pixels
   * @param {Uint32Array} samples indices of a picture's samples
   * @param {import("./mcgv/header.js").Profile} profile of the video
   */
  constructor(track, size, samples, profile) {
    this.track = track;
    this.size = size;
    this.samples = samples;
    this.depth = profile.depth;
    this.table = ofLuma(profile);
    this.decoder = null;
    this.taking = 0;
    this.taken = Promise.resolve();
    this.buffer = new Uint8Array(0);
    this.layout = "";
    this.offsets = new Uint32Array(samples.length);
  }

  /**
   * @param {import("./track.js").Sample[]} group
   * @param {(picture: number, levels: Uint8Array|Uint16Array) => void} give called for each picture, with the levels of `samples`
   * @throws {GeometryVideoError} this browser has no decoder for it, or the group is damaged
   */
  async decode(group, give) {
    const failed = new Promise((_, reject) => (this.fail = reject));
    failed.catch(() => {}); // looked at below
    this.give = give;
    let given = 0;
    this.count = () => given++;
    if (this.decoder?.state !== "configured") this.#open(); // at first, and after the browser has taken it away
    const { decoder } = this;
    for (const [i, { data, picture }] of group.entries()) {
      if (decoder.state !== "configured") break;
      decoder.decode(new EncodedVideoChunk({ type: i ? "delta" : "key", timestamp: TICK * picture, data }));
      if (decoder.decodeQueueSize > QUEUED && "ondequeue" in decoder) {
        await Promise.race([new Promise((resolve) => decoder.addEventListener("dequeue", resolve, { once: true })), failed]);
      }
      if (this.taking > TAKEN) await Promise.race([this.taken, failed]);
    }
    await Promise.race([decoder.state === "configured" ? decoder.flush() : failed, failed]).catch((error) => {
      throw error instanceof GeometryVideoError ? error : this.#cannotDecode(error);
    });
    await Promise.race([this.taken, failed]);
    if (given !== group.length) {
      throw new GeometryVideoError("corrupt", `its video gives ${given} pictures in place of ${group.length}; ${AGAIN}`);
    }
  }

  close() {
    if (this.decoder && this.decoder.state !== "closed") this.decoder.close();
  }

  #open() {
    const { codec, description } = this.track;
    this.decoder = new VideoDecoder({
      output: (picture) => {
        this.taking++;
        this.taken = this.taken.then(() => this.#take(picture)).catch((error) => this.fail(error));
      },
      error: (error) => this.fail(this.#cannotDecode(error)),
    });
    try {
      this.decoder.configure({ codec, description });
    } catch (error) {
      throw this.#cannotDecode(error);
    }
  }

  async #take(picture) {
    try {
      const { format, visibleRect, timestamp } = picture;
      const [width, height] = this.size;
      if (visibleRect.width !== width || visibleRect.height !== height) {
        const found = `${visibleRect.width}x${visibleRect.height}`;
        throw new GeometryVideoError("corrupt", `its video is ${found} pixels; ${width}x${height} are needed`);
      }
      const isLuma = LUMA[this.depth].includes(format);
      if (!isLuma && !COLOURS[this.depth].includes(format)) {
        const remedy = this.depth === 8 ? "which the player cannot read" : `not 10-bit samples; ${REMEDY}`;
        throw new GeometryVideoError("unsupported", `this browser gives pictures as ${format ?? "no samples"}, ${remedy}`);
      }
      const bytes = picture.allocationSize();
      if (this.buffer.length !== bytes) this.buffer = new Uint8Array(bytes);
      const [plane] = await picture.copyTo(this.buffer);
      const isWide = this.depth > 8;
      this.#arrange(plane, isLuma ? 1 + isWide : 4);
      const table = isLuma ? this.table : OF_GREY;
      const buffer = isWide ? new Uint16Array(this.buffer.buffer) : this.buffer;
      const levels = new buffer.constructor(this.samples.length);
      for (let i = 0; i < levels.length; i++) levels[i] = table[buffer[this.offsets[i] >> isWide]];
      this.count();
      this.give(Math.round(timestamp / TICK), levels);
    } finally {
      this.taking--;
      picture.close();
    }
  }

  #cannotDecode(error) {
    const remedy = this.depth === 8 ? "" : `; it has ${this.depth} bits a sample: ${REMEDY}`;
    return new GeometryVideoError("unsupported", `this browser cannot decode the video: ${error.message || error.name}${remedy}`);
  }

  /** Where in the buffer each sample lies, bytes. */
  #arrange({ offset, stride }, bytesPerPixel) {
    const layout = `${offset} ${stride} ${bytesPerPixel}`;
    if (layout === this.layout) return;
    this.layout = layout;
    const [width] = this.size;
    this.samples.forEach((sample, i) => {
      const x = sample % width;
      this.offsets[i] = offset + ((sample - x) / width) * stride + x * bytesPerPixel;
    });
  }
}
