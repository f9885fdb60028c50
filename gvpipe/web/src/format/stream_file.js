/**
 * A file in the stream layout on a web server, of which parts are fetched by HTTP Range: the index and what all segments share
 * at first, then sections of segments and fragments of the video when they are asked for. `docs/format.md`, section 1.2.
 */

import { readFragmentSamples } from "../fragments.js";
import { readDescription, ranks } from "../track.js";
import { STREAM_LAYOUT_MAX_INDEX as MAX_INDEX } from "../constants.js";
import { endOfHead, findIndex, readTag } from "./boxes.js";
import { crc32 } from "./checksum.js";
import { readCompanions } from "./companion_parts.js";
import { AGAIN, corrupt, GeometryVideoError } from "./errors.js";
import { liveSize, placeClips, readLive, readRows, ROW_BYTES } from "./live_layout.js";
import { clipName, readHeader } from "./header.js";
import { Ranges } from "./ranges.js";
import { joined, nameOf } from "./request.js";
import { readShots } from "./shot_layout.js";
import { checkHead, OF_COMPANIONS, readIndex } from "./stream_layout.js";

const FIRST = 1 << 16; // bytes of the first request
const OF_SEGMENTS = /^(transforms|trajectories|basis|coefficients|anchors|deltas|clip)\.(\d+)$/;
const OF_PICTURES = /^(transforms|trajectories)\./; // whose fragments need WebCodecs
const OF_FIELDS = /^field\./;
const FIRST_LIVE = 1 << 17; // bytes of the second request, of a file that is still written
const ROWS = 64; // of the table of clips, asked for at once
const LOOK_AGAIN = 500; // ms between looks for a first clip
const LOOKS = 120;

export class StreamFile {
  /**
   * @param {string|URL|import("./range_source.js").RangeSource} url @param {AbortSignal} signal ends its requests
   * @returns {Promise<StreamFile|import("./shot_layout.js").ShotIndex|Uint8Array|null>} the whole file where it has the plain layout, where
   *   nothing belongs to segments, and of pictures where there is no WebCodecs; null where the server refuses a part
   * @throws {GeometryVideoError} it cannot be fetched, or the index is damaged
   */
  static async open(url, signal) {
    const opened = await Ranges.open(url, signal, FIRST);
    if (!opened) return null;
    const { ranges } = opened;
    let { start } = opened;
    if (start.length < FIRST) return start;
    const head = endOfHead(start);
    if (head > start.length && head <= MAX_INDEX && head <= (ranges.size || Infinity)) { // a long sound has long tables
      start = joined([start, await ranges.read(start.length, head - start.length)]);
    }
    const box = findIndex(start);
    if (!box) return ranges.rest(start);
    if (box.isOfShots) return readShots(ranges, start, box);
    if (box.isRoom) return StreamFile.#openLive(ranges, box.end);
    return StreamFile.#openStream(ranges, start, box, () => ranges.rest(start));
  }

  /**
   * A shot of a capture.
   *
   * @param {import("./ranges.js").Window} source of its bytes
   * @returns {Promise<StreamFile|Uint8Array>} as `open` gives it
   */
  static async openShot(source) {
    const start = await source.read(0, Math.min(FIRST, source.size));
    const rest = async () => joined([start, await source.read(start.length, source.size - start.length)]);
    if (start.length === source.size) return start;
    const box = findIndex(start);
    if (box?.isRoom || box?.isOfShots) throw corrupt("index", "a shot is neither of the bare nor of the stream layout");
    return box ? StreamFile.#openStream(source, start, box, rest) : rest();
  }

