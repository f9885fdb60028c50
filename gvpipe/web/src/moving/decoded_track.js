/**
 * The pictures of a moving texture by WebCodecs. Pictures asked for in a row are decoded in a row, and some ahead; a jump decodes
 * from the last key frame on. Groups of pictures are fetched, and checked, when they are needed.
 */

import { crc32 } from "../format/checksum.js";
import { AGAIN, GeometryVideoError } from "../format/errors.js";
import { closed } from "../format/request.js";
import { KeptPictures } from "./kept_pictures.js";

const TICK = 1000; // microseconds of a picture, for the decoder
const QUEUED = 4; // pictures that the decoder has not begun
const HELD = 8; // pictures that it was given, and has not given back
const SOON = 10; // ms
const BYTES_PER_PIXEL = 4;
const KEPT_GROUPS = 2; // coded ones

export class DecodedTrack {
  #decoder = null;
  #group = -1; // that the decoder is in
  #sample = 0; // of the group, that it is given next
  #pending = new Set(); // pictures that it was given, and has not given back
  #emitted = new Set(); // pictures of the group that it has given back
  #coded = new Map(); // group -> promise of its bytes
  #running = null;
  #canvas = null;
  #context = null;
  #error = null;
  #isClosed = false;
  #changed = () => {}; // ends a wait

  /** Whether this browser decodes a track. @param {{codec: string, description: Uint8Array}} track */
  static async plays({ codec, description }) {
    if (typeof VideoDecoder !== "function") return false;
    const config = { codec, ...(description.length ? { description } : {}) };
    return VideoDecoder.isConfigSupported(config).then(({ supported }) => supported === true, () => false);
  }

  /**
   * @param {ReturnType<import("../track.js").readSamples>} track @param {[number, number]} size of a picture, pixels
   * @param {(offset: number, length: number) => Promise<Uint8Array>} read bytes of the file
   * @param {number[]|null} checksums of the groups
   */
  constructor(track, [width, height], read, checksums) {
    this.track = track;
    this.size = [width, height];
    this.read = read;
    this.checksums = checksums;
    this.groupOf = track.groups.flatMap((group, number) => Array(group.length).fill(number));
    this.kept = new KeptPictures(this.groupOf.length, BYTES_PER_PIXEL * width * height);
  }

  /** A promise that a frame's picture is here. */
  ready(frame) {
    if (this.#isClosed) return Promise.reject(closed());
    this.#error = null;
    this.kept.want(frame);
    const done = this.kept.when(frame);
    this.#running ??= this.#run().finally(() => (this.#running = null));
    return done;
  }

  /** The picture of a frame, for as long as no other is asked for; null if it is not here. @returns {ImageBitmap|null} */
  show(frame) {
    return this.kept.show(frame);
  }

  close() {
    this.#isClosed = true;
    this.kept.close(closed());
    this.#reset();
    this.#changed();
  }

  async #run() {
    try {
      for (let picture = this.kept.next; picture >= 0 && !this.#isClosed; picture = this.kept.next) await this.#decodeTo(picture);
    } catch (error) {
      this.#reset();
      this.kept.fail(error);
    }
  }

  /** Give the decoder what it needs for a picture, and wait for it, as long as it is of use. */
  async #decodeTo(picture) {
    const group = this.groupOf[picture];
    const samples = this.track.groups[group];
    const isAhead = this.#group === group && this.#sample < samples.length && samples.slice(this.#sample).some((each) => each.picture === picture);
    const isInside = this.#group === group && this.#pending.has(picture);
    if (!isAhead && !isInside) this.#open(group);
    const bytes = await this.#bytes(group);
    while (this.kept.isOfUse(picture) && !this.#emitted.has(picture)) { // another may be wanted since
      this.#check();
      if (this.#sample < samples.length) {
        this.#give(samples[this.#sample++], bytes, samples[0]);
        const isBusy = this.#decoder.decodeQueueSize > QUEUED || this.#pending.size > HELD;
        if (isBusy) await this.#change();
      } else if (this.#pending.size) {
        await this.#decoder.flush().catch((error) => this.#fail(error));
        this.#pending.clear();
      } else {
        throw this.#broken(`picture ${picture} is missing`);
      }
    }
  }

