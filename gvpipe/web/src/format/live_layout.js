/**
 * The stream layout of a file that is still written: a table of clips in place of the index. Mirrors `gvpipe.container.live_layout`;
 * `docs/format.md`, section 1.4.
 */

import { LIVE_LAYOUT_HEAD_BYTES as HEAD_BYTES, LIVE_LAYOUT_LIVE_UUID as LIVE_UUID, STREAM_LAYOUT_MAX_INDEX as MAX_INDEX } from "../constants.js";
import { crc32 } from "./checksum.js";
import { AGAIN, corrupt, GeometryVideoError } from "./errors.js";
import { readIndex } from "./stream_layout.js";

export const ROW_BYTES = 16; // of the table of clips
const CHECKED = 12; // bytes of a row that its checksum is of

/** Bytes of the box behind the room for the index. @param {Uint8Array} data of it, the head at least @throws {GeometryVideoError} */
export function liveSize(data) {
  if (data.length < HEAD_BYTES) throw new GeometryVideoError("truncated", `it ends before its first clip; ${AGAIN}`);
  const size = new DataView(data.buffer, data.byteOffset).getUint32(0);
  const isLive = LIVE_UUID.every((byte, i) => data[8 + i] === byte) && size >= HEAD_BYTES && size <= MAX_INDEX;
  if (!isLive) throw new GeometryVideoError("corrupt", `the table of its clips is missing; ${AGAIN}`);
  return size;
}

/**
 * What the box says.
 *
 * @param {Uint8Array} data the box @param {number} start its place in the file
 * @returns {{entries: object[], first: number, table: number}} places of sections (`readIndex`), where the first clip's box begins, and
 *   where rows do
 * @throws {GeometryVideoError} it is not as gvpipe writes it
 */
export function readLive(data, start) {
  const { entries, size: first } = readIndex(data.subarray(HEAD_BYTES));
  const header = entries.find(({ name }) => name === "header");
  const table = header ? header.offset + header.length : 0;
  const isSound = header?.offset >= start && table <= start + data.length;
  if (!isSound || entries.some(({ offset, length }) => offset < start || offset + length > first)) {
    throw corrupt("index", "it names places outside of the file");
  }
  return { entries, first, table };
}

/**
 * The rows that are written: of clips, and whether the end is.
 *
 * @param {Uint8Array} table @returns {{rows: {length: number, checksum: number, frames: number}[], hasEnded: boolean}}
 */
export function readRows(table) {
  const view = new DataView(table.buffer, table.byteOffset, table.byteLength);
  const rows = [];
  for (let at = 0; at + ROW_BYTES <= table.length; at += ROW_BYTES) {
    if (crc32(table.subarray(at, at + CHECKED)) !== view.getUint32(at + CHECKED, true)) break;
    const [length, checksum, frames] = [0, 4, 8].map((field) => view.getUint32(at + field, true));
    if (frames === 0) return { rows, hasEnded: true };
    rows.push({ length, checksum, frames });
  }
  return { rows, hasEnded: false };
}

/**
 * Places of clips.
 *
 * @param {object[]} rows @param {number} end of what lies before the first of them
 * @returns {{offset: number, length: number, checksum: number}[]}
 */
export function placeClips(rows, end) {
  return rows.map(({ length, checksum }) => {
    const offset = end + HEAD_BYTES;
    end = offset + length;
    return { offset, length, checksum };
  });
}

/**
 * All that is there of a whole file.
 *
 * @param {Uint8Array} file @param {number} start of the box behind the room
 * @returns {{sections: Map<string, Uint8Array>, clips: Uint8Array[], frames: number}} clips have no names yet
 * @throws {GeometryVideoError} a checksum or a place does not hold, or no clip is there yet
 */
export function readUnfinished(file, start) {
  const size = liveSize(file.subarray(start));
  const { entries, first, table } = readLive(file.subarray(start, start + size), start);
  if (start + size > file.length || first > file.length) throw new GeometryVideoError("truncated", `it ends before its first clip; ${AGAIN}`);
  const { rows } = readRows(file.subarray(table, start + size));
  const places = placeClips(rows, first).filter(({ offset, length }) => offset + length <= file.length);
  if (!places.length) throw new GeometryVideoError("truncated", "no clip is in it yet; wait for its writer, and open it again");
  const take = ({ offset, length, checksum }, name) => {
    const data = file.subarray(offset, offset + length);
    if (crc32(data) !== checksum) throw corrupt(name, "its checksum does not match");
    return data;
  };
  return {
    sections: new Map(entries.map((entry) => [entry.name, take(entry, entry.name)])),
    clips: places.map((place, number) => take(place, `clip ${number}`)),
    frames: rows.slice(0, places.length).reduce((sum, row) => sum + row.frames, 0),
  };
}
