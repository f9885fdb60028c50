/**
 * Draco's decoder (npm package draco3d, WebAssembly inlined in the bundle) behind one function: a stream's keys and triangles
 * as `gvpipe.connectivity.base_mesh` wrote them.
 */

import { BASE_MESH_DRACO_PREFIX as PREFIX } from "../constants.js";
import createDraco from "draco3d/draco_decoder_nodejs.js";
import wasmBinary from "draco3d/draco_decoder.wasm";
import { inflated } from "../wasm/inflated.js";
import { corrupt } from "./errors.js";

/** Draco's WebAssembly, deflated; a worker has none of its own. */
export const dracoBinary = wasmBinary;

let binary = wasmBinary;
let draco = null;

/** Decode by these bytes, deflated. @param {Uint8Array} bytes */
export function useDraco(bytes) {
  binary = bytes;
}

/**
 * @param {Uint8Array} stream @param {number} triangles at most
 * @returns {Promise<{keys: Int32Array, faces: Uint32Array}>} (n, 4) positions and occurrence numbers of Draco's points, and
 *   (t, 3) triangles over them, flat
 */
export function decodeDraco(stream, triangles) {
  return decodeMesh(stream, triangles, (...parts) => ({ keys: readKeys(...parts), faces: readFaces(...parts) }));
}

/**
 * The same without positions, which mean nothing.
 *
 * @param {Uint8Array} stream @param {number} triangles at most
 * @returns {Promise<{nVertices: number, faces: Uint32Array}>}
 */
export function decodeDracoTriangles(stream, triangles) {
  return decodeMesh(stream, triangles, (...parts) => ({ nVertices: parts[2].num_points(), faces: readFaces(...parts) }));
}

async function decodeMesh(stream, triangles, read) {
  checkHeader(stream, triangles);
  draco ??= inflated(binary).then((wasmBinary) => createDraco({ wasmBinary }));
  const module = await draco;
  const decoder = new module.Decoder();
  const mesh = new module.Mesh();
  try {
    const status = decoder.DecodeArrayToMesh(stream, stream.length, mesh);
    if (!status.ok()) throw corrupt("mesh", "Draco cannot decode it");
    return read(module, decoder, mesh);
  } catch (error) {
    throw error instanceof WebAssembly.RuntimeError ? corrupt("mesh", "Draco cannot decode it") : error;
  } finally {
    module.destroy(mesh);
    module.destroy(decoder);
  }
}

function readKeys(module, decoder, mesh) {
  const n = mesh.num_points();
  const keys = new Int32Array(4 * n);
  const column = (type, width, at) => {
    const id = decoder.GetAttributeId(mesh, type);
    if (id < 0) return false;
    const attribute = decoder.GetAttribute(mesh, id);
    const kind = attribute.data_type();
    if (attribute.num_components() !== width || kind < module.DT_INT8 || kind > module.DT_UINT32) {
      throw corrupt("mesh", "unexpected Draco attributes");
    }
    const values = new module.DracoUInt32Array();
    try {
      if (!decoder.GetAttributeUInt32ForAllPoints(mesh, attribute, values) || values.size() !== n * width) {
        throw corrupt("mesh", "Draco cannot decode its attributes");
      }
      for (let i = 0; i < n; i++) {
        for (let c = 0; c < width; c++) {
          const value = values.GetValue(i * width + c);
          if (value >= 2 ** 31) throw corrupt("mesh", "lattice coordinate out of range");
          keys[4 * i + at + c] = value;
        }
      }
    } finally {
      module.destroy(values);
    }
    return true;
  };
  const found = mesh.num_attributes();
  if (!column(module.POSITION, 3, 0) || found > 2) throw corrupt("mesh", "unexpected Draco attributes");
  if (found === 2 && !column(module.GENERIC, 1, 3)) throw corrupt("mesh", "unexpected Draco attributes");
  return keys;
}

function readFaces(module, decoder, mesh) {
  const n = 3 * mesh.num_faces();
  const points = mesh.num_points();
  const address = module._malloc(Math.max(4, 4 * n));
  try {
    if (!decoder.GetTrianglesUInt32Array(mesh, 4 * n, address)) throw corrupt("mesh", "Draco cannot decode its triangles");
    const faces = new Uint32Array(module.HEAPU8.buffer, address, n).slice();
    if (faces.some((vertex) => vertex >= points)) throw corrupt("mesh", "a triangle names a vertex that does not exist");
    return faces;
  } finally {
    module._free(address);
  }
}

/** Refuse counts that a mesh of so many triangles cannot have before Draco allocates for them. */
function checkHeader(stream, triangles) {
  if (!PREFIX.every((byte, i) => stream[i] === byte)) {
    throw corrupt("mesh", "not the kind of Draco stream that is written here");
  }
  let position = PREFIX.length + 1; // skip the traversal type
  for (const [what, most] of [["vertices", 3 * triangles], ["triangles", triangles]]) {
    let count = 0;
    let byte = 128;
    for (let shift = 0; byte >= 128; shift += 7) {
      if (position >= stream.length || shift > 28) throw corrupt("mesh", "truncated Draco header");
      byte = stream[position++];
      count += (byte & 127) * 2 ** shift;
    }
    if (count > most) throw corrupt("mesh", `${count} ${what} in Draco's stream; at most ${most} fit the header`);
  }
}
