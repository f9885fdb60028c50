// Reads geometry videos with the web player's bundle: a file's path on each line of standard input, a line of JSON for each.
//
//     node browser.mjs BUNDLE.js
//
// Node has no video decoder. A stand-in gives grey pictures of the size that the header wants, one for each sample.
import { readFileSync } from "node:fs";
import { createInterface } from "node:readline";
import { pathToFileURL } from "node:url";
import { inflateRawSync, inflateSync } from "node:zlib";
import { PLAIN_DICTIONARY, PLAIN_VERSION } from "../gvpipe/web/src/constants.js";

const MOST_VALUES = 2 ** 22; // coordinates that are read of a file
const UUID = Buffer.from("6a1f0c523d7b4e0e9c5567e4f0a7d1b9", "hex");
const INDEX_UUID = Buffer.from("3c0a7e358f0d4a869b0e1f5b8f1f6f52", "hex"); // of the stream layout
const { process } = globalThis;
let size = [0, 0];

class Picture {
  constructor(timestamp) {
    this.timestamp = timestamp;
    this.format = "I420";
    this.visibleRect = { width: size[0], height: size[1] };
  }
  allocationSize() {
    return (size[0] * size[1] * 3) >> 1;
  }
  async copyTo(buffer) {
    buffer.fill(126);
    return [{ offset: 0, stride: size[0] }];
  }
  close() {}
}

globalThis.EncodedVideoChunk = class {
  constructor({ timestamp }) {
    this.timestamp = timestamp;
  }
};

globalThis.VideoDecoder = class {
  constructor({ output }) {
    Object.assign(this, { output, state: "unconfigured", decodeQueueSize: 0 });
  }
  configure() {
    this.state = "configured";
  }
  decode({ timestamp }) {
    this.output(new Picture(timestamp));
  }
  async flush() {}
  close() {
    this.state = "closed";
  }
};

delete globalThis.process; // Draco's wrapper then takes this for a page
globalThis.window = globalThis;
const { GeometryVideo, GeometryVideoError } = await import(pathToFileURL(process.argv[2]));

function plainHeader(file, start) {
  let [length, at, shift] = [0, start, 0];
  do {
    length |= (file[at] & 127) << shift;
    shift += 7;
  } while (file[at++] > 127);
  return inflateRawSync(file.subarray(at, at + length), { dictionary: Uint8Array.from(PLAIN_DICTIONARY) });
}

function sizeIn(text) {
  const { width, height } = JSON.parse(text).settings;
  return width * height <= 2 ** 24 ? [width, 3 * height] : [16, 16];
}

/** Of a picture, as the header has it; [16, 16] where it has none. */
function pictureSize(file) {
  try {
    const isStream = file.includes(INDEX_UUID);
    const content = file.lastIndexOf(UUID) + UUID.length;
    if (!isStream && file[content] === PLAIN_VERSION) return sizeIn(plainHeader(file, content + 1));
    const at = (isStream ? file.indexOf(INDEX_UUID) : file.lastIndexOf(UUID)) + 28; // behind the magic, the version and the count
    const name = at + 1 + file[at]; // of the first section, the header
    const length = Number(file.readBigUInt64LE(name));
    let start = isStream ? Number(file.readBigUInt64LE(name + 12)) : at + 4;
    if (!isStream) for (let i = file.readUInt16LE(at - 2), row = at; i > 0; i--, row += 1 + file[row] + 12) start += 1 + file[row] + 12;
    return sizeIn(inflateSync(file.subarray(start, start + length)));
  } catch {
    return [16, 16];
  }
}

async function read(path) {
  const file = readFileSync(path);
  size = pictureSize(file);
  const video = await GeometryVideo.load(new Uint8Array(file));
  try {
    const { frameCount } = video;
    let left = MOST_VALUES;
    let shot = -1;
    for (const k of [...Array(frameCount).keys(), frameCount - 1]) {
      if (left < 0 && k < frameCount - 1) continue;
      const positions = await video.frame(k);
      left -= positions.length;
      if (!positions.every(Number.isFinite)) return "positions are not finite";
      if (video.shot === shot) continue;
      shot = video.shot;
      const { vertexCount, indices } = video;
      for (const vertex of indices) if (vertex >= vertexCount) return `triangles refer to vertex ${vertex} of ${vertexCount}`;
    }
    if (![...video.bounds.min, ...video.bounds.max].every(Number.isFinite)) return "bounds are not finite";
    for (const { values } of video.attributes.values()) {
      if (!values.every(Number.isFinite)) return "an attribute is not finite";
    }
    for (const field of video.fields.values()) for (const k of [0, field.frameCount - 1]) await field.frame(k);
    return "";
  } finally {
    video.close();
  }
}

/** The most memory so far, bytes. The system's own count begins with what the parent process had. */
function highest() {
  try {
    return 1024 * Number(/VmHWM:\s+(\d+)/.exec(readFileSync("/proc/self/status", "latin1"))[1]);
  } catch {
    return process.resourceUsage().maxRSS * 1024;
  }
}

for await (const path of createInterface({ input: process.stdin })) {
  const before = { memory: process.memoryUsage().rss, ...process.cpuUsage() };
  let result;
  try {
    const broken = await read(path);
    result = broken ? { kind: "broken", text: broken } : { kind: "accepted", text: "" };
  } catch (error) {
    const refused = error instanceof GeometryVideoError;
    result = refused ? { kind: "refused", text: error.message } : { kind: "crashed", text: `${error}`, stack: `${error?.stack}` };
  }
  const used = process.cpuUsage(before);
  const peak = Math.max(highest(), process.memoryUsage().rss);
  process.stdout.write(`${JSON.stringify({ ...result, seconds: (used.user + used.system) / 1e6, peak, before: before.memory })}\n`);
}
