/** The payload of a file in parts: sections come from its server when they are asked for. */

import { AGAIN, GeometryVideoError } from "../format/errors.js";

const KEPT_BYTES = 32 * 2 ** 20; // of sections of segments, as they are in the file

export class PartPayload {
  isWhole = false;
  #file;

  /**
   * @param {import("../format/payload.js").Payload} payload of what is here
   * @param {import("../format/stream_file.js").StreamFile} file
   */
  constructor({ header, budget }, file) {
    this.header = header;
    this.budget = budget;
    /** Names of all sections. */
    this.sections = new Set(file.names);
    this.#file = file;
    file.mostKept = KEPT_BYTES;
    file.loadSegment(file.firstSegment).catch(() => {}); // while the mesh is decoded; what goes wrong is told when it is asked for
  }

  /** That the file has so many frames by now. @returns {string[]} names of the sections that have come */
  grow(frames) {
    this.header.frames = frames;
    const names = this.#file.names.filter((name) => !this.sections.has(name));
    for (const name of names) this.sections.add(name);
    return names;
  }

  /** @returns {Promise<Uint8Array>} */
  async section(name) {
    const data = await this.#file.load(name);
    if (!data) throw new GeometryVideoError("corrupt", `section '${name}' is missing; ${AGAIN}`);
    this.budget.grow(this.#file.received);
    return data;
  }
}
