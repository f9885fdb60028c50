/** The whole of a file as it comes from a web server that knows no Range: parts can be read once they are here. */

import { GeometryVideoError } from "./errors.js";

const LEAST_BYTES = 1 << 16;

export class Incoming {
  #data = new Uint8Array(LEAST_BYTES);
  #ended = null; // "" once all is here, or what went wrong
  #waiting = []; // {end, resolve}
  #body;

  /** Bytes that are here. */
  received = 0;

  /** @param {Response} response @param {string|URL} url for messages */
  constructor(response, url) {
    this.url = url;
    this.#body = response.body.getReader();
    this.#take();
  }

  /**
   * Some bytes, once they are here; fewer where the file ends before.
   *
   * @returns {Promise<Uint8Array>} a copy
   * @throws {GeometryVideoError} the connection is lost
   */
  async read(offset, length) {
    const end = offset + length;
    if (this.received < end && this.#ended === null) await new Promise((resolve) => this.#waiting.push({ end, resolve }));
    if (this.received < end && this.#ended) throw new GeometryVideoError("load", `${this.url} cannot be fetched: ${this.#ended}; try again`);
    return this.#data.slice(offset, Math.min(end, this.received));
  }

  /** All of it. @returns {Promise<Uint8Array>} @throws {GeometryVideoError} the connection is lost */
  whole() {
    return this.read(0, Infinity);
  }

  /** End the connection. */
  close() {
    this.#body.cancel().catch(() => {});
  }

  async #take() {
    try {
      for (;;) {
        const { done, value } = await this.#body.read();
        if (done) break;
        this.#keep(value);
        this.#tell();
      }
      this.#ended = "";
    } catch (error) {
      this.#ended = error.message || error.name;
    }
    this.#tell();
  }

  #keep(bytes) {
    const size = this.received + bytes.length;
    if (size > this.#data.length) {
      const larger = new Uint8Array(Math.max(size, 2 * this.#data.length));
      larger.set(this.#data.subarray(0, this.received));
      this.#data = larger;
    }
    this.#data.set(bytes, this.received);
    this.received = size;
  }

  #tell() {
    const isDue = ({ end }) => end <= this.received || this.#ended !== null;
    const due = this.#waiting.filter(isDue);
    this.#waiting = this.#waiting.filter((each) => !isDue(each));
    for (const { resolve } of due) resolve();
  }
}
