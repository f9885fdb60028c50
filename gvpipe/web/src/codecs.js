/** Files of all codecs that a page plays, behind one interface. */

import { DecodedPictures } from "./decoded_pictures.js";
import { GeometryVideoError, quote } from "./format/errors.js";
import { readableVersion } from "./frames/frame_decoder.js";
import { FrameHost, FrameSource } from "./frames/frame_host.js";
import { CODEC as MCGV } from "./mcgv/header.js";
import { McgvReader } from "./mcgv/reader.js";
import { withPictures } from "./mcgv/trajectory_pictures.js";
import { openPictures } from "./pictures.js";
import { kernelCode } from "./wasm/inflated.js";

const BYTES_PER_VERTEX = 12; // of a frame

/**
 * @typedef {object} Playable
 * @property {Uint32Array} faces (T, 3) flat @property {Int32Array} basePoints (V, 3) flat: equal rows are one point of the surface
 * @property {{min: number[], max: number[]}} bounds of the motion, model units
 * @property {number} vertexCount V @property {number[]} levels vertices of each level of detail
 * @property {() => Promise<DecodedPictures>} openPictures a clock, and what it shows for each distinct frame
 * @property {(frame: number, shown: Uint8Array|Float32Array, positions: Float32Array) => void} rebuild fills positions (V, 3) of a
 *   distinct frame from what the clock shows
 * @property {() => void} close
 *
 * @param {Uint8Array|import("./format/stream_file.js").StreamFile} source the file, or its parts
 * @param {import("./format/payload.js").Payload} payload
 * @param {import("./format/repeated_frames.js").RepeatedFrames} repeated @param {number} level of detail
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
  if (codec !== MCGV) return openFrames(code, payload.header, distinct, repeated, level);
  if (!("transform" in payload.header.settings)) return openMcgv(code, source, payload.header, distinct, repeated, level);
  return openFrames(code, payload.header, withPictures(source, distinct), repeated, level);
}

async function openMcgv(code, source, { fps, vertices, container }, distinct, repeated, level) {
  if (level) throw new GeometryVideoError("unsupported", `level ${level}: there are levels 0..0`);
  const reader = await McgvReader.open(distinct, code);
  const file = source instanceof Uint8Array ? source : null;
  const load = async (first, last) => file ?? Promise.all(reader.sectionsOf(first, last).map((name) => source.load(name)));
  return {
    faces: reader.faces,
    basePoints: reader.basePoints,
    vertexCount: vertices,
    levels: [vertices],
    /** Once pictures are open: of a file in parts, sections come with them. */
    get bounds() {
      return reader.bounds();
    },
    openPictures() {
      if (!reader.samples) return DecodedPictures.without(fps, repeated, reader.zeroLevels, reader.segmentStarts, load);
      if (!file) return DecodedPictures.inParts(source, fps, repeated, reader.pictureSize, reader.samples, load);
      return openPictures(file, fps, repeated, reader.pictureSize, reader.samples, container.track_crc32);
    },
    rebuild: (frame, levels, positions) => reader.rebuild(frame, levels, positions),
    close() {},
  };
}

async function openFrames(code, { fps }, distinct, repeated, level) {
  const host = new FrameHost(distinct, code, level);
  const close = () => {
    host.close();
    distinct.close?.();
  };
  try {
    const { faces, points, levels, bounds } = await host.describe();
    const basePoints = new Int32Array(3 * points.length);
    points.forEach((point, v) => (basePoints[3 * v] = point));
    const frames = Array.from({ length: repeated.distinct }, (_, picture) => [{ picture }]);
    const size = BYTES_PER_VERTEX * points.length;
    return {
      faces,
      basePoints,
      bounds,
      vertexCount: points.length,
      levels,
      openPictures: () => DecodedPictures.of(frames, size, fps, repeated, new FrameSource(host, repeated.distinct)),
      rebuild: (frame, shown, positions) => positions.set(shown),
      close,
    };
  } catch (error) {
    close();
    throw error;
  }
}
