/** Sections that are deflated JSON. */

import { corrupt } from "../format/errors.js";
import { inflate } from "../format/inflate.js";

const PER_CHARACTER = 32; // bytes of memory, of JSON

/**
 * @param {Uint8Array} data the section @param {import("../format/budget.js").Budget} budget of the file
 * @param {number} limit most bytes that it may inflate to @param {string} name of the section, for messages
 * @returns {Promise<unknown>} @throws {GeometryVideoError} it is not as gvpipe writes it
 */
export async function readJson(data, budget, limit, name) {
  const most = Math.min(limit, Math.floor(budget.left / PER_CHARACTER));
  const text = await inflate(data, most, (what) => corrupt(name, what));
  try {
    return JSON.parse(new TextDecoder("utf-8", { fatal: true }).decode(text));
  } catch {
    throw corrupt(name, "it is not JSON");
  }
}
