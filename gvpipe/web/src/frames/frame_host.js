/**
 * Where frames are decoded: in a worker, so that the page goes on; on the page itself where it may have
 * none (as in Node). The worker asks for sections when it needs them.
 */

import { GeometryVideoError } from "../format/errors.js";
import { closed } from "../format/request.js";
import { DecodingWorker } from "./decoding_worker.js";
import { FrameDecoder } from "./frame_decoder.js";

export class FrameHost {
  #payload;
  #code;
  #worker; // DecodingWorker, null where there is none
  #file; // its number in the worker
  #decoder = null; // in place of a worker
  #jobs = new Map(); // number -> what is not answered yet
  #count = 0;
  #isClosed = false;

  /** `{min, max}`: the box of the motion, of the segments read so far; null: of none. */
  bounds = null;

  /**
   * @param {import("../format/payload.js").Payload} payload of the distinct frames; `section` may return promises
   * @param {Uint8Array} code of kernels
   * @param {DecodingWorker} [worker] that decodes other files, too; else it has one of its own
   */
  constructor(payload, code, worker = new DecodingWorker(code)) {
    this.#payload = payload;
    this.#code = code;
    this.#worker = worker;
    const { header, sections, budget } = payload;
    const open = { header, isWhole: payload.isWhole, names: [...sections.keys()], bytes: budget.bytes };
    this.#file = worker.add({ take: (message) => this.#take(message), lost: () => this.#goOnHere() }, open);
    if (this.#file === null) this.#goOnHere(); // pages may forbid workers
  }

  /** What `FrameDecoder.describe` gives. */
  describe(level) {
    return this.#ask({ method: "describe", given: [level] });
  }

  /** As `FrameDecoder.read`. @returns {Promise<Float32Array>} (stop - start, V, 3), model units */
  async read(...given) {
    const { positions, bounds } = await this.#ask({ method: "read", given });
    this.bounds = bounds;
    return positions;
  }

  /** As `FrameDecoder.prepare`. */
  prepare(frame) {
    this.#ask({ method: "prepare", given: [frame] }).catch(() => {});
  }

  /** That the file has so many frames by now. */
  grow(frames) {
    const names = this.#payload.grow(frames);
    this.#worker?.post(this.#file, { grown: { frames, names } });
  }

  close() {
    this.#isClosed = true;
    this.#worker?.remove(this.#file);
    for (const { reject } of this.#jobs.values()) reject(closed());
    this.#jobs.clear();
  }

  #ask(job) {
    if (this.#isClosed) return Promise.reject(closed());
    if (this.#decoder) return this.#run(job);
    return new Promise((resolve, reject) => {
      const number = this.#count++;
      this.#jobs.set(number, { job, resolve, reject });
      this.#worker.post(this.#file, { number, ...job });
    });
  }

  async #run({ method, given }) {
    const decoder = await this.#decoder;
    return decoder[method](...given);
  }

  #goOnHere() {
    this.#worker = null;
    this.#decoder = FrameDecoder.open(this.#payload, this.#code);
    this.#decoder.catch(() => {}); // reported by what is asked
    for (const { job, resolve, reject } of this.#jobs.values()) this.#run(job).then(resolve, reject);
    this.#jobs.clear();
  }

  /** An answer, or a request for a section. */
  async #take({ number, wanted, result, error }) {
    if (wanted !== undefined) {
      try {
        const data = (await this.#payload.section(wanted)).slice();
        this.#worker?.post(this.#file, { wanted, data, bytes: this.#payload.budget.bytes }, [data.buffer]);
      } catch ({ kind = "load", message }) {
        this.#worker?.post(this.#file, { wanted, error: { kind, message } });
      }
      return;
    }
    const job = this.#jobs.get(number);
    this.#jobs.delete(number);
    if (error) job?.reject(new GeometryVideoError(error.kind, error.message));
    else job?.resolve(result);
  }
}

/** Frames of a level, for the clock. The worker answers in turn; a segment that is not decoded holds up its own frames alone. */
export class FrameSource {
  isConcurrent = true; // frames are asked for at once
  #host;
  #level;
  #before = -2; // the frame asked for last; none yet

  /** @param {FrameHost} host @param {number} level of detail */
  constructor(host, level) {
    this.#host = host;
    this.#level = level;
  }

  /** As `GroupDecoder.decode`, with positions (V, 3) in place of levels: of files without pictures, whose groups are a frame each. */
  async decode([{ picture }], give) {
    give(picture, await this.finish(picture));
  }

  /** Positions (V, 3) of a frame. @param {Uint8Array|Uint16Array|null} [levels] of its picture, where pictures are read */
  finish(picture, levels = null) {
    const isNext = picture === this.#before + 1;
    this.#before = picture;
    return this.#host.read(picture, picture + 1, this.#level, isNext, levels);
  }

  close() {}
}
