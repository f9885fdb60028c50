/**
 * The H.264 or JPEG track of an MP4 file: its samples, and what a decoder must know. For `VideoDecoder`, which reads no files.
 *
 * Reads one track whose samples lie in one file, in fragments or not, as gvpipe writes it; a picture's number is its rank by presentation time, so
 * edit lists and offsets of composition times do not matter.
 */

import { crc32 } from "./format/checksum.js";
import { AGAIN, GeometryVideoError } from "./format/errors.js";
import { readFragmentSamples } from "./fragments.js";

const CONTAINERS = ["moov", "trak", "mdia", "minf", "stbl"];
const hex = (byte) => byte.toString(16).padStart(2, "0");
const two = (number) => String(number).padStart(2, "0");
const CODECS = { // by the kind of a sample's description: its box, least bytes, and what WebCodecs calls it
  avc1: { box: "avcC", bytes: 7, isDescribed: true, name: (data) => `avc1.${[...data.subarray(1, 4)].map(hex).join("")}` },
  hvc1: { box: "hvcC", bytes: 23, isDescribed: true, name: nameHevc },
  hev1: { box: "hvcC", bytes: 23, isDescribed: true, name: nameHevc },
  av01: { box: "av1C", bytes: 4, isDescribed: false, name: ([, a, b]) => `av01.${a >> 5}.${two(a & 31)}${b & 128 ? "H" : "M"}.${b & 64 ? (b & 32 ? "12" : "10") : "08"}` },
  vp09: { box: "vpcC", bytes: 8, isDescribed: false, name: ([, , , , profile, level, c]) => `vp09.${two(profile)}.${two(level)}.${two(c >> 4)}` },
};
const VISUAL_ENTRY = 78; // bytes of a visual sample entry before its boxes

/**
 * @typedef {object} Sample one coded picture
 * @property {Uint8Array} data
 * @property {number} picture its number, in the order of presentation
 *
 * @typedef {object} Track
 * @property {string} codec as `VideoDecoder` names it, or "jpeg"
 * @property {Uint8Array} description `AVCDecoderConfigurationRecord`; of JPEG nothing
 * @property {Sample[][]} groups of pictures, which decode alone, in the order of decoding
 *
 * @param {Uint8Array} file a whole MP4 file
 * @param {number} [checksum] `track_crc32` of the header: over `description`, then one byte for each sample, 1 for a key frame
 * @returns {Track}
 * @throws {GeometryVideoError} its tables do not fit each other
 */
export function readTrack(file, checksum) {
  try {
    return parseTrack(new Tables(file), checksum);
  } catch (error) {
    if (error instanceof RangeError || error instanceof TypeError) throw broken("its tables end too early");
    throw error;
  }
}

/** What a decoder is set up with, of the `ftyp` and `moov` boxes alone. @returns {{codec: string, description: Uint8Array}} */
export function readDescription(head) {
  try {
    return new Tables(head).configuration();
  } catch (error) {
    if (error instanceof RangeError || error instanceof TypeError) throw broken("its tables end too early");
    throw error;
  }
}

/**
 * The samples of the one track of a `moov` box whose data is elsewhere.
 *
 * @param {Uint8Array} trak the box of a track @param {number} end of the file that its samples are in
 * @returns {{codec: string, description: Uint8Array, groups: {offset: number, size: number, picture: number}[][]}} groups that decode alone
 * @throws {GeometryVideoError}
 */
export function readSamples(trak, end) {
  try {
    const tables = new Tables(trak, end);
    const { codec, description } = tables.configuration();
    const { sizes, places, times, keys } = tables.samples();
    const numbers = ranks(times);
    const groups = [];
    let [shown, before] = [0, 0]; // pictures of the groups so far, and of those that are looked at
    for (let i = 0; i < sizes.length; i++) {
      // a key frame that a picture of before is shown after, or that one of later is shown before, begins no group of its own
      if (keys.has(i) && numbers[i] === i && shown === i) groups.push([]);
      if (!groups.length) throw broken("it does not start with a key frame");
      groups.at(-1).push({ offset: places[i], size: sizes[i], picture: numbers[i] });
      before = Math.max(before, numbers[i] + 1);
      if (before === i + 1) shown = i + 1;
    }
    return { codec, description, groups };
  } catch (error) {
    if (error instanceof RangeError || error instanceof TypeError) throw broken("its tables end too early");
    throw error;
  }
}

