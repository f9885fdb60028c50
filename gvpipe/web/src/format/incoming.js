/** The whole of a file as it comes from a web server that knows no Range: parts can be read once they are here. */

const LEAST_BYTES = 1 << 16;

export class Incoming {
  #data = new Uint8Array(LEAST_BYTES);
  #ended = false;
  #error = null; // what went wrong
  #waiting = []; // {end, resolve}
  #asked;

  /** Bytes that are here. */
  received = 0;

  /** @param {Awaited<ReturnType<typeof import("./request.js").request>>} asked what `request` gave */
  constructor(asked) {
    this.#asked = asked;
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
    if (this.received < end && !this.#ended) await new Promise((resolve) => this.#waiting.push({ end, resolve }));
    if (this.received < end && this.#error) throw this.#error;
    return this.#data.slice(offset, Math.min(end, this.received));
  }

  /** All of it. @returns {Promise<Uint8Array>} @throws {GeometryVideoError} the connection is lost */
  whole() {
    return this.read(0, Infinity);
  }

  /** End the connection. */
  close() {
    this.#asked.close();
  }

  async #take() {
    try {
      for (let bytes = await this.#asked.read(); bytes; bytes = await this.#asked.read()) {
        this.#keep(bytes);
        this.#tell();
      }
    } catch (error) {
      this.#error = error;
    }
    this.#ended = true;
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
    const isDue = ({ end }) => end <= this.received || this.#ended;
    const due = this.#waiting.filter(isDue);
    this.#waiting = this.#waiting.filter((each) => !isDue(each));
    for (const { resolve } of due) resolve();
  }
}
