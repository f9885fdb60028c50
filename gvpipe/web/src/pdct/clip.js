/**
 * A clip: consecutive frames coded from the shared base frame alone, by Python's kernels. Mirrors the decoding half of
 * `gvcodecs.pdct.clip`; `docs/format.md`, section 7. Frames are decoded one after the other, as far as they are asked for.
 */

import {
  PDCT_CLIP_BYTES_PER_NUMBER as BYTES_PER_NUMBER,
  PDCT_CLIP_BYTES_PER_POINT as BYTES_PER_POINT,
  PDCT_CLIP_MAX_CLUSTERS as MAX_CLUSTERS,
  PDCT_CLIP_SECONDS_PER_FRAME as SECONDS_PER_FRAME,
  PDCT_CLIP_SECONDS_PER_POINT as SECONDS_PER_POINT,
  PDCT_DELTA_CODING_PROBLEMS as PROBLEMS,
  SEGMENTS_HUGE as HUGE,
  SEGMENTS_TINY as TINY,
} from "../constants.js";
import { Cursor } from "../format/cursor.js";
import { decodeIntegers } from "../format/integers.js";
import { WordStream } from "../format/word_stream.js";
import { decodeLabels } from "./labels.js";
import { decodeSeeds } from "./seed_coding.js";

const TOO_LARGE = "a position is larger than float32 can hold";
const FIRST = 2; // frames of the first call, so that the first frame comes soon; calls begin at even frames, which kernels pair with the next
const TOGETHER = 8; // frames of a call, at most

/**
 * @typedef {object} BaseFrame of P points, shared by all clips
 * @property {Float64Array} base (P, 3) model units, flat @property {Int32Array} traversal (M) points that move, in the order of signals
 */

export class Clip {
  #kernels;
  #cursor;
  #parts; // of kernels' arguments
  #positions; // (n, P, 3)
  #frames; // n
  #points; // P
  #done = 0; // frames

