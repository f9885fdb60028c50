/** Codes of entries from their bytes. Mirrors `gvpipe.attributes.value_coding`. */

import { SerialDecoder } from "../format/serial_decoder.js";
import { oppositeCorners } from "./corners.js";
import { countContexts } from "./history.js";
import { AFFINE, LinearDecoder, PARALLELOGRAM } from "./linear.js";
import { MEAN, OctahedralDecoder, PLACE, PLACE_CORRECTED, SURFACE, cornerNormals } from "./octahedral.js";
import { DIRECTIONS, FLOATS, TANGENTS } from "./storage.js";

const MAX_FLAGS = 3;
const MAX_SHIFT = 32;

/**
 * @param {import("../format/cursor.js").Cursor} cursor read to its end
 * @param {import("./storage.js").Storage} storage
 * @param {import("./entry_layout.js").EntryLayout} layout
 * @returns {Float64Array} (N, C)
 */
export function decodeCodes(cursor, storage, layout) {
  const [method, flags, shift] = cursor.take(3);
  if (method > lastMethod(storage, layout) || flags > MAX_FLAGS || shift > MAX_SHIFT) {
    throw cursor.corrupt("an attribute is predicted by an unknown method");
  }
  let codes = new Float64Array(0);
  if (layout.nEntries * storage.components) {
    const coder = new SerialDecoder(cursor.rest(), countContexts(flags), cursor.name);
    codes = decodeBy({ method, flags, shift }, coder, storage, layout);
    coder.end();
  }
  cursor.end();
  return codes;
}

/** Methods are numbered from 0 up; those of geometry come last. */
function lastMethod({ id, components }, { domain, surface }) {
  const hasShape = surface.positions !== null && domain !== "part";
  if (id === DIRECTIONS || id === TANGENTS) return hasShape ? PLACE_CORRECTED : MEAN;
  return hasShape && components === 2 && domain !== "triangle" ? AFFINE : PARALLELOGRAM;
}

function decodeBy(how, coder, { id, n, components }, layout) {
  const entries = layout.entries();
  const { surface } = layout;
  if (id === DIRECTIONS || id === TANGENTS) {
    const normals = how.method >= SURFACE ? surfaceNormals(layout, entries.places, [PLACE, PLACE_CORRECTED].includes(how.method)) : null;
    return new OctahedralDecoder(coder, entries, how, { n, width: components }, normals).decode();
  }
  const opposite = how.method === AFFINE ? oppositeCorners(layout.owners) : null;
  return new LinearDecoder(coder, entries, how, { isFloat: id === FLOATS, components }, surface, opposite).decode();
}

/** (N, 3) of the surface at each entry, or at its place. */
function surfaceNormals({ surface, owners }, places, isByPlace) {
  const { faces, positions } = surface;
  if (!isByPlace) return cornerNormals(faces, positions, (c) => owners[c], places.length);
  const nPlaces = places.reduce((most, place) => Math.max(most, place + 1), 0);
  const sums = cornerNormals(faces, positions, (c) => places[owners[c]], nPlaces);
  const normals = new Float64Array(3 * places.length);
  places.forEach((place, entry) => normals.set(sums.subarray(3 * place, 3 * place + 3), 3 * entry));
  return normals;
}
