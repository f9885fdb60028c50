/** The payload: named sections with checksums, and a JSON header. Mirrors `gvpipe.container.bitstream`; `docs/format.md`, section 2. */

import {
  BARE_MAGIC,
  BITSTREAM_MAGIC as MAGIC,
  BITSTREAM_MAX_FRAMES as MAX_FRAMES,
  BITSTREAM_MAX_HEADER as MAX_HEADER,
  BITSTREAM_MAX_NAME as MAX_NAME,
  BITSTREAM_MAX_SECTIONS as MAX_SECTIONS,
  BITSTREAM_MAX_VERTICES as MAX_VERTICES,
} from "../constants.js";
import { Budget } from "./budget.js";
import { CONTAINER_VERSION, newerContainer } from "./boxes.js";
import { crc32 } from "./checksum.js";
import { Cursor } from "./cursor.js";
import { AGAIN, GeometryVideoError, corrupt, quote } from "./errors.js";
import { inflate } from "./inflate.js";

const WITH_PICTURES = "mcgv";
const LIMITS = { version: [1, 1 << 16], frames: [1, MAX_FRAMES], vertices: [1, MAX_VERTICES], triangles: [0, 1 << 29] };

/** A geometry video's header and sections, and what reading them may cost. */
export class Payload {
  isWhole = true; // all of the file is here

  /** @param {Map<string, () => Promise<Uint8Array>>} [late] what fetches sections that are not here, by name */
  constructor(header, sections, budget, late = new Map()) {
    this.header = header;
    this.sections = sections;
    this.budget = budget;
    this.late = late;
  }

  /** @returns {Uint8Array} */
  section(name) {
    const data = this.sections.get(name);
    if (!data) throw new GeometryVideoError("corrupt", `section '${name}' is missing; ${AGAIN}`);
    return data;
  }
}

/** @param {import("./boxes.js").Container} container @returns {Promise<Payload>} */
export async function readPayload(container) {
  const sections = container.sections ?? readPayloadSections(container.payload);
  const header = await readHeader(sections);
  if (container.frames) setFrames(header, container.frames);
  container.clips?.forEach((data, number) => sections.set(clipName(header, number), data));
  const { id, video_crc32: checksum } = header.container;
  if (container.id && container.id !== id) {
    throw new GeometryVideoError("corrupt", `its geometry belongs to another file; ${AGAIN}`);
  }
  if (checksum !== (container.videoChecksum ?? checksum)) { // a file in parts has checksums of its own for its fragments
    throw new GeometryVideoError("corrupt", `its video is damaged, or was re-encoded; ${AGAIN}`);
  }
  const budget = new Budget(container.bytes);
  budget.keepMesh(header);
  return new Payload(header, sections, budget, container.late);
}

function readPayloadSections(payload) {
  const cursor = new Cursor(payload, "table");
  return readSections(cursor, readTable(cursor));
}

function readTable(cursor) {
  const start = cursor.take(Math.min(cursor.left, MAGIC.length));
  if (BARE_MAGIC.every((byte, i) => start[i] === byte)) {
    throw new GeometryVideoError("unsupported", "it has the bare layout, of data sets; gvpipe restream makes a file of it that plays");
  }
  if (!MAGIC.every((byte, i) => start[i] === byte)) {
    throw new GeometryVideoError("corrupt", `the payload does not start with gvpipe's magic; ${AGAIN}`);
  }
  const [version, count] = [cursor.u16(), cursor.u16()];
  if (version > CONTAINER_VERSION) throw newerContainer(version);
  if (version < 1 || count < 1 || count > MAX_SECTIONS) throw cursor.corrupt(`version ${version} with ${count} sections`);
  const entries = [];
  for (let i = 0; i < count; i++) {
    const length = cursor.u8();
    if (length < 1 || length > MAX_NAME) throw cursor.corrupt(`a name of ${length} bytes`);
    const name = String.fromCharCode(...cursor.take(length));
    entries.push({ name, length: cursor.u64(), checksum: cursor.u32() });
  }
  const table = cursor.data.subarray(0, cursor.position);
  if (crc32(table) !== cursor.u32()) throw cursor.corrupt("its checksum does not match");
  return entries;
}

function readSections(cursor, entries) {
  const sections = new Map();
  for (const { name, length, checksum } of entries) {
    if (length > cursor.left) {
      throw new GeometryVideoError("truncated", `section '${name}' needs ${length} bytes, ${cursor.left} are there; ${AGAIN}`);
    }
    const data = cursor.take(length);
    if (crc32(data) !== checksum) throw corrupt(name, "its checksum does not match");
    if (sections.has(name)) throw cursor.corrupt(`section '${name}' occurs twice`);
    sections.set(name, data);
  }
  cursor.end();
  return sections;
}

/** Of a file that is not finished. */
function setFrames(header, frames) {
  header.frames = frames;
  checkInteger(header, "frames", ...LIMITS.frames);
  if (header.codec === WITH_PICTURES) throw corrupt("header", "files of its codec do not grow");
}

/** The name of a clip's section, of a file that was written as frames came. @param {object} header @param {number} number */
export function clipName({ container }, number) {
  return `${container.live}.${number}`;
}

/** The header. @param {Map<string, Uint8Array>} sections @throws {GeometryVideoError} it is not as gvpipe writes it */
export async function readHeader(sections) {
  const wrong = (what) => corrupt("header", what);
  if (!sections.has("header")) throw wrong("it is missing");
  const text = await inflate(sections.get("header"), MAX_HEADER, wrong);
  let header;
  try {
    header = JSON.parse(new TextDecoder("utf-8", { fatal: true }).decode(text));
  } catch {
    throw wrong("it is not JSON");
  }
  for (const [key, [low, high]] of Object.entries(LIMITS)) checkInteger(header ?? {}, key, low, high);
  checkNumber(header, "fps", Number.MIN_VALUE, 100_000);
  const { origin = [0, 0, 0] } = header;
  if (!(Array.isArray(origin) && origin.length === 3 && origin.every(Number.isFinite))) throw wrong("its origin is no point");
  if (typeof header.codec !== "string" || !isObject(header.settings) || !isObject(header.container)) {
    throw wrong("it is not as gvpipe writes it");
  }
  return header;
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

function isObject(value) {
  return typeof value === "object" && value !== null && !Array.isArray(value);
}
