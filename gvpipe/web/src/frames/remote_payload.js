/** A payload as a worker has it: sections come from the page when they are needed. */

import { Budget } from "../format/budget.js";
import { AGAIN, GeometryVideoError } from "../format/errors.js";

export class RemotePayload {
  #waiting = new Map(); // name -> what to call with its bytes

  #ask;

  /**
   * @param {{header: object, isWhole: boolean, names: string[], bytes: number}} file whether it is all there, names of its sections, its bytes
   * @param {(name: string) => void} ask for a section
   */
  constructor({ header, isWhole, names, bytes }, ask) {
    this.#ask = ask;
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
      this.#ask(name);
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
