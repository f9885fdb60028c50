/** Files of all codecs that a page plays, behind one interface. */

import { DecodedPictures } from "./decoded_pictures.js";
import { GeometryVideoError, quote } from "./format/errors.js";
import { readableVersion } from "./frames/frame_decoder.js";
import { FrameHost, FrameSource } from "./frames/frame_host.js";
import { PartPayload } from "./frames/part_payload.js";
import { CODEC as MCGV } from "./mcgv/header.js";
import { withPictures } from "./mcgv/trajectory_pictures.js";
import { openPictures } from "./pictures.js";
import { kernelCode } from "./wasm/inflated.js";

const BYTES_PER_VERTEX = 12; // of a frame
const BYTES_PER_FRAME = 160; // that a clock keeps

let canRun = null; // whether the browser runs the kernels, once that was asked

/**
 * @typedef {object} Playable
 * @property {Uint32Array} faces (T, 3) flat @property {Int32Array} basePoints (V, 3) flat: equal rows are one point of the surface
 * @property {{min: number[], max: number[]}} bounds of the motion so far, model units, once pictures are open
 * @property {number} vertexCount V @property {number[]} levels vertices of each level of detail @property {number} level this one
 * @property {(frame?: number) => Promise<DecodedPictures>} openPictures a clock that shows positions (V, 3)
 * @property {(level: number) => Promise<Playable>} at another level, closed with this one
 * @property {(frames: number) => void} grow that the file has so many frames by now, before clocks of its `openPictures` are told
 * @property {() => void} close
 *
 * @param {Uint8Array|import("./format/stream_file.js").StreamFile} source the file, or its parts
 * @param {import("./format/payload.js").Payload} payload
 * @param {import("./format/repeated_frames.js").RepeatedFrames} repeated @param {number|"coarsest"} level of detail @param {AbortSignal} signal closes it
 * @param {{worker?: import("./frames/decoding_worker.js").DecodingWorker, keptBytes?: number}} [shared] of a shot: the worker of all, and
 *   bytes of decoded frames that it may keep
 * @returns {Promise<Playable>}
 * @throws {GeometryVideoError} it is damaged, or this player or browser cannot read it
 */
export async function openCodec(source, payload, repeated, level, signal, shared = {}) {
  const { codec, version } = payload.header;
  const newest = readableVersion(codec);
  if (!newest) throw new GeometryVideoError("unsupported", `it was coded by ${quote(codec)}; gvpipe export-html converts it`);
  if (version > newest) {
    const found = `version ${quote(version)} of codec ${codec}`;
    throw new GeometryVideoError("newer", `${found}, this player has ${newest}; a newer player is needed`);
  }
  const code = await kernelCode();
  canRun ??= WebAssembly.validate(code);
  if (!canRun) {
    throw new GeometryVideoError("unsupported", "this browser has no WebAssembly with SIMD; a newer one is needed");
  }
  const distinct = repeated.distinctPayload(payload);
  const sections = source instanceof Uint8Array ? distinct : new PartPayload(distinct, source);
  const hasTrajectories = codec === MCGV && "transform" in payload.header.settings;
  return openFrames(code, source, hasTrajectories ? withPictures(source, sections) : sections, repeated, { level, signal, ...shared });
}

async function openFrames(code, source, payload, repeated, { level, signal, worker, keptBytes }) {
  const { fps, container } = payload.header;
  const host = new FrameHost(payload, code, worker);
  const close = () => {
    signal.removeEventListener("abort", close);
    host.close();
    payload.close?.();
  };
  signal.addEventListener("abort", close, { once: true });
  const frames = []; // where there are no pictures, for the clock
  const have = (count) => {
    payload.budget.ask(`${count} frames`, BYTES_PER_FRAME * count);
    while (frames.length < count) frames.push([{ picture: frames.length }]);
  };
  const grow = (count) => {
    have(count);
    host.grow(count);
  };
  const openClock = (planes, size, own, frame) => {
    const decoder = new FrameSource(host, own);
    if (!planes) have(repeated.distinct);
    if (!planes) return DecodedPictures.of(frames, size, fps, repeated, decoder, { frame, keptBytes });
    const finish = (picture, levels) => decoder.finish(picture, levels);
    if (source instanceof Uint8Array) return openPictures(source, fps, repeated, planes, { checksum: container.track_crc32, finish });
    return DecodedPictures.inParts(source, fps, repeated, planes, { prepare: (picture) => host.prepare(picture), finish });
  };
  const at = async (wanted) => {
    const { level: own, faces, basePoints, levels, planes } = await host.describe(wanted);
    const vertexCount = basePoints.length / 3;
    return {
      faces,
      basePoints,
      vertexCount,
      levels,
      level: own,
      get bounds() {
        return host.bounds;
      },
      get isWaiting() {
        return Boolean(source.isWaiting);
      },
      openPictures: (frame) => openClock(planes, BYTES_PER_VERTEX * vertexCount, own, frame),
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