  #give({ offset, size, picture }, bytes, first) {
    const start = offset - first.offset;
    const type = picture === first.picture && this.#sample === 1 ? "key" : "delta";
    this.#pending.add(picture);
    this.#decoder.decode(new EncodedVideoChunk({ type, timestamp: TICK * picture, data: bytes.subarray(start, start + size) }));
  }

  #open(group) {
    const isIdle = this.#group >= 0 && !this.#pending.size && this.#sample === this.track.groups[this.#group].length;
    this.#emitted.clear();
    if (isIdle && this.#decoder.state === "configured") {
      [this.#group, this.#sample] = [group, 0];
      return;
    }
    this.#reset();
    const { codec, description } = this.track;
    const decoder = new VideoDecoder({
      output: (frame) => this.#take(frame, decoder),
      error: (error) => this.#decoder === decoder && this.#fail(error),
    });
    this.#decoder = decoder;
    decoder.configure({ codec, ...(description.length ? { description } : {}) });
    [this.#group, this.#sample] = [group, 0];
    this.#error = null;
  }

  #take(frame, decoder) {
    const picture = Math.round(frame.timestamp / TICK);
    if (decoder === this.#decoder) {
      this.#pending.delete(picture);
      this.#emitted.add(picture);
    }
    try {
      const [width, height] = this.size;
      const { visibleRect } = frame;
      const isOf = (found, wanted) => found === wanted || found === wanted + (wanted % 2);
      if (!isOf(visibleRect.width, width) || !isOf(visibleRect.height, height)) {
        throw this.#broken(`it is ${visibleRect.width}x${visibleRect.height} pixels in place of ${width}x${height}`);
      }
      if (!this.#isClosed && this.kept.isOfUse(picture)) {
        this.kept.add(picture, this.#drawn(frame));
      }
    } catch (error) {
      this.#fail(error);
    } finally {
      frame.close();
      this.#changed();
    }
  }

  /** A picture of its own, cut to the texture's size. Firefox uploads none that `createImageBitmap` cuts. */
  #drawn(frame) {
    const [width, height] = this.size;
    this.#canvas ??= new OffscreenCanvas(width, height);
    this.#context ??= this.#canvas.getContext("2d", { alpha: false });
    this.#context.drawImage(frame, 0, 0, width, height, 0, 0, width, height);
    return this.#canvas.transferToImageBitmap();
  }

  /** A group's coded pictures. */
  #bytes(group) {
    const samples = this.track.groups[group];
    if (!this.#coded.has(group)) {
      const start = samples[0].offset;
      const last = samples.at(-1);
      const load = async () => {
        const bytes = await this.read(start, last.offset + last.size - start);
        if (this.checksums && crc32(bytes) !== this.checksums[group]) throw this.#broken(`its group ${group} is damaged`);
        return bytes;
      };
      const loading = load();
      loading.catch(() => this.#coded.delete(group)); // it is tried again
      this.#coded.set(group, loading);
      for (const old of [...this.#coded.keys()].slice(0, -KEPT_GROUPS)) this.#coded.delete(old);
    }
    return this.#coded.get(group);
  }

  #reset() {
    if (this.#decoder && this.#decoder.state !== "closed") this.#decoder.close();
    this.#decoder = null;
    this.#group = -1;
    this.#pending.clear();
    this.#emitted.clear();
  }

  #fail(error) {
    this.#error ??= error;
    this.#changed();
  }

  #check() {
    if (this.#isClosed) throw closed();
    const error = this.#error;
    if (error) throw error instanceof GeometryVideoError ? error : this.#broken(error.message || error.name);
  }

  /** That a picture has come, or some time has gone by: some decoders hold many. */
  #change() {
    return new Promise((resolve) => {
      this.#changed = resolve;
      setTimeout(resolve, SOON);
    });
  }

  #broken(what) {
    return new GeometryVideoError("corrupt", `a moving texture cannot be decoded: ${what}; ${AGAIN}`);
  }
}
