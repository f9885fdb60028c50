/**
 * What a file may cost before it is refused: memory that follows from its size. Mirrors `gvpipe.budget`; `docs/format.md`, section 0.
 * Readers say what they are about to allocate, from counts, before they do. A page has no way to allow more.
 */

import { GeometryVideoError } from "./errors.js";

const LEAST_BYTES = 64 * 2 ** 20;
const BYTES_PER_BYTE = 2000;
const PER_VERTEX = 160; // bytes, of a mesh
const PER_TRIANGLE = 160;

export class Budget {
  #kept = 0;

  /** @param {number} bytes of the file */
  constructor(bytes) {
    this.bytes = bytes;
    this.memory = Math.max(LEAST_BYTES, BYTES_PER_BYTE * bytes);
  }

  /** Bytes that may still be asked for. */
  get left() {
    return this.memory - this.#kept;
  }

  /** @param {string} what @param {number} memory bytes @throws {GeometryVideoError} there is no room for them */
  ask(what, memory) {
    if (memory <= this.left) return;
    const [asked, allowed] = [memory + this.#kept, this.memory].map((n) => `${Math.round(n / 1e6)} MB`);
    throw new GeometryVideoError("unsupported", `${what}: that takes about ${asked}; a file of ${this.bytes} bytes may take ${allowed}`);
  }

  /** As `ask`, for what stays. */
  keep(what, memory) {
    this.ask(what, memory);
    this.#kept += memory;
  }

  /** A mesh, of which a seventh stays. */
  keepMesh({ vertices, triangles }) {
    const what = `a mesh of ${vertices} vertices and ${triangles} triangles`;
    const memory = PER_VERTEX * vertices + PER_TRIANGLE * triangles;
    this.ask(what, memory);
    this.keep(what, memory / 7);
  }
}
