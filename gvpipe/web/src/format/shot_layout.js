/**
 * The layout of a capture: an index, sections that shots share, and each shot as a whole file. Mirrors `gvpipe.container.shot_layout`;
 * `docs/format.md`, section 1.5.
 */

import {
  BITSTREAM_MAX_FRAMES as MAX_FRAMES,
  BITSTREAM_MAX_VERTICES as MAX_VERTICES,
  SHARED_SECTIONS_MAX_SHARED as MAX_SHARED,
  SHOT_LAYOUT_FARTHEST as FARTHEST,
  SHOT_LAYOUT_MAGIC as MAGIC,
  SHOT_LAYOUT_MAX_BYTES as MAX_BYTES,
  SHOT_LAYOUT_MAX_HEADER as MAX_HEADER,
  SHOT_LAYOUT_MAX_POSTER as MAX_POSTER,
  SHOT_LAYOUT_MAX_SHOTS as MAX_SHOTS,
  STREAM_LAYOUT_DATA_UUID as DATA_UUID,
} from "../constants.js";
import { HASH } from "./bare.js";
import { CONTAINER_VERSION, newerContainer, readTag } from "./boxes.js";
import { crc32 } from "./checksum.js";
import { describedIn } from "./companions.js";
import { Cursor } from "./cursor.js";
import { AGAIN, GeometryVideoError, corrupt, quote } from "./errors.js";
import { checkNumber, isObject, parseJson } from "./header.js";
import { inflate } from "./inflate.js";
import { Blocks, Window } from "./ranges.js";
import { checkHead } from "./stream_layout.js";

const NAME = "index";
const BOX_HEAD = 8; // bytes; 16 of long boxes
const UUID_BYTES = 16;
const LONGEST_BOX = 2 ** 32;
const MOST_COMPANIONS = 4;
const BLANK = { frames: 0, vertices: 0, triangles: 0, bytes: 0 };

/**
 * What the index says.
 *
 * @typedef {object} ShotIndex
 * @property {number} fps of all shots @property {number} size bytes of the file
 * @property {{start: number, frames: number, vertices: number, triangles: number, bytes: number}[]} shots `start`: the first frame
 * @property {{min: number[], max: number[]}|null} box that first frames stay in, relative to the origin of the first shot
 * @property {object[]} companions what it says of tracks beside the video, such as a sound @property {Blocks} source of the file's bytes
 * @property {(number: number) => Window} shot the bytes of a shot's file
 * @property {(hash: string) => Promise<Uint8Array|null>} find a shared section, not checked
 */

/**
 * @param {import("./ranges.js").Ranges|import("./ranges.js").Bytes} source
 * @param {Uint8Array} start of the file, not just of the index @param {{start: number, end: number}} box of the index, behind its UUID
 * @returns {Promise<ShotIndex>}
 * @throws {GeometryVideoError} it is damaged, or something is not where it says
 */
export async function readShots(source, start, box) {
  const data = box.end <= start.length ? start.subarray(0, box.end) : await source.read(0, box.end);
  const { header, size, checksum } = await readHeader(data.subarray(box.start, box.end));
  const fps = checkNumber(header, "fps", Number.MIN_VALUE, 100_000);
  const shots = readColumns(header);
  const shared = readShared(header);
  const headSize = box.start - BOX_HEAD - UUID_BYTES;
  if (size !== headSize) throw corrupt(NAME, "its place is not behind the description of the video");
  const head = checkHead(data, headSize, checksum);
  const tag = readTag(head);
  if (!tag || Number(tag[1]) !== CONTAINER_VERSION || tag[2] !== header.id) {
    throw new GeometryVideoError("corrupt", `its shots belong to another file; ${AGAIN}`);
  }
  let at = box.end;
  const sharedBytes = [...shared.values()].reduce((sum, length) => sum + length, 0);
  if (shared.size) at += BOX_HEAD + UUID_BYTES;
  const sharedAt = at;
  const places = new Map();
  for (const [hash, length] of shared) {
    places.set(hash, [at, length]);
    at += length;
  }
  at += integer(header, "poster", 0, MAX_POSTER);
  const offsets = shots.map(({ bytes }) => {
    const long = bytes + BOX_HEAD + UUID_BYTES >= LONGEST_BOX;
    const offset = at + (long ? 2 * BOX_HEAD : BOX_HEAD) + UUID_BYTES;
    at = offset + bytes;
    return offset;
  });
  const companions = describedIn({ container: header });
  if (companions.length > MOST_COMPANIONS) throw corrupt(NAME, `it has ${companions.length} companions`);
  for (const each of companions) at += BOX_HEAD + integer(each ?? {}, "bytes", 0, MAX_BYTES);
  if (source.size < at) throw new GeometryVideoError("truncated", `it ends ${at - source.size} bytes early; ${AGAIN}`);
  if (source.size > at) throw new GeometryVideoError("corrupt", `${source.size - at} stray bytes follow its last box; ${AGAIN}`);
  const blocks = new Blocks(source, at, start);
  if (shared.size) await checkBox(blocks, sharedAt, DATA_UUID, sharedBytes, "its shared sections are not where the index says");
  const kept = new Map(); // hash -> promise
  const find = async (hash) => {
    if (!places.has(hash)) return null;
    if (!kept.has(hash)) {
      kept.set(hash, blocks.read(...places.get(hash)).then((section) => section.slice()));
      kept.get(hash).catch(() => kept.delete(hash)); // tried again
    }
    return kept.get(hash);
  };
  const shot = (number) => new Window(blocks, offsets[number], shots[number].bytes);
  return { fps, size: at, shots, box: readBox(header), companions, source: blocks, shot, find };
}

