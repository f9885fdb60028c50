/** Static attributes from their bytes, exactly as Python has them. Mirrors `gvpipe.attributes.attribute_coding`. */

import { Cursor } from "../format/cursor.js";
import { SerialDecoder } from "../format/serial_decoder.js";
import { decodeSharing } from "./corner_sharing.js";
import { cornerOwners, countEntries, prepareEntries } from "./entry_order.js";
import { countContexts } from "./history.js";
import { CONFORMAL, LinearDecoder, PARALLELOGRAM } from "./linear.js";
import { MEAN, OctahedralDecoder, PLACE, SURFACE, cornerNormals } from "./octahedral.js";
import { DIRECTIONS, FLOATS, TANGENTS, readStorage, restore } from "./storage.js";

const MAX_FLAGS = 3;
const MAX_SHIFT = 32;

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
  const corners = domain === "corner" ? decodeSharing(new Cursor(cursor.block(), name), surface, references) : null;
  const n = countEntries(domain, surface, corners);
  const storage = readStorage(cursor, n);
  const [method, flags, shift] = cursor.take(3);
  if (method > lastMethod(storage, domain, surface) || flags > MAX_FLAGS || shift > MAX_SHIFT) {
    throw cursor.corrupt("an attribute is predicted by an unknown method");
  }
  let codes = new Float64Array(0);
  if (n * storage.components) {
    const coder = new SerialDecoder(cursor.rest(), countContexts(flags), name);
    codes = decodeCodes(coder, storage, { method, flags, shift }, { domain, surface, corners });
    coder.end();
  }
  cursor.end();
  return { values: restore(storage, codes, cursor), components: storage.components, type: storage.type.name, corners };
}

/** Methods are numbered from 0 up; those of geometry come last. */
function lastMethod({ id, components }, domain, { positions }) {
  const hasShape = positions !== null && domain !== "part";
  if (id === DIRECTIONS || id === TANGENTS) return hasShape ? PLACE : MEAN;
  return hasShape && components === 2 && domain !== "triangle" ? CONFORMAL : PARALLELOGRAM;
}

function decodeCodes(coder, storage, how, { domain, surface, corners }) {
  const entries = prepareEntries(domain, surface, corners);
  const { id, n, components } = storage;
  if (id !== DIRECTIONS && id !== TANGENTS) {
    return new LinearDecoder(coder, entries, how, { isFloat: id === FLOATS, components }, surface).decode();
  }
  const { faces, positions } = surface;
  const owners = cornerOwners(domain, surface, corners);
  const { places } = entries;
  let normals = null;
  if (how.method === SURFACE) normals = cornerNormals(faces, positions, (c) => owners[c], places.length);
  if (how.method === PLACE) {
    const nPlaces = places.reduce((most, place) => Math.max(most, place + 1), 0);
    const sums = cornerNormals(faces, positions, (c) => places[owners[c]], nPlaces);
    normals = new Float64Array(3 * places.length);
    places.forEach((place, entry) => normals.set(sums.subarray(3 * place, 3 * place + 3), 3 * entry));
  }
  return new OctahedralDecoder(coder, entries, how, { n, width: components }, normals).decode();
}
