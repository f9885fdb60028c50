/** Where bytes of a file come from: a web server, which is asked for parts; a file in memory; or a part of either. */

import { AGAIN, GeometryVideoError } from "./errors.js";
import { Incoming } from "./incoming.js";
import { joined, nameOf, request } from "./request.js";

const PARTIAL = 206;
const UNSATISFIABLE = 416;
const BLOCK = 1 << 16; // bytes that are asked for at least, where small parts follow each other
const MOST_BLOCKS = 4;

/** A file on a web server, in parts by HTTP Range; of one that knows no Range, the whole of it as it comes. */
export class Ranges {
  #incoming;
  #total; // bytes of the whole file, as its server says at first; "": it does not say it
  #waiting = 0; // requests

  /** Bytes that have come so far. */
  received;

  /**
   * @param {string|URL|import("./range_source.js").RangeSource} url @param {AbortSignal} signal ends its requests
   * @param {number} first bytes of the first request
   * @returns {Promise<{ranges: Ranges, start: Uint8Array}|null>} the first bytes; null of an empty file
   * @throws {GeometryVideoError} it cannot be fetched
   */
  static async open(url, signal, first) {
    const asked = await request(url, signal, { init: { headers: { Range: `bytes=0-${first - 1}` } } });
    const { response } = asked;
    if (response.status === UNSATISFIABLE) return null;
    if (!response.ok) throw asked.refused();
    const incoming = response.status === PARTIAL ? null : new Incoming(asked);
    const start = incoming ? await incoming.read(0, first) : await asked.bytes();
    return { ranges: new Ranges(url, signal, start.length, incoming, totalOf(response)), start };
  }

  constructor(url, signal, received, incoming, total) {
    this.url = url;
    this.signal = signal;
    this.received = received;
    this.#incoming = incoming;
    this.#total = total;
  }

  /** Whether the server knows Range. */
  get isPartial() {
    return this.#incoming === null;
  }

  /** Bytes of the whole file; NaN where its server does not say it. */
  get size() {
    return this.#total ? Number(this.#total) : NaN;
  }

  /** Whether a part is on its way. */
  get isWaiting() {
    return this.#waiting > 0;
  }

  /**
   * @param {number} offset @param {number} length
   * @param {{mayEnd?: boolean, isFresh?: boolean}} [options] whether the file may end before; whether no cache may answer
   * @returns {Promise<Uint8Array>}
   * @throws {GeometryVideoError} they cannot be fetched, or the file is another one by now
   */
  async read(offset, length, { mayEnd = false, isFresh = false } = {}) {
    this.#waiting++;
    try {
      return await this.#read(offset, length, mayEnd, isFresh);
    } finally {
      this.#waiting--;
    }
  }

  async #read(offset, length, mayEnd, isFresh) {
    const wanted = `bytes ${offset} to ${offset + length - 1} of ${nameOf(this.url)}`;
    if (this.#incoming) {
      const data = await this.#incoming.read(offset, length);
      checkLength(data, length, wanted);
      this.received = this.#incoming.received;
      return data;
    }
    const init = { cache: isFresh ? "no-store" : "default", headers: { Range: `bytes=${offset}-${offset + length - 1}` } };
    const asked = await request(this.url, this.signal, { what: wanted, init, most: length });
    const { response } = asked;
    if (response.status !== PARTIAL) throw asked.refused(); // 200: the whole file would come
    const data = await asked.bytes();
    const isChanged = this.#total && totalOf(response) && totalOf(response) !== this.#total;
    if (isChanged && !isFresh) throw this.isAnother(); // a file that is still written grows
    if (!mayEnd || data.length > length) checkLength(data, length, wanted);
    this.received += data.length;
    return data;
  }

  /** All of a file whose start is here; null if the server refuses. @param {Uint8Array} start */
  async rest(start) {
    if (this.#incoming) return this.#incoming.whole();
    const asked = await request(this.url, this.signal, { init: { headers: { Range: `bytes=${start.length}-` } } });
    if (asked.response.status === PARTIAL) return joined([start, await asked.bytes()]);
    asked.close();
    return null;
  }

  /** The error of a file that has changed. */
  isAnother() {
    return new GeometryVideoError("corrupt", `${nameOf(this.url)} has another file by now; load the page again`);
  }

  close() {
    this.#incoming?.close();
  }
}

/** A file in memory. */
export class Bytes {
  isWaiting = false;

  /** @param {Uint8Array} data */
  constructor(data) {
    this.data = data;
    this.size = this.received = data.length;
  }

  async read(offset, length) {
    if (offset + length > this.size) throw new GeometryVideoError("truncated", `it ends ${offset + length - this.size} bytes early; ${AGAIN}`);
    return this.data.subarray(offset, offset + length);
  }

  close() {}
}

/** The same file in larger parts, the last of which are kept: what lies beside each other comes by one request. */
export class Blocks {
  #source;
  #blocks; // {start, end, data: a promise}, the one used last at the end

  /** @param {Ranges|Bytes} source @param {number} size bytes of the file @param {Uint8Array} first bytes of it */
  constructor(source, size, first) {
    this.#source = source;
    this.size = size;
    this.#blocks = [{ start: 0, end: first.length, data: Promise.resolve(first) }];
  }

  get isWaiting() {
    return this.#source.isWaiting;
  }

  /** As `Ranges.read`. @returns {Promise<Uint8Array>} not copied */
  async read(offset, length) {
    if (this.#source instanceof Bytes || length >= BLOCK) return this.#source.read(offset, length);
    const block = this.#blocks.find(({ start, end }) => start <= offset && offset + length <= end) ?? this.#ask(offset);
    this.#blocks = [...this.#blocks.filter((other) => other !== block), block].slice(-MOST_BLOCKS);
    const data = await block.data;
    return data.subarray(offset - block.start, offset - block.start + length);
  }

  #ask(start) {
    const end = Math.min(this.size, start + BLOCK);
    const block = { start, end, data: this.#source.read(start, end - start) };
    block.data.catch(() => (this.#blocks = this.#blocks.filter((other) => other !== block))); // the next call tries again
    return block;
  }

  close() {
    this.#source.close();
  }
}

/** A part of a file, as a file. */
export class Window {
  /** Bytes that were read so far, of those that came. */
  received = 0;

  /** @param {Blocks} source @param {number} start @param {number} size */
  constructor(source, start, size) {
    this.source = source;
    this.start = start;
    this.size = size;
  }

  async read(offset, length) {
    if (!(offset + length <= this.size)) throw new GeometryVideoError("corrupt", `an index names places outside of its shot; ${AGAIN}`);
    const data = await this.source.read(this.start + offset, length);
    this.received += data.length;
    return data;
  }

  close() {}
}

function checkLength(data, length, wanted) {
  if (data.length === length) return;
  throw new GeometryVideoError("load", `${wanted} cannot be fetched: ${data.length} bytes came; load the page again`);
}

/** Bytes of the whole file, of an answer with a part; "" where the server does not say it, or not to other sites. */
function totalOf(response) {
  return /\/(\d+)$/.exec(response.headers.get("Content-Range") ?? "")?.[1] ?? "";
}
