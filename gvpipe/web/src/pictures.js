/** The pictures of a geometry video, by whichever of a browser's two decoders gives them exactly. */

import { DecodedPictures } from "./decoded_pictures.js";
import { GeometryVideoError } from "./format/errors.js";
import { VideoPictures } from "./video_pictures.js";

/**
 * WebCodecs (of JPEG, the browser's images), or where a browser has none that reads the video (pages of plain http, old browsers), `<video>`.
 *
 * @param {Uint8Array} file @param {number} fps
 * @param {import("./format/repeated_frames.js").RepeatedFrames} repeated which picture each frame shows
 * @param {import("./mcgv/reader.js").Planes} planes
 * @param {{checksum?: number, finish?: import("./decoded_pictures.js").Finish|null}} [options] `checksum` is that of the decoder's configuration
 *   and of which pictures are key frames; older files have none
 * @returns {Promise<DecodedPictures|VideoPictures>} with `current`, `seek`, `play`, `pause` and `close`
 */
export async function openPictures(file, fps, repeated, planes, { checksum, finish = null } = {}) {
  const { size, samples, profile } = planes;
  const hasAnother = profile.codec === "h264" && profile.depth === 8;
  if (typeof VideoDecoder === "function" || !hasAnother) {
    try {
      return await DecodedPictures.open(file, fps, repeated, planes, { checksum, finish });
    } catch (error) {
      if (!hasAnother || !(error instanceof GeometryVideoError) || error.kind !== "unsupported") throw error;
    }
  }
  return VideoPictures.open(file, fps, repeated, size, samples, finish);
}
