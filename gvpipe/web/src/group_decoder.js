/**
 * Groups of pictures by `VideoDecoder`: exact samples and numbers, whatever a browser's `<video>` makes of them.
 *
 * Where the decoder gives luma, that is read; where it gives grey as red, green and blue (Firefox), a table goes back.
 */

import { AGAIN, GeometryVideoError } from "./format/errors.js";
import { OF_GREY, OF_LUMA } from "./levels.js";

const LUMA = ["I420", "I420A", "NV12"];
const COLOURS = ["BGRX", "BGRA", "RGBX", "RGBA"];
const TICK = 1000; // microseconds of a picture, for the decoder; so that its rounding changes no number
const QUEUED = 6; // pictures that the decoder has not begun
const TAKEN = 4; // pictures decoded and not yet read: large ones fill the memory

export class GroupDecoder {
  /**
   * @param {import("./track.js").Track} track
   * @param {[number, number]} size of a picture, pixels
   * @param {Uint32Array} samples indices of a picture's samples
   */
  constructor(track, size, samples) {
    this.track = track;
    this.size = size;
    this.samples = samples;
    this.decoder = null;
    this.taking = 0;
    this.taken = Promise.resolve();
    this.buffer = new Uint8Array(0);
    this.layout = "";
    this.offsets = new Uint32Array(samples.length);
  }

  /**
   * @param {import("./track.js").Sample[]} group
   * @param {(picture: number, levels: Uint8Array) => void} give called for each picture, with the levels of `samples`
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
      throw error instanceof GeometryVideoError ? error : cannotDecode(error);
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
      error: (error) => this.fail(cannotDecode(error)),
    });
    try {
      this.decoder.configure({ codec, description });
    } catch (error) {
      throw cannotDecode(error);
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
      if (!LUMA.includes(format) && !COLOURS.includes(format)) {
        throw new GeometryVideoError("unsupported", `this browser gives pictures as ${format}, which the player cannot read`);
      }
      const bytes = picture.allocationSize();
      if (this.buffer.length !== bytes) this.buffer = new Uint8Array(bytes);
      const [plane] = await picture.copyTo(this.buffer);
      this.#arrange(plane, LUMA.includes(format) ? 1 : 4);
      const table = LUMA.includes(format) ? OF_LUMA : OF_GREY;
      const levels = new Uint8Array(this.samples.length);
      for (let i = 0; i < levels.length; i++) levels[i] = table[this.buffer[this.offsets[i]]];
      this.count();
      this.give(Math.round(timestamp / TICK), levels);
    } finally {
      this.taking--;
      picture.close();
    }
  }

  /** Where in the buffer each sample lies. */
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

function cannotDecode(error) {
  return new GeometryVideoError("unsupported", `this browser cannot decode the video: ${error.message || error.name}`);
}
