/** Frames of codecs without pictures, decoded by Python's kernels: in a worker, or on the page where there is none. */

import { Displacements } from "../format/displacements.js";
import { GeometryVideoError, corrupt } from "../format/errors.js";
import { TrajectoryReader, VERSION as MCGV_VERSION } from "../mcgv/trajectory_reader.js";
import { PcaReader, VERSION as PCA_VERSION } from "../pca/reader.js";
import { PdctReader, VERSION as PDCT_VERSION } from "../pdct/reader.js";
import { Kernels } from "../wasm/kernels.js";

const LOOKS = 16; // frames that a look at the motion takes
const CORRECTIONS = "corrections";

/**
 * Readers by codec: `open(payload, kernels)` gives `faces`, `points`, `levels`, `levelFaces`, `segmentStart` and `read`; where frames come
 * one after the other, `extend(box)`, too, which has a box hold the motion without decoding it.
 */
const READERS = {
  mcgv: { version: MCGV_VERSION, reader: TrajectoryReader }, // of trajectory images
  pca: { version: PCA_VERSION, reader: PcaReader },
  pdct: { version: PDCT_VERSION, reader: PdctReader },
};

/** The highest version of a codec that is read here; 0: none. */
export function readableVersion(codec) {
  return Object.hasOwn(READERS, codec) ? READERS[codec].version : 0;
}

export class FrameDecoder {
  #reader;
  #corrections;
  #level;

  /**
   * @param {import("../format/payload.js").Payload} payload of the distinct frames; `section` may return promises
   * @param {Uint8Array} code of kernels @param {number} level of detail
   * @returns {Promise<FrameDecoder>}
   * @throws {GeometryVideoError} a section is not as gvpipe writes it, or there is no such level
   */
  static async open(payload, code, level) {
    const { codec, frames, vertices } = payload.header;
    const reader = await guarded("mesh", async () => READERS[codec].reader.open(payload, await Kernels.open(code)));
    if (!(level >= 0 && level < reader.levels.length)) {
      throw new GeometryVideoError("unsupported", `level ${level}: there are levels 0..${reader.levels.length - 1}`);
    }
    const isCorrected = level === 0 && payload.sections.has(CORRECTIONS);
    const data = isCorrected ? await payload.section(CORRECTIONS) : null;
    return new FrameDecoder(reader, data && new Displacements(data, frames, vertices, CORRECTIONS), level);
  }

  constructor(reader, corrections, level) {
    this.#reader = reader;
    this.#corrections = corrections;
    this.#level = level;
  }

  /**
   * What a page must know of the mesh.
   *
   * @returns {Promise<{faces: Uint32Array, points: Int32Array, levels: number[], bounds: {min: number[], max: number[]}}>} triangles
   *   (T, 3), flat; the point of each vertex; vertices of each level; the box of the first segment's motion, by evenly spaced frames or
   *   what the reader knows of it
   */
  async describe() {
    const reader = this.#reader;
    const faces = this.#level ? reader.levelFaces(this.#level) : reader.faces;
    const vertexCount = reader.levels[this.#level];
    const points = this.#level ? Int32Array.from({ length: vertexCount }, (_, v) => v) : reader.points;
    const [bounds, last] = [{ min: [0, 0, 0], max: [0, 0, 0] }, reader.segmentStart(1) - 1];
    const looks = reader.extend ? 1 : Math.min(LOOKS, last + 1);
    for (let i = 0; i < looks; i++) {
      const frame = Math.floor((i * last) / Math.max(1, looks - 1));
      stretch(bounds, await this.read(frame, frame + 1), i === 0);
    }
    await reader.extend?.(bounds);
    return { faces, points, levels: reader.levels, bounds };
  }

  /** Distinct frames `start` to `stop`. @returns {Promise<Float32Array>} (stop - start, V, 3), model units */
  async read(start, stop) {
    const frames = await guarded("coefficients", () => this.#reader.read(start, stop, this.#level));
    const size = frames.length / (stop - start);
    for (let k = start; k < stop && this.#corrections; k++) {
      this.#corrections.apply(k, frames.subarray((k - start) * size, (k - start + 1) * size));
    }
    return frames;
  }
}

/** What `work` returns; errors of kernels are those of a damaged file. */
async function guarded(name, work) {
  try {
    return await work();
  } catch (error) {
    if (!(error instanceof WebAssembly.RuntimeError)) throw error;
    throw corrupt(name, `it does not decode: ${error.message}`);
  }
}

/** Make a box hold `positions (V, 3)`; the first ones make it. */
function stretch({ min, max }, positions, isFirst) {
  for (let axis = 0; axis < 3 && positions.length; axis++) {
    let [low, high] = isFirst ? [Infinity, -Infinity] : [min[axis], max[axis]];
    for (let i = axis; i < positions.length; i += 3) {
      if (positions[i] < low) low = positions[i];
      if (positions[i] > high) high = positions[i];
    }
    [min[axis], max[axis]] = [low, high];
  }
}
