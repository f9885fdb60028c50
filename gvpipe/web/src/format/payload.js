/** The payload of any layout: named sections, and a header. That of version 1 mirrors `gvpipe.container.bitstream`; `docs/format.md`, section 2. */

import { BITSTREAM_MAGIC as MAGIC, BITSTREAM_MAX_NAME as MAX_NAME, BITSTREAM_MAX_SECTIONS as MAX_SECTIONS } from "../constants.js";
import { isBare, readBare } from "./bare.js";
import { Budget } from "./budget.js";
import { CONTAINER_VERSION, newerContainer } from "./boxes.js";
import { crc32 } from "./checksum.js";
import { describedIn } from "./companions.js";
import { Cursor } from "./cursor.js";
import { AGAIN, GeometryVideoError, corrupt } from "./errors.js";
import { clipName, readHeader, setFrames } from "./header.js";
import { readPlain } from "./plain.js";

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

/**
 * @param {import("./boxes.js").Container} container
 * @param {((hash: string) => Promise<Uint8Array|null>)|null} [find] gives sections that a shot shares with others; null: it is none
 * @returns {Promise<Payload>}
 */
export async function readPayload(container, find = null) {
  if (container.payload && isBare(container.payload)) return readBarePayload(container, find);
  if (container.payload && !isFirst(container.payload)) return readPlainPayload(container);
  const sections = container.sections ?? readPayloadSections(container.payload);
  const header = await readHeader(sections);
  if (container.frames) setFrames(header, container.frames);
  container.clips?.forEach((data, number) => sections.set(clipName(header, number), data));
  const { id, video_crc32: checksum } = header.container;
  if (container.id && container.id !== id) {
    throw new GeometryVideoError("corrupt", `its geometry belongs to another file; ${AGAIN}`);
  }
  if (checksum !== (container.videoChecksum ?? checksum)) { // a file in parts has checksums of its own for its fragments
    throw otherVideo();
  }
  const budget = new Budget(container.bytes);
  budget.keepMesh(header);
  return new Payload(header, sections, budget, container.late);
}

async function readPlainPayload({ payload, bytes, videoChecksum }) {
  const { header, sections } = await readPlain(payload);
  if (header.container.video_crc32 !== videoChecksum) throw otherVideo();
  const budget = new Budget(bytes);
  budget.keepMesh(header);
  return new Payload(header, sections, budget);
}

async function readBarePayload({ payload, bytes, videoChecksum }, find) {
  if (!find) throw new GeometryVideoError("unsupported", "it has the bare layout, of data sets; gvpipe restream makes a file of it that plays");
  const { header, sections, sharedBytes } = await readBare(payload, find);
  const { video_crc32: checksum = 0 } = header.container; // of no pictures
  const hasVideo = "video_crc32" in header.container || !describedIn(header).length; // else its samples are companions' alone
  if (hasVideo && checksum !== videoChecksum) throw otherVideo();
  const budget = new Budget(bytes + sharedBytes);
  budget.keepMesh(header);
  return new Payload(header, sections, budget);
}

/** Whether a payload begins with the magic of version 1. @param {Uint8Array} payload */
function isFirst(payload) {
  return MAGIC.every((byte, i) => payload[i] === byte);
}

function otherVideo() {
  return new GeometryVideoError("corrupt", `its video is damaged, or was re-encoded; ${AGAIN}`);
}

function readPayloadSections(payload) {
  const cursor = new Cursor(payload, "table");
  return readSections(cursor, readTable(cursor));
}

function readTable(cursor) {
  cursor.take(MAGIC.length);
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
