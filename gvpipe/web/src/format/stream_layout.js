/**
 * The stream layout of a file: an index first, which names the place of every section and of every fragment of the video.
 * Mirrors `gvpipe.container.stream_layout`; `docs/format.md`, section 1.2. Parts of a file are `stream_file.js`'s.
 */

import {
  BITSTREAM_MAGIC as MAGIC,
  BITSTREAM_MAX_NAME as MAX_NAME,
  BITSTREAM_MAX_SECTIONS as MAX_SECTIONS,
  BITSTREAM_VERSION as VERSION,
} from "../constants.js";
import { crc32 } from "./checksum.js";
import { withoutCompanions } from "./companions.js";
import { Cursor } from "./cursor.js";
import { AGAIN, corrupt, GeometryVideoError } from "./errors.js";

export const OF_COMPANIONS = /^companion\./; // sections that are read apart
const BOX_HEAD = 8; // bytes of the heads of `mdat` boxes

/**
 * @param {Uint8Array} file the whole of it
 * @param {{start: number, end: number}} box of the index, behind its UUID
 * @returns {{sections: Map<string, Uint8Array>, videoChecksum: number}} CRC-32 over the samples, as in the plain layout
 * @throws {GeometryVideoError} a checksum or a place does not hold
 */
export function readStream(file, box) {
  const { entries, fragments, size, headSize, headChecksum } = readIndex(file.subarray(box.start, box.end));
  if (file.length < size) throw new GeometryVideoError("truncated", `it ends ${size - file.length} bytes early; ${AGAIN}`);
  if (file.length > size) {
    throw new GeometryVideoError("corrupt", `${file.length - size} stray bytes follow its last box; ${AGAIN}`);
  }
  checkHead(file, headSize, headChecksum);
  const sections = new Map();
  for (const { name, offset, length, checksum } of entries) {
    if (OF_COMPANIONS.test(name)) continue; // whose damage is theirs alone
    const data = take(file, offset, length);
    if (crc32(data) !== checksum) throw corrupt(name, "its checksum does not match");
    sections.set(name, data);
  }
  let videoChecksum = 0;
  for (const [number, { offset, moof, mdat, checksum }] of fragments.entries()) {
    const data = take(file, offset, moof + mdat);
    if (crc32(data) !== checksum) {
      throw new GeometryVideoError("corrupt", `fragment ${number} of its video is damaged; ${AGAIN}`);
    }
    videoChecksum = crc32(data.subarray(moof + BOX_HEAD), videoChecksum);
  }
  return { sections, videoChecksum };
}

/** The boxes `ftyp` and `moov`, at the start of a file, without companions. */
export function checkHead(file, size, checksum) {
  const head = withoutCompanions(take(file, 0, size));
  if (crc32(head) !== checksum) {
    throw new GeometryVideoError("corrupt", `the description of its video is damaged; ${AGAIN}`);
  }
  return head;
}

/** What the content of the index's box says. */
export function readIndex(data) {
  const cursor = new Cursor(data, "index");
  const start = cursor.take(Math.min(cursor.left, MAGIC.length));
  const [version, count] = [cursor.u16(), cursor.u16()];
  if (!MAGIC.every((byte, i) => start[i] === byte) || version !== VERSION || count < 1 || count > MAX_SECTIONS) {
    throw cursor.corrupt(`version ${version} with ${count} sections`);
  }
  const entries = [];
  for (let i = 0; i < count; i++) {
    const length = cursor.u8();
    if (length < 1 || length > MAX_NAME) throw cursor.corrupt(`a name of ${length} bytes`);
    const name = String.fromCharCode(...cursor.take(length));
    if (entries.some((entry) => entry.name === name)) throw cursor.corrupt(`section '${name}' occurs twice`);
    entries.push({ name, length: cursor.u64(), checksum: cursor.u32(), offset: cursor.u64() });
  }
  const fragments = [];
  for (let left = cursor.u32(); left > 0; left--) {
    const offset = cursor.u64();
    const [moof, mdat, pictures, checksum] = [cursor.u32(), cursor.u32(), cursor.u32(), cursor.u32()];
    if (pictures < 1 || pictures > mdat) throw cursor.corrupt(`${pictures} pictures in ${mdat} bytes`);
    fragments.push({ offset, moof, mdat, pictures, checksum });
  }
  const [size, headSize, headChecksum] = [cursor.u64(), cursor.u32(), cursor.u32()];
  const packed = cursor.data.subarray(0, cursor.position);
  if (crc32(packed) !== cursor.u32()) throw cursor.corrupt("its checksum does not match");
  return { entries, fragments, size, headSize, headChecksum };
}

function take(file, offset, length) {
  if (!(offset + length <= file.length)) {
    throw new GeometryVideoError("corrupt", `the index names places outside of the file; ${AGAIN}`);
  }
  return file.subarray(offset, offset + length);
}