/** The header of the index, and what it says of the boxes before. */
async function readHeader(data) {
  if (!MAGIC.every((byte, i) => data[i] === byte)) throw new GeometryVideoError("corrupt", `the index does not start with the magic of shots; ${AGAIN}`);
  const content = data.subarray(0, data.length - 4);
  const cursor = new Cursor(content, NAME);
  cursor.take(MAGIC.length);
  const version = cursor.u16();
  if (version > CONTAINER_VERSION) throw newerContainer(version);
  if (version < 1) throw cursor.corrupt(`version ${version}`);
  if (crc32(content) !== new DataView(data.buffer, data.byteOffset + content.length).getUint32(0, true)) {
    throw cursor.corrupt("its checksum does not match");
  }
  const text = await inflate(cursor.block(), MAX_HEADER, (what) => corrupt(NAME, what));
  const [size, checksum] = [cursor.u32(), cursor.u32()]; // of the boxes before, without companions
  cursor.end();
  const header = parseJson(text, (what) => corrupt(NAME, what));
  if (!isObject(header) || !isObject(header.shots) || !isObject(header.shared)) throw corrupt(NAME, "it is not as gvpipe writes it");
  return { header, size, checksum };
}

function readColumns({ shots: columns }) {
  const count = Array.isArray(columns.frames) ? columns.frames.length : 0;
  if (count < 1 || count > MAX_SHOTS) throw corrupt(NAME, `it has ${count} shots; 1 to ${MAX_SHOTS} are possible`);
  const limits = { frames: [1, MAX_FRAMES], vertices: [1, MAX_VERTICES], triangles: [0, 2 * MAX_VERTICES], bytes: [1, MAX_BYTES] };
  const shots = Array.from({ length: count }, () => ({ start: 0, ...BLANK }));
  for (const [name, [low, high]] of Object.entries(limits)) {
    const column = numbers(columns, name, count, low, high);
    column.forEach((value, i) => (shots[i][name] = value));
  }
  let frames = 0;
  for (const shot of shots) {
    shot.start = frames;
    frames += shot.frames;
  }
  if (frames > MAX_FRAMES) throw corrupt(NAME, `it has ${frames} frames; ${MAX_FRAMES} at most are possible`);
  return shots;
}

/** Bytes of shared sections by hash, in order. */
function readShared({ shared }) {
  const sizes = Object.entries(shared);
  const bytes = sizes.reduce((sum, [hash]) => sum + integer(shared, hash, 0, MAX_SHARED), 0);
  if (sizes.length > MAX_SHOTS || bytes > MAX_SHARED || !sizes.every(([hash]) => HASH.test(hash))) {
    throw corrupt(NAME, "its shared sections are too many, too long, or have no hashes");
  }
  return new Map(sizes);
}

function readBox(header) {
  if (header.box === undefined) return null;
  const given = Array.isArray(header.box) ? header.box : [];
  const isSound = given.length === 6 && given.every((value) => typeof value === "number" && Math.abs(value) <= FARTHEST);
  const [min, max] = [given.slice(0, 3), given.slice(3)];
  if (!isSound || min.some((low, axis) => low > max[axis])) throw corrupt(NAME, `'box' is ${quote(header.box)}`);
  return { min, max };
}

/** A box whose content begins at `at`, which must be of that kind and length. */
async function checkBox(source, at, uuid, length, message) {
  const head = await source.read(at - BOX_HEAD - UUID_BYTES, BOX_HEAD + UUID_BYTES);
  const size = new DataView(head.buffer, head.byteOffset).getUint32(0);
  const isSound = size === length + head.length && String.fromCharCode(...head.subarray(4, 8)) === "uuid";
  if (!isSound || !uuid.every((byte, i) => head[BOX_HEAD + i] === byte)) throw new GeometryVideoError("corrupt", `${message}; ${AGAIN}`);
}

/** Throw unless a list of a header has `count` integers in low..high. */
function numbers(object, key, count, low, high) {
  const values = object[key];
  const isSound = Array.isArray(values) && values.length === count;
  if (!isSound || !values.every((value) => Number.isInteger(value) && value >= low && value <= high)) {
    throw corrupt(NAME, `'${key}' is ${quote(values)}; ${count} integers in ${low}..${high} are needed`);
  }
  return values;
}

function integer(object, key, low, high) {
  return numbers({ [key]: [object[key]] }, key, 1, low, high)[0];
}