function parseTrack(tables, checksum) {
  const { codec, description } = tables.configuration();
  const { sizes, places, times, keys } = tables.boxes.has("mvex") ? readFragmentSamples(tables.file) : tables.samples();
  const numbers = ranks(times);
  if (checksum !== undefined && checksum !== crc32(Uint8Array.from(sizes, (_, i) => Number(keys.has(i))), crc32(description))) {
    throw broken("the description of its video is damaged");
  }
  const groups = [];
  for (let i = 0; i < sizes.length; i++) {
    if (keys.has(i)) groups.push([]);
    if (!groups.length) throw broken("it does not start with a key frame");
    groups.at(-1).push({ data: tables.file.subarray(places[i], places[i] + sizes[i]), picture: numbers[i] });
  }
  return { codec, description, groups };
}

/** As RFC 6381 and ISO/IEC 14496-15, annex E, name HEVC. */
function nameHevc(data) {
  const view = new DataView(data.buffer, data.byteOffset, data.byteLength);
  const [space, tier, profile] = [["", "A", "B", "C"][data[1] >> 6], data[1] & 32 ? "H" : "L", data[1] & 31];
  let [flags, reversed] = [view.getUint32(2), 0];
  for (let bit = 0; bit < 32; bit++, flags >>>= 1) reversed = ((reversed << 1) | (flags & 1)) >>> 0;
  const constraints = [...data.subarray(6, 12)];
  while (constraints.length && !constraints.at(-1)) constraints.pop();
  return [`hvc1.${space}${profile}`, reversed.toString(16), `${tier}${data[12]}`, ...constraints.map((byte) => byte.toString(16))].join(".");
}

/** Of each time its place among all. */
export function ranks(times) {
  const order = [...times.keys()].sort((a, b) => times[a] - times[b]);
  const result = new Uint32Array(times.length);
  order.forEach((sample, rank) => (result[sample] = rank));
  return result;
}

class Tables {
  /** @param {number} [end] of the file that samples are in, if that is another */
  constructor(file, end = file.length) {
    this.file = file;
    this.end = end;
    this.view = new DataView(file.buffer, file.byteOffset, file.byteLength);
    this.boxes = new Map(); // kind -> [start, end] of its content
    this.#walk(0, file.length);
  }

