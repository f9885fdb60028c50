/** A payload as a worker has it: sections come from the page when they are needed. */

import { Budget } from "../format/budget.js";
import { AGAIN, GeometryVideoError } from "../format/errors.js";

export class RemotePayload {
  #waiting = new Map(); // name -> what to call with its bytes

  /** @param {object} header @param {boolean} isWhole the file is all there @param {string[]} names of sections @param {number} bytes of the file */
  constructor(header, isWhole, names, bytes) {
    this.header = header;
    this.isWhole = isWhole;
    this.sections = new Set(names);
    this.budget = new Budget(bytes);
    this.budget.keepMesh(header);
  }

  /** @returns {Promise<Uint8Array>} */
  section(name) {
    if (!this.sections.has(name)) return Promise.reject(new GeometryVideoError("corrupt", `section '${name}' is missing; ${AGAIN}`));
    return new Promise((resolve, reject) => {
      this.#waiting.set(name, [...(this.#waiting.get(name) ?? []), { resolve, reject }]);
      self.postMessage({ wanted: name });
    });
  }

  /** That the file has grown. @param {{frames: number, names: string[]}} grown frames by now, names of the sections that have come */
  grow({ frames, names }) {
    this.header.frames = frames;
    for (const name of names) this.sections.add(name);
  }

  /** What the page answered. */
  take({ wanted, data, bytes, error }) {
    if (bytes) this.budget.grow(bytes);
    for (const { resolve, reject } of this.#waiting.get(wanted) ?? []) {
      if (error) reject(new GeometryVideoError(error.kind, error.message));
      else resolve(data);
    }
    this.#waiting.delete(wanted);
  }
}
