/** The payload of the bare layout: one deflated header, sections one behind the other. Mirrors `gvpipe.container.bare`; `docs/format.md`, 1.3. */

import {
  BARE_DICTIONARY as DICTIONARY,
  BARE_MAGIC as MAGIC,
  BARE_WITH_SHARED as WITH_SHARED,
  SHARED_SECTIONS_MAX_SHARED as MAX_SHARED,
} from "../constants.js";
import { newerContainer } from "./boxes.js";
import { crc32 } from "./checksum.js";
import { readCompact } from "./compact_header.js";
import { Cursor } from "./cursor.js";
import { AGAIN, GeometryVideoError, corrupt } from "./errors.js";
import { isObject } from "./header.js";
import { sha256 } from "./sha256.js";

export const HASH = /^[0-9a-f]{32}$/;
const HASH_DIGITS = 32;

/** Whether a payload has this layout. @param {Uint8Array} payload */
export function isBare(payload) {
  return MAGIC.every((byte, i) => payload[i] === byte);
}

/**
 * @param {Uint8Array} payload
 * @param {((hash: string) => Promise<Uint8Array|null>)|null} find gives shared sections; null: there are none
 * @returns {Promise<{header: object, sections: Map<string, Uint8Array>, sharedBytes: number}>} bytes of the shared sections, each once
 * @throws {GeometryVideoError} it is damaged, or a shared section is not at hand
 */
export async function readBare(payload, find) {
  if (payload.length <= MAGIC.length + 6) throw new GeometryVideoError("truncated", `the payload ends inside its header; ${AGAIN}`);
  const content = payload.subarray(0, payload.length - 4);
  const cursor = new Cursor(payload, "header");
  cursor.take(MAGIC.length);
  const version = cursor.u16();
  if (version > WITH_SHARED) throw newerContainer(version, WITH_SHARED);
  if (version < 1) throw cursor.corrupt(`version ${version}`);
  if (crc32(content) !== new DataView(payload.buffer, payload.byteOffset + content.length).getUint32(0, true)) {
    throw new GeometryVideoError("corrupt", `the checksum of its payload does not match; ${AGAIN}`);
  }
  const inner = new Cursor(content, "header");
  inner.take(cursor.position);
  const { header, lengths } = await readCompact(inner, DICTIONARY);
  const shared = version === WITH_SHARED ? await findShared(header.shared, lengths, find) : new Map();
  const sections = new Map();
  for (const [name, length] of lengths) sections.set(name, shared.get(name) ?? inner.take(length));
  inner.end();
  const sharedBytes = [...new Set(shared.values())].reduce((sum, data) => sum + data.length, 0);
  return { header, sections, sharedBytes };
}

/** The shared sections by name, each checked. Mirrors `gvpipe.container.shared_sections`. */
async function findShared(hashes, lengths, find) {
  if (!isObject(hashes)) throw corrupt("header", "it does not list its shared sections");
  const needed = new Map(); // bytes by hash
  for (const [name, hash] of Object.entries(hashes)) {
    if (!lengths.has(name) || !HASH.test(hash)) throw corrupt(name, "the hash of its shared section is of no section, or no hash");
    needed.set(hash, lengths.get(name));
  }
  const bytes = [...needed.values()].reduce((sum, length) => sum + length, 0);
  if (bytes > MAX_SHARED) throw new GeometryVideoError("corrupt", `its shared sections have ${bytes} bytes, above ${MAX_SHARED}; ${AGAIN}`);
  const found = new Map();
  for (const [name, hash] of Object.entries(hashes)) {
    const data = found.get(hash) ?? (await find?.(hash));
    if (!data) throw new GeometryVideoError("corrupt", `section '${name}' is shared section ${hash}, which is not here; ${AGAIN}`);
    if (data.length !== lengths.get(name) || (!found.has(hash) && sha256(data).slice(0, HASH_DIGITS) !== hash)) {
      throw corrupt(name, `the shared section ${hash} is not the one that the file was packed with`);
    }
    found.set(hash, data);
  }
  return new Map(Object.entries(hashes).map(([name, hash]) => [name, found.get(hash)]));
}
