/**
 * What a file may cost before it is refused: memory and work that follow from its size. Mirrors `gvpipe.foundation.budget`; `docs/format.md`, section 0.
 * Readers say what they are about to allocate, from counts, before they do. A page has no way to allow more.
 */

import { GeometryVideoError } from "./errors.js";

const LEAST_BYTES = 64 * 2 ** 20;
const BYTES_PER_BYTE = 2000;
const LEAST_SECONDS = 2;
const SECONDS_PER_BYTE = 20e-6;
const PER_VERTEX = 160; // bytes, of a mesh
const PER_TRIANGLE = 160;

export class Budget {
  #kept = 0;
  #keptSeconds = 0;

  /** @param {number} bytes of the file */
  constructor(bytes) {
    this.grow(bytes);
  }

  /** That more of the file has come. @param {number} bytes of the file so far */
  grow(bytes) {
    this.bytes = bytes;
    this.memory = Math.max(LEAST_BYTES, BYTES_PER_BYTE * bytes);
    this.seconds = Math.max(LEAST_SECONDS, SECONDS_PER_BYTE * bytes);
  }

  /** Bytes that may still be asked for. */
  get left() {
    return this.memory - this.#kept;
  }

  /** Seconds of work that may still be asked for. */
  get secondsLeft() {
    return Math.max(0, this.seconds - this.#keptSeconds);
  }

  /** Bytes that are kept. */
  get kept() {
    return this.#kept;
  }

  /** Let go of what was kept since; work stays done. @param {number} kept before */
  release(kept) {
    this.#kept = kept;
  }

  /**
   * @param {string} what @param {number} memory bytes @param {number} [seconds] of work
   * @throws {GeometryVideoError} there is no room for them
   */
  ask(what, memory, seconds = 0) {
    if (memory > this.left) this.#refuse(what, [memory + this.#kept, this.memory].map((n) => `${Math.round(n / 1e6)} MB`));
    if (seconds + this.#keptSeconds > this.seconds) this.#refuse(what, [seconds + this.#keptSeconds, this.seconds].map((n) => `${n.toFixed(1)} s`));
  }

  /** As `ask`, for what stays. */
  keep(what, memory, seconds = 0) {
    this.ask(what, memory, seconds);
    this.#kept += memory;
    this.#keptSeconds += seconds;
  }

  /** A mesh, of which a seventh stays. */
  keepMesh({ vertices, triangles }) {
    const what = `a mesh of ${vertices} vertices and ${triangles} triangles`;
    const memory = PER_VERTEX * vertices + PER_TRIANGLE * triangles;
    this.ask(what, memory);
    this.keep(what, memory / 7);
  }

  #refuse(what, [asked, allowed]) {
    throw new GeometryVideoError("unsupported", `${what}: that takes about ${asked}; a file of ${this.bytes} bytes may take ${allowed}`);
  }
}
