/** What decodes the pictures of a track: by its codec, and by the depth of its samples. */

import { AGAIN, GeometryVideoError } from "./format/errors.js";
import { GroupDecoder } from "./group_decoder.js";
import { JpegDecoder } from "./jpeg_decoder.js";

/**
 * @param {{codec: string, description: Uint8Array}} track as `readTrack` gives it
 * @param {import("./mcgv/reader.js").Planes} planes
 * @returns {{decode: (group: object[], give: (picture: number, levels: Uint8Array|Uint16Array) => void) => Promise<void>, close: () => void}}
 * @throws {GeometryVideoError} the track has another codec than the file's profile, or this browser has no decoder for it
 */
export function pictureDecoder(track, { size, samples, profile }) {
  const isJpeg = profile.codec === "mjpeg";
  if (isJpeg !== (track.codec === "jpeg")) throw new GeometryVideoError("corrupt", `its video is ${track.codec}, not of its profile; ${AGAIN}`);
  if (isJpeg) return new JpegDecoder(size, samples);
  if (typeof VideoDecoder !== "function") throw new GeometryVideoError("unsupported", "this page has no WebCodecs: open it by https or from a disk");
  return new GroupDecoder(track, size, samples, profile);
}
