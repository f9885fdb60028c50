/** The head of a field's section: type, components and segments. Mirrors `gvpipe.fields.head`. */

import {
  HEAD_MAX_VALUES as MAX_VALUES,
  HEAD_VERSION as VERSION,
  SEGMENTS_MAX_SEGMENT as MAX_SEGMENT,
  VALUES_MAX_COMPONENTS as MAX_COMPONENTS,
} from "../constants.js";
import { Cursor } from "../format/cursor.js";

/** Of values, as sections number them. */
export const TYPES = ["float32", "int8", "uint8", "int16", "uint16", "int32", "uint32"];

/**
 * @param {Uint8Array} data the section @param {number} frames F @param {number} rows R @param {string} name for messages
 * @returns {{type: string, components: number, bounds: number[], segments: Uint8Array[]}} `bounds`: first frames of segments, and F
 * @throws {GeometryVideoError} it is not as gvpipe writes it
 */
export function readHead(data, frames, rows, name) {
  const cursor = new Cursor(data, name);
  const version = cursor.u8();
  const number = cursor.u8();
  if (version !== VERSION) throw cursor.corrupt(`its version is ${version}`);
  if (number >= TYPES.length) throw cursor.corrupt(`its type is ${number}`);
  const components = cursor.varint(MAX_COMPONENTS, "the number of components");
  const longest = cursor.varint(MAX_SEGMENT, "the longest segment");
  if (!components || !longest) throw cursor.corrupt("it has no components, or empty segments");
  if (longest > 1 && rows * components * Math.min(longest, frames) > MAX_VALUES) {
    throw cursor.corrupt(`its segments have ${longest} frames of ${rows} x ${components} values`);
  }
  const count = Math.ceil(frames / longest);
  const bounds = Array.from({ length: count + 1 }, (_, s) => Math.floor((s * frames) / count));
  const lengths = Array.from({ length: count }, () => cursor.varint(cursor.left, "a length"));
  const segments = lengths.map((length) => cursor.take(length));
  cursor.end();
  return { type: TYPES[number], components, bounds, segments };
}
