/**
 * Companion tracks of which parts are read: a texture's groups of pictures, when they are needed. Where the file is on a server, no
 * more of it is fetched. `format/companions.js` takes out whole ones.
 */

import { AGAIN, GeometryVideoError } from "./errors.js";

const INSIDE = ["mdia", "minf", "stbl"]; // from a `trak` box down to its tables

/**
 * @typedef {object} Companion a track, of which parts are fetched
 * @property {string} kind "sound" or "texture"
 * @property {object} about what the header says of it
 * @property {Uint8Array} trak its box
 * @property {Uint8Array} mvhd of its film
 * @property {number} start where its samples begin in the file @property {number} length bytes of them
 * @property {(offset: number, length: number) => Promise<Uint8Array>} read bytes of the file
 */

/** The boxes between two places: `{kind, start, content, end}`; ends where they do not fit. */
function boxesIn(data, start, end) {
  const view = new DataView(data.buffer, data.byteOffset, data.byteLength);
  const boxes = [];
  for (let at = start; at + 8 <= end; ) {
    let [size, content] = [view.getUint32(at), at + 8];
    if (size === 1 && at + 16 <= end) [size, content] = [view.getUint32(at + 8) * 2 ** 32 + view.getUint32(at + 12), at + 16];
    else if (size === 0) size = end - at;
    if (size < content - at || at + size > end) break;
    boxes.push({ kind: String.fromCharCode(...data.subarray(at + 4, at + 8)), start: at, content, end: at + size });
    at += size;
  }
  return boxes;
}

/**
 * The companions that a file's header describes; those that are not there are left out.
 *
 * @param {object[]} described `container.companions` of the header
 * @param {Uint8Array} head the file's start, with its `moov` box
 * @param {(number: number) => {offset: number, length: number}|undefined} placeOf where the samples of a companion are
 * @param {(offset: number, length: number) => Promise<Uint8Array>} read
 * @returns {Companion[]}
 */
export function readCompanions(described, head, placeOf, read) {
  if (!described.length) return [];
  const moov = boxesIn(head, 0, head.length).find(({ kind }) => kind === "moov");
  const inner = moov ? boxesIn(head, moov.content, moov.end) : [];
  const traks = inner.filter(({ kind }) => kind === "trak").slice(-described.length);
  const mvhd = inner.find(({ kind }) => kind === "mvhd");
  if (traks.length !== described.length || !mvhd) return [];
  return described.flatMap((about, number) => {
    const place = placeOf(number);
    if (!place || about?.bytes !== place.length) return [];
    const { start, end } = traks[number];
    const trak = head.slice(start, end);
    return [{ kind: about.kind, about, trak, mvhd: head.slice(mvhd.start, mvhd.end), start: place.offset, length: place.length, read }];
  });
}

/** Where the samples of companions are in a whole file of the plain layout: in its last `mdat` boxes. */
export function placesInFile(file, count) {
  const data = boxesIn(file, 0, file.length).filter(({ kind }) => kind === "mdat").slice(-count);
  return (number) => data[number] && { offset: data[number].content, length: data[number].end - data[number].content };
}

/** An MP4 file of a companion alone. @param {Companion} companion @returns {Promise<Uint8Array>} @throws {GeometryVideoError} */
export async function fileOf({ trak, mvhd, start, length, read }) {
  const ftyp = Uint8Array.of(0, 0, 0, 20, ...ascii("ftypisom"), 0, 0, 2, 0, ...ascii("isom"));
  const moovSize = 8 + mvhd.length + trak.length;
  const dataStart = ftyp.length + moovSize + 8;
  const file = new Uint8Array(dataStart + length);
  const view = new DataView(file.buffer);
  file.set(ftyp);
  box(view, ftyp.length, moovSize, "moov");
  file.set(mvhd, ftyp.length + 8);
  file.set(shifted(trak, dataStart - start), ftyp.length + 8 + mvhd.length);
  box(view, dataStart - 8, 8 + length, "mdat");
  file.set(await read(start, length), dataStart);
  return file;
}

/** A `trak` box whose chunks lie so many bytes further back. */
function shifted(trak, by) {
  const result = trak.slice();
  const view = new DataView(result.buffer);
  let inside = boxesIn(trak, 8, trak.length);
  for (const kind of INSIDE) {
    const found = inside.find((each) => each.kind === kind);
    if (!found) throw new GeometryVideoError("corrupt", `a track of its video has no ${kind} box; ${AGAIN}`);
    inside = boxesIn(trak, found.content, found.end);
  }
  for (const { kind, content, end } of inside) {
    const width = { stco: 4, co64: 8 }[kind];
    if (!width) continue;
    const count = view.getUint32(content + 4);
    if (content + 8 + width * count > end) throw new GeometryVideoError("corrupt", `table ${kind} of a track of its video is cut short; ${AGAIN}`);
    for (let at = content + 8; at < content + 8 + width * count; at += width) {
      if (width === 4) view.setUint32(at, view.getUint32(at) + by);
      else view.setBigUint64(at, view.getBigUint64(at) + BigInt(by));
    }
  }
  return result;
}

function box(view, at, size, kind) {
  view.setUint32(at, size);
  ascii(kind).forEach((byte, i) => view.setUint8(at + 4 + i, byte));
}

function ascii(text) {
  return [...text].map((letter) => letter.charCodeAt(0));
}