  #walk(position, end) {
    while (position + 8 <= end) {
      let size = this.view.getUint32(position);
      let start = position + 8;
      if (size === 1) {
        size = this.#u64(start);
        start += 8;
      } else if (size === 0) {
        size = end - position;
      }
      const kind = String.fromCharCode(...this.file.subarray(position + 4, position + 8));
      if (size < start - position || position + size > end) throw broken(`its ${kind} box has an impossible size`);
      if (CONTAINERS.includes(kind)) {
        if (kind === "trak" && this.boxes.has("trak")) throw broken("it has several tracks");
        this.#walk(start, position + size);
      }
      this.boxes.set(kind, [start, position + size]);
      position += size;
    }
  }

  #u64(position) {
    return this.view.getUint32(position) * 2 ** 32 + this.view.getUint32(position + 4);
  }

  /** Where a table's rows begin, and their number, after `skip` bytes; rows of `width` bytes must be there. */
  #rows(kind, width, skip = 4) {
    if (!this.boxes.has(kind)) throw broken(`its ${kind} box is missing`);
    const [start, end] = this.boxes.get(kind);
    const count = this.view.getUint32(start + skip);
    const first = start + skip + 4;
    if (first + count * width > end) throw broken(`its ${kind} box is too short`);
    return { first, count };
  }

  configuration() {
    const { first } = this.#rows("stsd", 8);
    const kind = String.fromCharCode(...this.file.subarray(first + 4, first + 8));
    if (kind === "mp4v") return { codec: "jpeg", description: new Uint8Array(0) }; // each picture says what it is
    const codec = CODECS[kind];
    if (!codec) throw broken(`its video is ${kind}, not H.264`);
    const end = first + this.view.getUint32(first);
    for (let position = first + 8 + VISUAL_ENTRY; position + 8 <= end; ) {
      const size = this.view.getUint32(position);
      if (size < 8 || position + size > end) break;
      if (String.fromCharCode(...this.file.subarray(position + 4, position + 8)) === codec.box && size >= 8 + codec.bytes) {
        const description = this.file.slice(position + 8, position + size);
        return { codec: codec.name(description), description: codec.isDescribed ? description : new Uint8Array(0) };
      }
      position += size;
    }
    throw broken("its decoder's configuration is missing");
  }

  /** What `readFragmentSamples` gives of a video in fragments. */
  samples() {
    const sizes = this.sizes();
    return { sizes, places: this.places(sizes), times: this.times(sizes.length), keys: this.keys(sizes.length) };
  }

  /** Bytes of each sample. */
  sizes() {
    const common = this.view.getUint32((this.boxes.get("stsz") ?? [NaN])[0] + 4);
    const { first, count } = this.#rows("stsz", common ? 0 : 4, 8);
    if (!count || count > this.end) throw broken(`it has ${count} pictures`);
    return Uint32Array.from({ length: count }, (_, i) => common || this.view.getUint32(first + 4 * i));
  }

  /** Where each sample begins. */
  places(sizes) {
    const wide = this.boxes.has("co64");
    const chunks = this.#rows(wide ? "co64" : "stco", wide ? 8 : 4);
    const runs = this.#rows("stsc", 12);
    const places = new Float64Array(sizes.length);
    let [sample, run] = [0, -1];
    for (let chunk = 0; chunk < chunks.count && sample < sizes.length; chunk++) {
      while (run + 1 < runs.count && this.view.getUint32(runs.first + 12 * (run + 1)) <= chunk + 1) run++;
      const inChunk = this.view.getUint32(runs.first + 12 * run + 4);
      let place = wide ? this.#u64(chunks.first + 8 * chunk) : this.view.getUint32(chunks.first + 4 * chunk);
      for (let i = 0; i < inChunk && sample < sizes.length; i++, sample++) {
        places[sample] = place;
        place += sizes[sample];
        if (place > this.end) throw broken("a picture lies outside of it");
      }
    }
    if (sample < sizes.length) throw broken("its pictures have no place");
    return places;
  }

  /** When each sample is shown, in the track's units. */
  times(count) {
    const durations = this.#runs("stts", count);
    const shifts = this.boxes.has("ctts") ? this.#runs("ctts", count) : new Float64Array(count);
    const times = new Float64Array(count);
    let time = 0;
    for (let i = 0; i < count; i++) {
      times[i] = time + shifts[i];
      time += durations[i];
    }
    return times;
  }

  #runs(kind, count) {
    const { first, count: n } = this.#rows(kind, 8);
    const values = new Float64Array(count);
    let sample = 0;
    for (let row = 0; row < n && sample < count; row++) {
      const length = this.view.getUint32(first + 8 * row);
      const value = this.view.getInt32(first + 8 * row + 4);
      const end = Math.min(count, sample + length);
      values.fill(value, sample, end);
      sample = end;
    }
    if (sample < count) throw broken(`its ${kind} box is too short`);
    return values;
  }

  /** Numbers of the samples that decode alone. */
  keys(count) {
    if (!this.boxes.has("stss")) return new Set(Array.from({ length: count }, (_, i) => i));
    const { first, count: n } = this.#rows("stss", 4);
    return new Set(Array.from({ length: n }, (_, i) => this.view.getUint32(first + 4 * i) - 1));
  }
}

function broken(what) {
  return new GeometryVideoError("corrupt", `its video cannot be read: ${what}; ${AGAIN}`);
}
