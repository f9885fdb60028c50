/** Codes of entries from their bytes, by Python's kernels. Mirrors `gvpipe.attributes.value_coding`. */

import {
  LINEAR_KERNELS_AFFINE as AFFINE,
  LINEAR_KERNELS_PARALLELOGRAM as PARALLELOGRAM,
  MATCH_KERNELS_N_MATCH_CONTEXTS as N_MATCH_CONTEXTS,
  MATCH_KERNELS_N_RESIDUAL_CONTEXTS as N_RESIDUAL_CONTEXTS,
  OCTAHEDRAL_KERNELS_MEAN as MEAN,
  OCTAHEDRAL_KERNELS_PLACE as PLACE,
  OCTAHEDRAL_KERNELS_PLACE_CORRECTED as PLACE_CORRECTED,
  OCTAHEDRAL_KERNELS_SURFACE as SURFACE,
  VALUE_CODING_MAX_SHIFT as MAX_SHIFT,
} from "../constants.js";
import { SerialStream } from "../format/serial_stream.js";
import { oppositeCorners } from "./corners.js";
import { DIRECTIONS, FLOATS, TANGENTS } from "./storage.js";

const MAX_FLAGS = 3;

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
    const kernels = layout.surface.kernels.fresh();
    const stream = new SerialStream(kernels, cursor.rest(), N_RESIDUAL_CONTEXTS + (flags ? N_MATCH_CONTEXTS : 0), cursor.name);
    codes = kernels.numbers(decodeBy(kernels, stream, { method, flags, shift }, storage, layout));
    stream.end();
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

/** (N, C) as kernels have them. */
function decodeBy(kernels, stream, { method, flags, shift }, { id, n, components }, layout) {
  const { surface, nEntries, owners } = layout;
  const { places, order } = layout.entries(kernels);
  const entries = [...order, kernels.whole(places), flags, shift];
  const codes = kernels.array("int64", [nEntries, components]);
  const triangles = kernels.array("int32", [surface.faces.length / 3, 3], surface.faces);
  const rows = surface.positions ? surface.nVertices : 0;
  const positions = kernels.array("float32", [rows, 3], surface.positions);
  if (id === DIRECTIONS || id === TANGENTS) {
    const normals = surfaceNormals(kernels, method, triangles, positions, owners, places);
    kernels.call("code_octahedral", ...stream.arrays, ...entries, method, n, normals, codes);
    return codes;
  }
  const opposite = kernels.whole(method === AFFINE ? oppositeCorners(owners) : []);
  const numbers = kernels.array("float64", [nEntries, components]);
  kernels.call("code_linear", ...stream.arrays, ...entries, method, id === FLOATS, triangles, opposite, positions, codes, numbers);
  return codes;
}

/** (N, 3) of the surface at each entry, or at its place; none for methods without. */
function surfaceNormals(kernels, method, triangles, positions, owners, places) {
  if (method < SURFACE) return kernels.array("float64", [0, 3]);
  if (method !== PLACE && method !== PLACE_CORRECTED) {
    return kernels.call("corner_normals", triangles, positions, kernels.whole(owners), places.length)[0];
  }
  const nPlaces = places.reduce((most, place) => Math.max(most, place + 1), 0);
  const own = kernels.whole(owners.map((entry) => places[entry]));
  const [sums] = kernels.call("corner_normals", triangles, positions, own, nPlaces);
  const found = kernels.view(sums).slice();
  const normals = new Float64Array(3 * places.length);
  places.forEach((place, entry) => normals.set(found.subarray(3 * place, 3 * place + 3), 3 * entry));
  return kernels.array("float64", [places.length, 3], normals);
}