  static async #openStream(source, start, box, rest) {
    const file = new StreamFile(source);
    file.start = start;
    const more = Math.max(0, box.end - start.length);
    const data = more ? joined([start, await file.#fetch(start.length, more)]) : start;
    return (await file.#begin(data, box)) ? file : rest();
  }

  /** A file that is still written, once a clip is there. @param {number} place behind the room for the index */
  static async #openLive(ranges, place) {
    const { url } = ranges;
    if (!ranges.isPartial) {
      ranges.close();
      throw new GeometryVideoError("load", `${nameOf(url)} is still written, and its server knows no Range; try again when it is finished`);
    }
    const file = new StreamFile(ranges);
    for (let i = 0; i < LOOKS; i++) {
      if (await file.#beginLive(place)) return file;
      await new Promise((resolve) => setTimeout(resolve, LOOK_AGAIN));
    }
    throw new GeometryVideoError("load", `${nameOf(ranges.url)} is still written, and nothing comes; try again`);
  }

  /** @param {import("./ranges.js").Ranges|import("./ranges.js").Window} source of its bytes */
  constructor(source) {
    this.source = source;
    this.start = null; // bytes that came at first, until a segment is here
    this.head = null; // the boxes `ftyp` and `moov`, without companions
    this.wholeHead = null; // with them
    /** Sections that are here, by name. */
    this.sections = new Map();
    this.segments = new Map(); // number -> names of its sections
    this.loading = new Map(); // number -> a promise of its sections
    this.used = []; // numbers of segments that are here, the one asked for last at the end
    /** Bytes of segments that are kept, the latest at least. */
    this.mostKept = Infinity;
    /** Of a file that is still written: `frames` so far, frames of a `clip`, whether it `hasEnded`; else null. */
    this.live = null;
  }

  /** Bytes that have come so far. */
  get received() {
    return this.source.received;
  }

  /** Fetch nothing more. */
  close() {
    this.source.close();
  }

  /** Names of all sections, here or not. */
  get names() {
    return [...this.places.keys()];
  }

  /** Whether a segment is on its way. */
  get isWaiting() {
    return this.loading.size > 0;
  }

  /** What a decoder of its pictures is set up with. @throws {GeometryVideoError} */
  get description() {
    return readDescription(this.head);
  }

  /** The companions that its header describes, of which parts are fetched. @returns {import("./companion_parts.js").Companion[]} */
  companions(described) {
    const read = (offset, length) => this.#fetch(offset, length);
    return this.wholeHead ? readCompanions(described, this.wholeHead, (number) => this.places.get(`companion.${number}`), read) : [];
  }

  /** What `readContainer` gives of a whole file. */
  get container() {
    const late = new Map(this.names.filter((name) => OF_FIELDS.test(name)).map((name) => [name, () => this.#fetchSection(name)]));
    return { sections: this.sections, bytes: this.received, id: this.id, frames: this.live?.frames, late };
  }

  /** Number of the segment that is shown first: of a file that is still written, the latest. */
  get firstSegment() {
    return this.live ? String(this.live.rows.length - 1) : "0";
  }

  /** The frame where that segment begins. */
  get startFrame() {
    return this.live ? this.live.frames - this.live.rows.at(-1).frames : 0;
  }

  /** Whether more may come. */
  get isGrowing() {
    return this.live !== null && !this.live.hasEnded;
  }

  /**
   * Look whether clips have come to a file that is still written.
   *
   * @returns {Promise<boolean>} whether there are more, or the end is there
   * @throws {GeometryVideoError} the table cannot be fetched, or is that of another file
   */
  async poll() {
    const { table, tableEnd, rows } = this.live;
    const start = table + ROW_BYTES * (rows.length - 1); // the last one that is known, by which the file is known again
    const found = readRows(await this.#fetch(start, Math.min(ROW_BYTES * ROWS, tableEnd - start)));
    const [same, before] = [found.rows[0], rows.at(-1)];
    if (!same || ["length", "checksum", "frames"].some((field) => same[field] !== before[field])) {
      throw this.source.isAnother();
    }
    this.#addClips(found.rows.slice(1));
    this.live.hasEnded = found.hasEnded || start + ROW_BYTES >= tableEnd;
    return this.live.hasEnded || found.rows.length > 1;
  }

  async #beginLive(place) {
    this.live = { rows: [] }; // nothing of it comes from a cache
    let data = await this.#fetch(place, FIRST_LIVE, true);
    const fill = async (size) => {
      if (size > data.length) data = joined([data, await this.#fetch(place + data.length, size - data.length)]);
    };
    const size = liveSize(data);
    await fill(size);
    const { entries, first, table } = readLive(data.subarray(0, size), place);
    const { rows, hasEnded } = readRows(data.subarray(table - place, size));
    if (!rows.length) return false;
    await fill(first - place);
    this.head = null;
    this.id = "";
    this.fragments = [];
    this.pictures = 0;
    this.places = new Map(entries.map((entry) => [entry.name, entry]));
    this.#take(entries.map(({ name }) => name), data, place);
    this.header = await readHeader(this.sections);
    this.live = { table, tableEnd: place + size, rows: [], frames: 0, clip: rows[0].frames, hasEnded };
    this.size = first;
    this.#addClips(rows);
    return true;
  }

  /** Have the clips behind those that are known. */
  #addClips(rows) {
    const { live } = this;
    for (const [i, place] of placeClips(rows, this.size).entries()) {
      const [number, name] = [String(live.rows.length), clipName(this.header, live.rows.length)];
      this.places.set(name, place);
      this.segments.set(number, [name]);
      live.rows.push(rows[i]);
      live.frames += rows[i].frames;
      this.size = place.offset + place.length;
    }
  }

  async #begin(data, box) {
    const { entries, fragments, size, headSize, headChecksum } = readIndex(data.subarray(box.start, box.end));
    const names = entries.map(({ name }) => name);
    if (!names.some((name) => OF_SEGMENTS.test(name))) return false;
    if (names.some((name) => OF_PICTURES.test(name)) && typeof VideoDecoder !== "function") return false;
    this.head = checkHead(data, headSize, headChecksum);
    this.wholeHead = data.slice(0, headSize);
    this.id = readTag(this.head)?.[2] ?? "";
    this.size = size;
    this.places = new Map(entries.map((entry) => [entry.name, entry]));
    let first = 0;
    this.fragments = fragments.map((fragment) => ({ ...fragment, first: (first += fragment.pictures) - fragment.pictures }));
    this.pictures = first;
    for (const name of names) {
      const number = OF_SEGMENTS.exec(name)?.[2];
      if (number) this.segments.set(number, [...(this.segments.get(number) ?? []), name]);
    }
    const shared = entries.filter(({ name }) => ![OF_SEGMENTS, OF_FIELDS, OF_COMPANIONS].some((kind) => kind.test(name)));
    const start = Math.min(...shared.map(({ offset }) => offset));
    const end = Math.max(...shared.map(({ offset, length }) => offset + length));
    if (end > size) throw new GeometryVideoError("corrupt", `the index names places outside of the file; ${AGAIN}`);
    const more = Math.max(0, end - data.length);
    this.start = more ? joined([data, await this.#fetch(data.length, more)]) : data;
    this.#take(shared.map(({ name }) => name), this.start.subarray(start, end), start);
    return true;
  }

  /**
   * Have a section here, with the others of its segment, which lie beside it.
   *
   * @returns {Promise<Uint8Array|undefined>} nothing for names that the file has not
   * @throws {GeometryVideoError} it cannot be fetched, or is not the one that the index describes
   */
  async load(name) {
    const number = this.places.has(name) ? OF_SEGMENTS.exec(name)?.[2] : undefined;
    if (number === undefined) return this.sections.get(name);
    if (!this.sections.has(name)) await this.loadSegment(number);
    const data = this.sections.get(name);
    this.used = [...this.used.filter((other) => other !== number), number];
    this.#drop();
    return data;
  }

  /** Have all sections of a segment here. @param {string} number @throws {GeometryVideoError} as `load` */
  loadSegment(number) {
    if (!this.loading.has(number)) this.loading.set(number, this.#fetchSegment(number).finally(() => this.loading.delete(number)));
    return this.loading.get(number);
  }

  async #fetchSegment(number) {
    const names = this.segments.get(number);
    const places = names.map((name) => this.places.get(name));
    const start = Math.min(...places.map(({ offset }) => offset));
    const length = Math.max(...places.map((place) => place.offset + place.length)) - start;
    const areAdjacent = length === places.reduce((sum, place) => sum + place.length, 0);
    if (areAdjacent) this.#take(names, await this.#fetch(start, length), start);
    else await Promise.all(places.map(async (place, i) => this.#take([names[i]], await this.#fetch(place.offset, place.length), place.offset)));
    this.start = null;
  }

  /** A section that is not kept here. */
  async #fetchSection(name) {
    const place = this.places.get(name);
    return checked(name, await this.#fetch(place.offset, place.length), place);
  }

  /** Forget segments that were not asked for lately. */
  #drop() {
    const size = (number) => this.segments.get(number).reduce((sum, name) => sum + this.places.get(name).length, 0);
    let bytes = this.used.reduce((sum, number) => sum + size(number), 0);
    while (bytes > this.mostKept && this.used.length > 1) {
      const oldest = this.used.shift();
      bytes -= size(oldest);
      for (const name of this.segments.get(oldest)) this.sections.delete(name);
    }
  }

  /** The coded pictures of a fragment. @returns {Promise<import("../track.js").Sample[]>} @throws {GeometryVideoError} */
  async samples(number) {
    const { offset, moof, mdat, pictures, checksum, first } = this.fragments[number];
    const data = await this.#fetch(offset, moof + mdat);
    const broken = () => new GeometryVideoError("corrupt", `fragment ${number} of its video is damaged; ${AGAIN}`);
    if (crc32(data) !== checksum) throw broken();
    let found;
    try {
      found = readFragmentSamples(data);
    } catch (error) {
      throw error instanceof RangeError || error instanceof TypeError ? broken() : error;
    }
    const { sizes, places, times, keys } = found;
    if (sizes.length !== pictures || !keys.has(0)) throw broken();
    const order = ranks(times);
    return sizes.map((size, i) => ({ data: data.subarray(places[i], places[i] + size), picture: first + order[i] }));
  }

  /** Keep sections of these names, of bytes that start at an offset of the file. */
  #take(names, bytes, start) {
    for (const name of names) {
      const place = this.places.get(name);
      this.sections.set(name, checked(name, bytes.slice(place.offset - start, place.offset - start + place.length), place));
    }
  }

  /** @param {boolean} [mayEnd] whether the file may end before */
  async #fetch(offset, length, mayEnd = false) {
    if (offset + length <= this.start?.length) return this.start.subarray(offset, offset + length);
    return this.source.read(offset, length, { mayEnd, isFresh: this.live !== null });
  }
}

function checked(name, data, { checksum }) {
  if (crc32(data) !== checksum) throw corrupt(name, "its checksum does not match");
  return data;
}
