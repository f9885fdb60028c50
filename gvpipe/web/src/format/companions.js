/**
 * Tracks beside the geometry's own, such as a sound: found in a whole file, and taken out of it as a file of one track.
 * Mirrors `gvpipe.container.companion`; `docs/format.md`, section 1.5. A companion that is damaged is left out, with a note.
 */

import { listBoxes } from "../fragments.js";
import { crc32 } from "./checksum.js";
import { joined } from "./request.js";

const HEAD = 8; // bytes of a box before its content
const TO_TABLES = ["mdia", "minf", "stbl"];
const NUMBER = 12; // bytes of a `tkhd` box's content before the track's number
const [OF_TRACK, OF_FILM] = [20, 16]; // bytes of content before the duration in `tkhd` and `mvhd`
const FTYP = new TextEncoder().encode("\0\0\0\x1cftypisom\0\0\x02\0isomiso2mp41");
const CODECS = ["aac", "opus"];

/** What a file's header says of companions: a list. */
export function describedIn({ container }) {
  return Array.isArray(container.companions) ? container.companions : [];
}

/**
 * The boxes `ftyp` and `moov` with the geometry's track alone: others are empty space. The same array where there is no other.
 *
 * @param {Uint8Array} file that begins with them; it may be whole @returns {Uint8Array}
 */
export function withoutCompanions(file) {
  const found = tracksOf(file);
  if (!found || found.tracks.length < 2) return file;
  const { moov, tracks, view } = found;
  const own = file.slice(0, moov.end);
  const blank = ({ start, end }) => {
    own.fill(0, start - HEAD + 4, end);
    own.set([0x66, 0x72, 0x65, 0x65], start - HEAD + 4); // "free"
  };
  tracks.slice(1).forEach(blank);
  const boxes = listBoxes(view, moov.start, moov.end);
  const extended = boxes.find(({ kind }) => kind === "mvex");
  if (extended) {
    const defaults = listBoxes(view, extended.start, extended.end).filter(({ kind }) => kind === "trex");
    defaults.slice(1).forEach(blank);
  }
  const result = new Uint8Array(file.length);
  result.set(file);
  result.set(own);
  return result;
}

/** A file as decoders of its pictures take it: without companions, and as long as its pictures are shown, for `<video>`. */
export function geometryOf(file) {
  const own = withoutCompanions(file);
  if (own === file) return file;
  const { moov, tracks, view } = tracksOf(own);
  const mvhd = listBoxes(view, moov.start, moov.end).find(({ kind }) => kind === "mvhd");
  const tkhd = listBoxes(view, tracks[0].start, tracks[0].end).find(({ kind }) => kind === "tkhd");
  if (mvhd && tkhd) own.copyWithin(mvhd.start + OF_FILM, tkhd.start + OF_TRACK, tkhd.start + OF_TRACK + 4);
  return own;
}

/**
 * What is heard with a file, of what its header says.
 *
 * @returns {{codec: string, channels: number, rate: number, seconds: number, start: number}|null} null: nothing
 */
export function describedSound(header) {
  const { kind, codec, channels, rate, seconds, start } = describedIn(header)[indexOfSound(header)] ?? {};
  const areNumbers = [channels, rate, seconds].every((number) => number > 0) && start >= 0;
  return kind === "sound" && CODECS.includes(codec) && areNumbers ? { codec, channels, rate, seconds, start } : null;
}

/**
 * The sound of a whole file of the plain layout, as a file of one track.
 *
 * @param {Uint8Array} file @param {object} header @returns {Uint8Array|null} null: it is damaged, or gone
 */
export function soundOf(file, header) {
  try {
    return extracted(file, header, indexOfSound(header));
  } catch (error) {
    if (error instanceof RangeError || error instanceof TypeError) return null; // tables that end too early
    throw error;
  }
}

function indexOfSound(header) {
  return describedIn(header).findIndex((each) => each?.kind === "sound");
}

function extracted(file, header, index) {
  const described = describedIn(header);
  const { moov, tracks, view } = tracksOf(file);
  const media = listBoxes(view, 0, file.length).filter(({ kind }) => kind === "mdat");
  if (tracks.length !== 1 + described.length || media.length < described.length) return null;
  const [track, samples] = [tracks[1 + index], media[media.length - described.length + index]];
  const trak = file.slice(track.start - HEAD, track.end);
  move(trak, -samples.start, 1);
  const data = file.subarray(samples.start, samples.end);
  if (crc32(trak) !== described[index].trak_crc32 || crc32(data) !== described[index].crc32) return null;
  const mvhd = listBoxes(view, moov.start, moov.end).find(({ kind }) => kind === "mvhd");
  const film = file.slice(mvhd.start - HEAD, mvhd.end);
  const tkhd = listBoxes(viewOf(trak), HEAD, trak.length).find(({ kind }) => kind === "tkhd");
  film.set(trak.subarray(tkhd.start + OF_TRACK, tkhd.start + OF_TRACK + 4), HEAD + OF_FILM);
  const sizes = [HEAD + film.length + trak.length, HEAD + data.length];
  move(trak, FTYP.length + sizes[0] + HEAD, 1);
  return joined([FTYP, head(sizes[0], "moov"), film, trak, head(sizes[1], "mdat"), data]);
}

/** Add a number of bytes to the places of a track's chunks, and give it a number. */
function move(trak, bytes, number) {
  const view = viewOf(trak);
  let [start, end] = [HEAD, trak.length];
  view.setUint32(listBoxes(view, start, end).find(({ kind }) => kind === "tkhd").start + NUMBER, number);
  for (const wanted of TO_TABLES) ({ start, end } = listBoxes(view, start, end).find(({ kind }) => kind === wanted));
  const table = listBoxes(view, start, end).find(({ kind }) => kind === "stco"); // files that pages hold have no 64-bit places
  const count = view.getUint32(table.start + 4);
  for (let at = table.start + 8; at < table.start + 8 + 4 * count; at += 4) view.setUint32(at, view.getUint32(at) + bytes);
}

/** The box `moov` and the tracks in it, null where there are none. */
function tracksOf(file) {
  const view = viewOf(file);
  const moov = topBoxes(file, view).find(({ kind }) => kind === "moov");
  if (!moov) return null;
  return { view, moov, tracks: listBoxes(view, moov.start, moov.end).filter(({ kind }) => kind === "trak") };
}

/** Boxes up to `moov`: what follows may be cut off. */
function topBoxes(file, view) {
  const boxes = [];
  for (let at = 0; at + HEAD <= file.length; ) {
    const size = view.getUint32(at);
    const kind = String.fromCharCode(...file.subarray(at + 4, at + HEAD));
    if (size < HEAD || at + size > file.length) break;
    boxes.push({ kind, start: at + HEAD, end: at + size });
    if (kind === "moov") break;
    at += size;
  }
  return boxes;
}

function viewOf(data) {
  return new DataView(data.buffer, data.byteOffset, data.byteLength);
}

function head(size, kind) {
  const bytes = new Uint8Array(HEAD);
  viewOf(bytes).setUint32(0, size);
  bytes.set(new TextEncoder().encode(kind), 4);
  return bytes;
}
