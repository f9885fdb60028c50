/**
 * The top-level boxes of an MP4 file: where the payload is, and the tag that tells a stripped file from a foreign one.
 * Mirrors `gvpipe.container.mp4`; `docs/format.md`, section 1. The video itself is the browser's affair.
 */

import {
  BITSTREAM_VERSION as CONTAINER_VERSION,
  MP4_BOX_UUID as UUID,
  MP4_MAX_BOXES as MAX_BOXES,
  PLAIN_VERSION,
  STREAM_LAYOUT_INDEX_UUID as INDEX_UUID,
  STREAM_LAYOUT_MAX_INDEX as MAX_INDEX,
  STREAM_LAYOUT_ROOM_UUID as ROOM_UUID,
  STREAM_LAYOUT_SHOTS_UUID as SHOTS_UUID,
} from "../constants.js";
import { crc32 } from "./checksum.js";
import { AGAIN, GeometryVideoError } from "./errors.js";
import { readUnfinished } from "./live_layout.js";
import { readStream } from "./stream_layout.js";

export { CONTAINER_VERSION };

const TAG = /gvpipe (\d{1,9}) ([0-9a-f]{32})/;

/**
 * @typedef {object} Container
 * @property {Uint8Array} [payload] of the plain layout
 * @property {Map<string, Uint8Array>} [sections] of the stream layout
 * @property {number} bytes of the file
 * @property {string} id the content id of the tag, "" if the file has none
 * @property {Uint8Array[]} [clips] of a file that is not finished, by number @property {number} [frames] in them
 * @property {number} videoChecksum CRC-32 over the samples: gvpipe's files hold nothing else in their first `mdat` box
 *
 * @param {Uint8Array} file a whole MP4 file
 * @returns {Container}
 */
export function readContainer(file) {
  const index = findIndex(file);
  if (index?.isRoom) return { ...readUnfinished(file, index.end), bytes: file.length, id: "" };
  const boxes = listBoxes(file);
  const having = (uuid) => boxes.filter((box) => box.kind === "uuid" && uuid.every((byte, i) => file[box.start + i] === byte));
  const [payloads, indices] = [having(UUID), having(INDEX_UUID)];
  for (const kind of ["moov", "mdat"]) {
    if (!boxes.some((box) => box.kind === kind)) {
      throw new GeometryVideoError("truncated", `its ${kind} box is missing; ${AGAIN}`);
    }
  }
  const moov = boxes.find((box) => box.kind === "moov");
  const tag = readTag(file.subarray(moov.start, moov.end));
  const isStream = indices.length === 1 && boxes[2] === indices[0];
  const latest = isStream ? CONTAINER_VERSION : PLAIN_VERSION;
  if (tag && Number(tag[1]) > latest) throw newerContainer(tag[1], latest);
  if (isStream) {
    const box = { start: indices[0].start + INDEX_UUID.length, end: indices[0].end };
    return { ...readStream(file, box), bytes: file.length, id: tag ? tag[2] : "" };
  }
  if (payloads.length === 0) {
    if (tag) throw new GeometryVideoError("stripped", `its geometry was stripped, as remuxing or re-encoding does; ${AGAIN}`);
    throw new GeometryVideoError("not-geometry-video", "an MP4 file, but not one that gvpipe wrote");
  }
  if (payloads.length > 1) throw new GeometryVideoError("corrupt", `it holds two geometries; ${AGAIN}`);
  const { start, end } = boxes.find((box) => box.kind === "mdat"); // those behind it are companions'
  const videoChecksum = crc32(file.subarray(start, end));
  const payload = file.subarray(payloads[0].start + 16, payloads[0].end);
  return { payload, bytes: file.length, id: tag ? tag[2] : "", videoChecksum };
}

/** gvpipe's tag in a `moov` box: itself, its container version, its content id; null without one. */
export function readTag(moov) {
  return TAG.exec(new TextDecoder("latin1").decode(moov));
}

/**
 * The content of the index, or of the room for it, of a file of which the start is here; null if it has none in front.
 *
 * @param {Uint8Array} start of the file, not just of the index @returns {{start: number, end: number, isRoom: boolean, isOfShots: boolean}|null}
 */
export function findIndex(start) {
  const view = new DataView(start.buffer, start.byteOffset, start.byteLength);
  let position = 0;
  for (const wanted of ["ftyp", "moov", "uuid"]) {
    if (position + 8 + INDEX_UUID.length > start.length) return null;
    const size = view.getUint32(position);
    const kind = String.fromCharCode(...start.subarray(position + 4, position + 8));
    if (kind !== wanted || size < 8) return null;
    const isOf = (uuid) => uuid.every((byte, i) => start[position + 8 + i] === byte);
    const [isRoom, isOfShots] = [isOf(ROOM_UUID), isOf(SHOTS_UUID)];
    if (kind === "uuid" && (isRoom || isOfShots || isOf(INDEX_UUID)) && size <= MAX_INDEX) {
      return { start: position + 8 + INDEX_UUID.length, end: position + size, isRoom, isOfShots };
    }
    position += size;
  }
  return null;
}

/** Where the head of the box behind `ftyp` and `moov` ends, of a file of which the start is here; 0 if it does not begin with these. */
export function endOfHead(start) {
  const view = new DataView(start.buffer, start.byteOffset, start.byteLength);
  let position = 0;
  for (const wanted of ["ftyp", "moov"]) {
    if (position + 8 > start.length || String.fromCharCode(...start.subarray(position + 4, position + 8)) !== wanted) return 0;
    position += view.getUint32(position);
  }
  return position + 8 + INDEX_UUID.length;
}

/** The error for a container that is not read here. @param {number|string} version @param {number} [latest] of its layout, that is read */
export function newerContainer(version, latest = CONTAINER_VERSION) {
  return new GeometryVideoError(
    "newer",
    `container version ${version}, this player reads up to ${latest}; a newer player is needed`,
  );
}

function listBoxes(file) {
  const view = new DataView(file.buffer, file.byteOffset, file.byteLength);
  const kindAt = (at) => String.fromCharCode(...file.subarray(at, at + 4));
  if (file.length === 0) throw new GeometryVideoError("truncated", `the file is empty; ${AGAIN}`);
  if (kindAt(4) !== "ftyp") throw new GeometryVideoError("not-geometry-video", "not an MP4 file");
  const boxes = [];
  for (let position = 0; position < file.length; ) {
    if (position + 8 > file.length) {
      throw new GeometryVideoError("truncated", `it ends inside a box header at byte ${position}; ${AGAIN}`);
    }
    let size = view.getUint32(position);
    let start = position + 8;
    const kind = kindAt(position + 4);
    if (size === 1) {
      size = start + 8 <= file.length ? view.getUint32(start) * 2 ** 32 + view.getUint32(start + 4) : Infinity;
      start += 8;
    } else if (size === 0) {
      size = file.length - position;
    }
    const named = /^[0-9A-Za-z]{4}$/.test(kind);
    if (named && position + size > file.length) {
      throw new GeometryVideoError("truncated", `its ${kind} box ends past the file's end; ${AGAIN}`);
    }
    if (!named || position + size < start || boxes.length > MAX_BOXES) {
      throw new GeometryVideoError("corrupt", `the box at byte ${position} has an impossible size of ${size}; ${AGAIN}`);
    }
    boxes.push({ kind, start, end: position + size });
    position += size;
  }
  return boxes;
}
