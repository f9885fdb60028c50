/** Files of all codecs that a page plays, behind one interface. */

import { DecodedPictures } from "./decoded_pictures.js";
import { GeometryVideoError, quote } from "./format/errors.js";
import { readableVersion } from "./frames/frame_decoder.js";
import { FrameHost, FrameSource } from "./frames/frame_host.js";
import { PartPayload } from "./frames/part_payload.js";
import { CODEC as MCGV } from "./mcgv/header.js";
import { McgvReader } from "./mcgv/reader.js";
import { withPictures } from "./mcgv/trajectory_pictures.js";
import { openPictures } from "./pictures.js";
import { kernelCode } from "./wasm/inflated.js";

const BYTES_PER_VERTEX = 12; // of a frame
const BYTES_PER_FRAME = 160; // that a clock keeps

/**
 * @typedef {object} Playable
 * @property {Uint32Array} faces (T, 3) flat @property {Int32Array} basePoints (V, 3) flat: equal rows are one point of the surface
 * @property {{min: number[], max: number[]}} bounds of the motion, model units, once pictures are open; they may grow
 * @property {number} vertexCount V @property {number[]} levels vertices of each level of detail @property {number} level this one
 * @property {(frame?: number) => Promise<DecodedPictures>} openPictures a clock, and what it shows for each distinct frame
 * @property {(level: number) => Promise<Playable>} at another level, closed with this one
 * @property {(frame: number, shown: Uint8Array|Float32Array, positions: Float32Array) => void} rebuild fills positions (V, 3) of a
 *   distinct frame from what the clock shows
 * @property {(frames: number) => void} [grow] that the file has so many frames by now, before clocks of its `openPictures` are told
 * @property {() => void} close
 *
 * @param {Uint8Array|import("./format/stream_file.js").StreamFile} source the file, or its parts
 * @param {import("./format/payload.js").Payload} payload
 * @param {import("./format/repeated_frames.js").RepeatedFrames} repeated @param {number|"coarsest"} level of detail
 * @returns {Promise<Playable>}
 * @throws {GeometryVideoError} it is damaged, or this player or browser cannot read it
 */
export async function openCodec(source, payload, repeated, level) {
  const { codec, version } = payload.header;
  const newest = readableVersion(codec);
  if (!newest) throw new GeometryVideoError("unsupported", `it was coded by ${quote(codec)}; gvpipe export-html converts it`);
  if (version > newest) {
    const found = `version ${quote(version)} of codec ${codec}`;
    throw new GeometryVideoError("newer", `${found}, this player has ${newest}; a newer player is needed`);
  }
  const code = await kernelCode();
  if (!WebAssembly.validate(code)) {
    throw new GeometryVideoError("unsupported", "this browser has no WebAssembly with SIMD; a newer one is needed");
  }
  const distinct = repeated.distinctPayload(payload);
  if (codec === MCGV && !("transform" in payload.header.settings)) return openMcgv(code, source, payload.header, distinct, repeated, level);
  const isWhole = source instanceof Uint8Array;
  const sections = isWhole ? distinct : new PartPayload(distinct, source);
  return openFrames(code, source, codec === MCGV ? withPictures(source, sections) : sections, repeated, level);
}

async function openMcgv(code, source, { fps, vertices, container }, distinct, repeated, level) {
  checkOnlyLevel(level);
  const reader = await McgvReader.open(distinct, code);
  const file = source instanceof Uint8Array ? source : null;
  const load = async (first, last) => file ?? Promise.all(reader.sectionsOf(first, last).map((name) => source.load(name)));
  const open = () => {
    if (!reader.samples) return DecodedPictures.without(fps, repeated, reader.zeroLevels, reader.segmentStarts, load);
    if (!file) return DecodedPictures.inParts(source, fps, repeated, reader.planes, load);
    return openPictures(file, fps, repeated, reader.planes, container.track_crc32);
  };
  return {
    faces: reader.faces,
    basePoints: reader.basePoints,
    vertexCount: vertices,
    levels: [vertices],
    level: 0,
    bounds: null,
    async openPictures() {
      const pictures = await open();
      try {
        this.bounds ??= reader.bounds(); // of a file in parts, sections come with pictures
      } catch (error) {
        pictures.close();
        throw error;
      }
      return pictures;
    },
    rebuild: (frame, levels, positions) => reader.rebuild(frame, levels, positions),
    async at(other) {
      checkOnlyLevel(other);
      return this;
    },
    close() {},
  };
}

function checkOnlyLevel(level) {
  if (level && level !== "coarsest") throw new GeometryVideoError("unsupported", `level ${level}: there are levels 0..0`);
}

async function openFrames(code, source, payload, repeated, level) {
  const { fps } = payload.header;
  payload.budget.ask(`${repeated.distinct} frames`, BYTES_PER_FRAME * repeated.distinct);
  const host = new FrameHost(payload, code);
  const close = () => {
    host.close();
    payload.close?.();
  };
  const frames = Array.from({ length: repeated.distinct }, (_, picture) => [{ picture }]);
  const grow = (count) => {
    payload.budget.ask(`${count} frames`, BYTES_PER_FRAME * count);
    while (frames.length < count) frames.push([{ picture: frames.length }]);
    host.grow(count);
  };
  const at = async (wanted) => {
    const { level: own, faces, points, levels } = await host.describe(wanted);
    const basePoints = new Int32Array(3 * points.length);
    points.forEach((point, v) => (basePoints[3 * v] = point));
    const size = BYTES_PER_VERTEX * points.length;
    return {
      faces,
      basePoints,
      vertexCount: points.length,
      levels,
      level: own,
      get bounds() {
        return host.bounds;
      },
      get isWaiting() {
        return Boolean(source.isWaiting);
      },
      openPictures: (frame) => DecodedPictures.of(frames, size, fps, repeated, new FrameSource(host, own), frame),
      rebuild: (frame, shown, positions) => positions.set(shown),
      at,
      grow,
      close,
    };
  };
  try {
    return await at(level);
  } catch (error) {
    close();
    throw error;
  }
}
