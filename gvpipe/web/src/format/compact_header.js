/** The header of small payloads, with lengths of sections in it. Mirrors `gvpipe.container.compact_header`; `docs/format.md`, 1.3. */

import {
  BITSTREAM_MAX_HEADER as MAX_HEADER,
  BITSTREAM_MAX_NAME as MAX_NAME,
  BITSTREAM_MAX_SECTIONS as MAX_SECTIONS,
  COMPACT_HEADER_MAX_LENGTH as MAX_LENGTH,
} from "../constants.js";
import { corrupt } from "./errors.js";
import { checkHeader, checkInteger, isObject } from "./header.js";
import { inflateRaw } from "./inflate.js";

const HEADER = "header";
const NAME = new RegExp(`^[a-z][a-z0-9.]{0,${MAX_NAME - 1}}$`); // a letter first: keys that are numbers would come before others

/**
 * The header, and bytes of each section in order.
 *
 * @param {import("./cursor.js").Cursor} cursor before it @param {number[]} dictionary of its layout
 * @returns {Promise<{header: object, lengths: Map<string, number>}>}
 */
export async function readCompact(cursor, dictionary) {
  const wrong = (what) => corrupt("header", what);
  const header = checkHeader(await inflateRaw(cursor.block(), Uint8Array.from(dictionary), MAX_HEADER, wrong));
  header.container ??= {};
  return { header, lengths: readLengths(header) };
}

function readLengths({ sections }) {
  if (!isObject(sections)) throw corrupt("header", "it does not list its sections");
  const names = Object.keys(sections);
  if (names.length > MAX_SECTIONS || !names.every((name) => NAME.test(name) && name !== HEADER)) {
    throw corrupt("header", "the names of its sections are not a letter and up to 63 of a to z, 0 to 9 and dots");
  }
  return new Map(names.map((name) => [name, checkInteger(sections, name, 0, MAX_LENGTH)]));
}
