/** Static attributes from their bytes, exactly as Python has them. Mirrors `gvpipe.attributes.attribute_coding`. */

import { Cursor } from "../format/cursor.js";
import { numberByFirst } from "./corners.js";
import { decodeSharing } from "./corner_sharing.js";
import { EntryLayout } from "./entry_layout.js";
import { readStorage, restore } from "./storage.js";
import { decodeCodes } from "./value_coding.js";

const WELDED = 1; // layout of a vertex attribute; 0: each vertex has its own value

/**
 * @param {Uint8Array} data one attribute's section
 * @param {import("./surface.js").Surface} surface
 * @param {string} name of the section, for messages
 * @param {string} domain `vertex`, `corner`, `triangle` or `part`
 * @param {Uint32Array[]} references entries of the corner attributes before this one
 * @returns {{values: ArrayLike<number>, components: number, type: string, corners: Uint32Array|null}} values (N, C), and the entries
 *   (3T) of corners
 */
export function decodeAttribute(data, surface, name, domain, references) {
  const cursor = new Cursor(data, name);
  if (domain === "vertex" && cursor.varint(WELDED, "the layout") === WELDED) return decodeWelded(cursor, surface);
  const corners = domain === "corner" ? decodeSharing(new Cursor(cursor.block(), name), surface, references) : null;
  const layout = new EntryLayout(domain, surface, corners);
  const storage = readStorage(cursor, layout.nEntries);
  const codes = decodeCodes(cursor, storage, layout);
  return { values: restore(storage, codes, cursor), components: storage.components, type: storage.type.name, corners };
}

/** An attribute of vertices, of which those at one position with equal values are one entry. */
function decodeWelded(cursor, surface) {
  if (!surface.mayWeld) throw cursor.corrupt("an attribute is welded where vertices cannot be");
  const { faces, nVertices } = surface;
  const welded = surface.welded();
  const corners = decodeSharing(new Cursor(cursor.block(), cursor.name), welded, [numberByFirst(faces, nVertices)]);
  const storage = readStorage(cursor, nVertices);
  const { components } = storage;
  const own = decodeCodes(cursor, storage, new EntryLayout("corner", welded, corners));
  const codes = new Float64Array(nVertices * components);
  for (let c = 0; c < faces.length; c++) {
    for (let i = 0; i < components; i++) codes[faces[c] * components + i] = own[corners[c] * components + i];
  }
  return { values: restore(storage, codes, cursor), components, type: storage.type.name, corners: null };
}
