/** The JSON header of a payload. Mirrors `gvpipe.container.bitstream`; `docs/format.md`, section 2. */

import {
  BITSTREAM_MAX_FRAMES as MAX_FRAMES,
  BITSTREAM_MAX_HEADER as MAX_HEADER,
  BITSTREAM_MAX_VERTICES as MAX_VERTICES,
} from "../constants.js";
import { AGAIN, GeometryVideoError, corrupt, quote } from "./errors.js";
import { inflate } from "./inflate.js";

const WITH_PICTURES = "mcgv";
const UNLIKE = "it is not as gvpipe writes it";
const LIMITS = { version: [1, 1 << 16], frames: [1, MAX_FRAMES], vertices: [1, MAX_VERTICES], triangles: [0, 1 << 29] };

/** The header. @param {Map<string, Uint8Array>} sections @throws {GeometryVideoError} it is not as gvpipe writes it */
export async function readHeader(sections) {
  const wrong = (what) => corrupt("header", what);
  if (!sections.has("header")) throw wrong("it is missing");
  const header = checkHeader(await inflate(sections.get("header"), MAX_HEADER, wrong));
  if (!header.container) throw wrong(UNLIKE);
  return header;
}

/** The header. @param {Uint8Array} text @throws {GeometryVideoError} it is not as gvpipe writes it; that of the bare layout has no id */
export function checkHeader(text) {
  const wrong = (what) => corrupt("header", what);
  const header = parseJson(text, wrong);
  for (const [key, [low, high]] of Object.entries(LIMITS)) checkInteger(header ?? {}, key, low, high);
  checkNumber(header, "fps", Number.MIN_VALUE, 100_000);
  const { origin = [0, 0, 0] } = header;
  if (!(Array.isArray(origin) && origin.length === 3 && origin.every(Number.isFinite))) throw wrong("its origin is no point");
  if (typeof header.codec !== "string" || !isObject(header.settings) || !isObject(header.container ?? {})) throw wrong(UNLIKE);
  return header;
}

/** What JSON in UTF-8 says. @param {Uint8Array} text @param {(what: string) => Error} wrong makes the error to throw */
export function parseJson(text, wrong) {
  try {
    return JSON.parse(new TextDecoder("utf-8", { fatal: true }).decode(text));
  } catch {
    throw wrong("it is not JSON");
  }
}

/** Throw unless `object[key]` is a number in low..high. */
export function checkNumber(object, key, low, high) {
  const value = object[key];
  if (typeof value !== "number" || !(value >= low && value <= high)) {
    throw new GeometryVideoError("corrupt", `header: '${key}' is ${quote(value)}; a number in ${low}..${high} is needed; ${AGAIN}`);
  }
  return value;
}

/** Throw unless `object[key]` is an integer in low..high. */
export function checkInteger(object, key, low, high) {
  if (!Number.isInteger(checkNumber(object, key, low, high))) {
    throw new GeometryVideoError("corrupt", `header: '${key}' is ${quote(object[key])}; an integer is needed; ${AGAIN}`);
  }
  return object[key];
}

/** Whether a value of JSON is an object. */
export function isObject(value) {
  return typeof value === "object" && value !== null && !Array.isArray(value);
}

/** How many frames there are, of a file that is not finished. */
export function setFrames(header, frames) {
  header.frames = frames;
  checkInteger(header, "frames", ...LIMITS.frames);
  if (header.codec === WITH_PICTURES) throw corrupt("header", "files of its codec do not grow");
}

/** The name of a clip's section, of a file that was written as frames came. @param {object} header @param {number} number */
export function clipName({ container }, number) {
  return `${container.live}.${number}`;
}
