/** Frames of all codecs, decoded by Python's kernels: in a worker, or on the page where there is none. Pictures are decoded by the page. */

import { Displacements } from "../format/displacements.js";
import { GeometryVideoError, corrupt, quote } from "../format/errors.js";
import { stretch } from "../format/points.js";
import { LaplacianReader, VERSION as LAPLACIAN_VERSION } from "../laplacian/reader.js";
import { McgvReader, VERSION as MCGV_VERSION } from "../mcgv/reader.js";
import { TrajectoryReader } from "../mcgv/trajectory_reader.js";
import { PcaReader, VERSION as PCA_VERSION } from "../pca/reader.js";
import { PdctReader, VERSION as PDCT_VERSION } from "../pdct/reader.js";
import { Kernels } from "../wasm/kernels.js";

const LOOKS = 16; // frames that a look at the motion takes
const AHEAD = 10; // s: a segment that begins later is not decoded ahead
const CORRECTIONS = "corrections";

/**
 * Readers by codec: `open(payload, kernels)` gives `faces`, `points` or `basePoints`, `levels`, `segmentStart` and `read`; with several
 * levels `levelFaces`; where a segment is decoded ahead `prepare`; where pictures are read `planes`, whose levels are handed to `read`;
 * and where a box can hold the motion of segment s without its frames `extend(box, s)`.
 */
const READERS = {
  laplacian: { version: LAPLACIAN_VERSION, reader: LaplacianReader },
  mcgv: { version: MCGV_VERSION, reader: { open: (payload, kernels) => mcgvReader(payload).open(payload, kernels) } },
  pca: { version: PCA_VERSION, reader: PcaReader },
  pdct: { version: PDCT_VERSION, reader: PdctReader },
};

/** The highest version of a codec that is read here; 0: none. */
export function readableVersion(codec) {
  return Object.hasOwn(READERS, codec) ? READERS[codec].version : 0;
}

/** Whether pictures are trajectories, or frames. */
function mcgvReader({ header }) {
  return "transform" in header.settings ? TrajectoryReader : McgvReader;
}

export class FrameDecoder {
  #header;
  #reader;
  #corrections;
  #looked = new Set(); // "segment level" whose motion is in the box
  #bounds = { min: [Infinity, Infinity, Infinity], max: [-Infinity, -Infinity, -Infinity] };

  /**
   * @param {import("../format/payload.js").Payload} payload of the distinct frames; `section` may return promises
   * @param {Uint8Array} code of kernels
   * @returns {Promise<FrameDecoder>}
   * @throws {GeometryVideoError} a section is not as gvpipe writes it
   */
  static async open(payload, code) {
    const { codec, frames, vertices } = payload.header;
    const reader = await guarded("mesh", async () => READERS[codec].reader.open(payload, await Kernels.open(code)));
    const data = payload.sections.has(CORRECTIONS) ? await payload.section(CORRECTIONS) : null;
    return new FrameDecoder(payload.header, reader, data && new Displacements(data, frames, vertices, CORRECTIONS));
  }

  constructor(header, reader, corrections) {
    this.#header = header;
    this.#reader = reader;
    this.#corrections = corrections;
  }

  /**
   * What a page must know of the mesh at a level of detail.
   *
   * @param {number|"coarsest"} wanted
   * @returns {Promise<{level: number, levels: number[], faces: Uint32Array, basePoints: Int32Array, planes: import("../mcgv/reader.js").Planes|null}>} vertices of
   *   each level; triangles (T, 3), flat; rows (V, 3), flat, that are equal where vertices are one point; what is read of pictures
   * @throws {GeometryVideoError} there is no such level
   */
  async describe(wanted) {
    const reader = this.#reader;
    const { levels } = reader;
    const level = wanted === "coarsest" ? levels.length - 1 : wanted;
    if (!(Number.isInteger(level) && level >= 0 && level < levels.length)) {
      throw new GeometryVideoError("unsupported", `level ${quote(level)}: there are levels 0..${levels.length - 1}`);
    }
    const planes = reader.planes ?? null;
    if (level === 0) return { level, levels, faces: reader.faces, basePoints: reader.basePoints ?? rowsOf(reader.points), planes };
    return { level, levels, faces: reader.levelFaces(level), basePoints: rowsOf([...Array(levels[level]).keys()]), planes };
  }

  /**
   * Distinct frames `start` to `stop` of a level.
   *
   * @param {boolean} [goesOn] whether the frames behind them are likely to be next: their segment is then decoded ahead
   * @param {Uint8Array|Uint16Array|null} [picture] of one frame, where pictures are read: the levels of `planes.samples`
   * @returns {Promise<{positions: Float32Array, bounds: {min: number[], max: number[]}}>} (stop - start, V, 3), model units; the box of
   *   the motion so far: of the frames that were read, and of evenly spaced ones of their segments
   */
  async read(start, stop, level, goesOn = false, picture = null) {
    const positions = await this.#frames(start, stop, level, picture);
    stretch(this.#bounds, positions);
    const s = this.#segmentOf(stop - 1);
    const looked = this.#look(s, level);
    if (this.#looked.size === 1) await looked; // what is shown first needs a view
    if (goesOn) this.#prepare(s + 1, stop, level);
    return { positions, bounds: structuredClone(this.#bounds) };
  }

  /** Have the segment of a frame decoded. What goes wrong is told when the frame is read. */
  async prepare(frame) {
    await this.#reader.prepare?.(this.#segmentOf(frame)).catch(() => {});
  }

  #segmentOf(frame) {
    let s = 0;
    while (this.#reader.segmentStart(s + 1) <= frame) s++;
    return s;
  }

  async #frames(start, stop, level, picture = null) {
    const frames = await guarded("coefficients", () => this.#reader.read(start, stop, level, picture));
    const size = frames.length / (stop - start);
    for (let k = start; k < stop && this.#corrections && level === 0; k++) {
      this.#corrections.apply(k, frames.subarray((k - start) * size, (k - start + 1) * size));
    }
    return frames;
  }

  /** Stretch the box by a segment's motion, once. A frame that does not decode is told of when it is read. */
  async #look(s, level) {
    const key = `${s} ${level}`;
    if (this.#looked.has(key)) return;
    this.#looked.add(key);
    if (this.#reader.extend) return void (await guarded("clip", () => this.#reader.extend(this.#bounds, s)).catch(() => {}));
    const [first, last] = [this.#reader.segmentStart(s), this.#reader.segmentStart(s + 1) - 1];
    const looks = Math.min(LOOKS, last - first + 1);
    for (let i = 0; i < looks; i++) {
      const frame = first + Math.floor((i * (last - first)) / Math.max(1, looks - 1));
      stretch(this.#bounds, await this.#frames(frame, frame + 1, level).catch(() => []));
    }
  }

  /** Have segment s decoded, if it begins soon. What goes wrong is told when it is read. */
  async #prepare(s, frame, level) {
    const { fps, frames } = this.#header;
    const start = this.#reader.segmentStart(s);
    if (!this.#reader.prepare || start >= frames || start - frame > AHEAD * fps) return;
    await this.#reader.prepare(s, level).then(() => this.#look(s, level), () => {});
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

/** Rows (V, 3), flat, that are equal where points are. */
function rowsOf(points) {
  const rows = new Int32Array(3 * points.length);
  points.forEach((point, v) => (rows[3 * v] = point));
  return rows;
}
