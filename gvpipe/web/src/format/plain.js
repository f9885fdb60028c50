/** The payload of the plain layout, container version 2. Mirrors `gvpipe.container.plain`; `docs/format.md`, section 2. */

import { PLAIN_DICTIONARY as DICTIONARY, PLAIN_MOST_VERSIONS as MOST_VERSIONS, PLAIN_VERSION as VERSION } from "../constants.js";
import { newerContainer } from "./boxes.js";
import { crc32 } from "./checksum.js";
import { readCompact } from "./compact_header.js";
import { Cursor } from "./cursor.js";
import { AGAIN, GeometryVideoError } from "./errors.js";

const CHECKSUM_BYTES = 4;
const TRACK_BYTES = 8; // checksums of the video's samples and of its description

/**
 * @param {Uint8Array} payload that begins with no magic
 * @returns {Promise<{header: object, sections: Map<string, Uint8Array>}>} `header.container` has the checksums of the video
 * @throws {GeometryVideoError} it is damaged, or of a newer version
 */
export async function readPlain(payload) {
  if (payload.length <= 1 + TRACK_BYTES + CHECKSUM_BYTES) {
    throw new GeometryVideoError("truncated", `the payload ends inside its header; ${AGAIN}`);
  }
  const version = payload[0];
  if (version > VERSION && version < MOST_VERSIONS) throw newerContainer(version, VERSION);
  if (version !== VERSION) throw new GeometryVideoError("corrupt", `the payload starts with no version of gvpipe's container; ${AGAIN}`);
  const content = payload.subarray(0, payload.length - CHECKSUM_BYTES);
  const view = new DataView(payload.buffer, payload.byteOffset, payload.byteLength);
  if (crc32(content) !== view.getUint32(content.length, true)) {
    throw new GeometryVideoError("corrupt", `the checksum of its payload does not match; ${AGAIN}`);
  }
  const cursor = new Cursor(content.subarray(0, content.length - TRACK_BYTES), "header");
  cursor.take(1);
  const { header, lengths } = await readCompact(cursor, DICTIONARY);
  const sections = new Map();
  for (const [name, length] of lengths) sections.set(name, cursor.take(length));
  cursor.end();
  header.container.video_crc32 = view.getUint32(content.length - TRACK_BYTES, true);
  header.container.track_crc32 = view.getUint32(content.length - TRACK_BYTES / 2, true);
  return { header, sections };
}