  /**
   * @param {import("../wasm/kernels.js").Kernels} kernels with a memory for this alone
   * @param {Uint8Array} data section @param {number} frames n @param {BaseFrame} surface
   * @param {string} name of the section, for messages @param {import("../format/budget.js").Budget} budget of the file
   * @throws {GeometryVideoError} the bytes are not as gvpipe writes them, or take more than their file may
   */
  constructor(kernels, data, frames, { base, traversal }, name, budget) {
    const points = base.length / 3;
    const what = `'${name}', ${frames} frames of ${points} points,`;
    const memory = BYTES_PER_POINT * frames * points;
    budget.ask(what, memory, SECONDS_PER_FRAME * frames + SECONDS_PER_POINT * frames * points);
    const cursor = new Cursor(data, name);
    const head = readHead(cursor);
    const nSeeds = cursor.varint(Math.min(MAX_CLUSTERS, points), "the number of clusters");
    budget.ask(what, memory + BYTES_PER_NUMBER * 9 * nSeeds * frames);
    if (nSeeds < 1) throw cursor.corrupt("there is no cluster");
    const blocks = Array.from({ length: 3 }, () => new Cursor(cursor.block(), name));
    const seeds = kernels.whole(readSeedVertices(blocks[0], nSeeds, points), [nSeeds, 3]);
    const labels = new Int32Array(points);
    decodeLabels(blocks[1], traversal.length, nSeeds).forEach((label, i) => (labels[traversal[i]] = label));
    const lattice = kernels.array("float64", [4], [...head.origin, head.seedStep]);
    const [rows, baseSeeds] = [kernels.array("float64", [points, 3], base), kernels.array("int64", [nSeeds, 9])];
    if (!kernels.call("find_base_seeds", rows, seeds, lattice, baseSeeds)[0]) {
      throw cursor.corrupt("the base lies out of the seed lattice's range");
    }
    const seedBase = kernels.numbers(baseSeeds);
    const members = kernels.call("find_members", kernels.whole(traversal), kernels.whole(labels), seeds);
    const layout = kernels.call("lay_out", ...members);
    const baseFrames = this.#localFrames(kernels, seedBase, 1, lattice);
    const shape = kernels.call("shape_members", rows, ...members, ...baseFrames, head.fineness);
    const seedPoints = decodeSeeds(blocks[2], frames, seedBase);
    const words = new WordStream(kernels, cursor.words(cursor.varint(Math.floor(cursor.left / 4), "the word count")));
    const raw = cursor.rest();
    const stream = [...words.arrays, kernels.array("uint8", [raw.length], raw), kernels.array("int64", [1])];
    const learning = kernels.call("start_learning", ...layout);
    this.#kernels = kernels;
    this.#cursor = cursor;
    this.#parts = { seeds, lattice, members, layout, shape, seedPoints, stream, learning, head };
    this.#positions = kernels.array("float32", [frames, points, 3]);
    [this.#frames, this.#points] = [frames, points];
  }

  /** The positions (P, 3) of a frame, flat; of no use once another is asked for. Still points have none. @returns {Float32Array} */
  frame(k) {
    while (this.#done <= k) this.#decode(Math.min(Math.max(FIRST, this.#done), TOGETHER, this.#frames - this.#done));
    return this.#kernels.view(this.#rows(k, 1));
  }

  /** Make a box hold the seed vertices of all frames. */
  extend({ min, max }) {
    const { seedPoints, head } = this.#parts;
    for (let i = 0; i < seedPoints.length; i++) {
      const value = head.origin[i % 3] + seedPoints[i] * head.seedStep;
      min[i % 3] = Math.min(min[i % 3], value);
      max[i % 3] = Math.max(max[i % 3], value);
    }
  }

  #decode(count) {
    const kernels = this.#kernels;
    const { seeds, lattice, members, layout, shape, seedPoints, stream, learning, head } = this.#parts;
    const sums = kernels.array("int64", [count, 3, layout[0].shape[0]]);
    const [status] = kernels.call("decode_deltas", ...layout, ...learning, ...stream, sums);
    if (status) throw this.#cursor.corrupt(PROBLEMS[status]);
    const width = 3 * seeds.shape[0] * 3;
    const own = seedPoints.subarray(this.#done * width, (this.#done + count) * width);
    const frames = this.#localFrames(kernels, own, count, lattice);
    const target = this.#rows(this.#done, count);
    const corners = kernels.whole(own, [count, seeds.shape[0], 9]);
    const fits = kernels.call("rebuild_positions", ...members, ...shape, ...frames, sums, head.step, target)[0];
    if (!kernels.call("place_seeds", seeds, corners, lattice, target)[0] || !fits) throw this.#cursor.corrupt(TOO_LARGE);
    this.#done += count;
    const [, , raw, place] = stream;
    if (this.#done === this.#frames && Math.ceil(kernels.words(place)[0] / 8) !== raw.shape[0]) {
      throw this.#cursor.corrupt("raw bits are left over");
    }
    kernels.free(sums, corners, ...frames);
  }

  /** Frames `first` to `first + count` of the positions, as kernels take them. */
  #rows(first, count) {
    const { type, shape, pointer } = this.#positions;
    return { type, shape: [count, ...shape.slice(1)], pointer: pointer + 12 * this.#points * first };
  }

  #localFrames(kernels, seedPoints, count, lattice) {
    const triangles = kernels.array("float64", [count, seedPoints.length / 9 / count, 9], seedPoints);
    const frames = kernels.call("find_frames", triangles, lattice);
    kernels.free(triangles);
    return frames;
  }
}

function readHead(cursor) {
  const [x, y, z, seedStep, step, fineness] = Array.from({ length: 6 }, () => cursor.f64());
  const isRight = [x, y, z].every((v) => Math.abs(v) < HUGE) && [seedStep, step].every((v) => v > TINY && v < HUGE);
  if (!isRight || !(fineness >= 1 && fineness <= 64)) throw cursor.corrupt("a step or the lattice's origin is out of range");
  return { origin: [x, y, z], seedStep, step, fineness };
}

/** (K, 3) flat. */
function readSeedVertices(cursor, nSeeds, points) {
  const seeds = decodeIntegers(cursor.rest(), 3 * nSeeds, null, cursor.name);
  for (let i = 1; i < seeds.length; i++) seeds[i] += seeds[i - 1];
  if (seeds.some((seed) => seed < 0 || seed >= points)) throw cursor.corrupt("a seed vertex does not exist");
  return seeds;
}
