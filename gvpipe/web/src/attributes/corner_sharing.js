/**
 * Which corners of a vertex share a value of an attribute. Mirrors `gvpipe.attributes.corner_sharing`: corners
 * come vertex after vertex, along the fans of triangles around it.
 */

import { SHARING_KERNELS_N_CONTEXTS as N_CONTEXTS } from "../constants.js";
import { SerialStream } from "../format/serial_stream.js";
import { numberByFirst } from "./corners.js";

const [WHOLE, , SHARED, CODED, GUIDED] = [0, 1, 2, 3, 4]; // modes; 1: one entry per corner

/**
 * @param {import("../format/cursor.js").Cursor} cursor read to its end
 * @param {import("./surface.js").Surface} surface
 * @param {Uint32Array[]} references entries of corner attributes before this one
 * @returns {Uint32Array} (3T) entries, numbered by their first corners
 */
export function decodeSharing(cursor, surface, references) {
  const { faces, nVertices } = surface;
  const mode = cursor.u8();
  if (mode > GUIDED) throw cursor.corrupt(`the corners are shared in an unknown mode ${mode}`);
  let reference = null;
  if (mode === SHARED || mode === GUIDED) {
    if (!references.length) throw cursor.corrupt("the corners refer to those of an attribute that does not exist");
    reference = references[cursor.varint(references.length - 1, "the number of a reference")];
  }
  if (mode === CODED || mode === GUIDED) {
    return numberByFirst(decodeFans(cursor, surface, reference), faces.length);
  }
  cursor.end();
  if (mode === WHOLE) return numberByFirst(faces, nVertices);
  return reference ?? Uint32Array.from({ length: faces.length }, (_, c) => c);
}

/** (3T) entries in the order of coding. */
function decodeFans(cursor, { kernels, faces, opposite, nVertices }, reference) {
  const own = kernels.fresh();
  const stream = new SerialStream(own, cursor.rest(), N_CONTEXTS, cursor.name);
  const triangles = own.array("int32", [faces.length / 3, 3], faces);
  const entries = own.array("int64", [faces.length]);
  own.call("code_sharing", ...stream.arrays, triangles, own.whole(opposite), own.whole(reference ?? []), nVertices, entries);
  stream.end();
  return Uint32Array.from(own.numbers(entries));
}
