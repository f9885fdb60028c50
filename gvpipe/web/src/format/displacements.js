/**
 * Sparse displacements of vertices, in whole multiples of a step. Mirrors the decoding half of
 * `gvpipe.coding.corrections.displacements`; `docs/format.md`, section 9.
 */

import {
  SEGMENTS_HUGE as HUGE,
  DISPLACEMENTS_MAX_POSITIONS as MAX_POSITIONS,
  DISPLACEMENTS_NEAR as NEAR,
  SEGMENTS_TINY as TINY,
} from "../constants.js";
import { Cursor } from "./cursor.js";
import { decodeIntegers } from "./integers.js";
import { Recent } from "./recent.js";

const LARGEST = 2 ** 128; // float32 ends there

export class Displacements {
  /**
   * @param {Uint8Array} data the section @param {string} name its name
   * @param {number} frames F @param {number} vertices V
   */
  constructor(data, frames, vertices, name) {
    const cursor = new Cursor(data, name);
    this.step = cursor.f64();
    if (!(this.step > TINY && this.step < HUGE)) throw cursor.corrupt(`its step is ${this.step}`);
    /** Frames of a group. */
    this.group = cursor.varint(Math.max(1, Math.floor(MAX_POSITIONS / vertices)), "the frames of a group");
    if (!this.group) throw cursor.corrupt("its groups have no frames");
    const count = Math.ceil(frames / this.group);
    if (count > cursor.left) throw cursor.corrupt(`${count} groups in ${cursor.left} bytes`); // a length takes one at least
    const lengths = Array.from({ length: count }, () => cursor.varint(cursor.left, "a length"));
    const groups = lengths.map((length) => cursor.take(length));
    cursor.end();
    const framesOf = (g) => Math.min(this.group, frames - g * this.group);
    this.recent = new Recent((g) => decodeGroup(groups[g], framesOf(g), vertices, this.step, name));
    this.count = count;
  }

  /** Decode all groups once: whatever is wrong with them shows now. */
  check() {
    for (let g = 0; g < this.count; g++) this.recent.get(g);
  }

  /** @param {number} frame @param {Float32Array} positions (V, 3) flat, displaced */
  apply(frame, positions) {
    const g = Math.floor(frame / this.group);
    const { starts, coordinates, displacements } = this.recent.get(g);
    const place = frame - g * this.group;
    for (let i = starts[place]; i < starts[place + 1]; i++) {
      for (let axis = 0; axis < 3; axis++) positions[coordinates[i] + axis] += displacements[3 * i + axis];
    }
  }
}

/**
 * @returns {{starts: Uint32Array, coordinates: Uint32Array, displacements: Float64Array}} sorted by frame: frame f
 *   has the displacements starts[f] to starts[f + 1]; where the coordinates of a vertex begin, and (C, 3) its displacement, model units
 */
function decodeGroup(data, frames, vertices, step, name) {
  const starts = new Uint32Array(frames + 1);
  if (!data.length) return { starts, coordinates: new Uint32Array(0), displacements: new Float64Array(0) };
  const cursor = new Cursor(data, name);
  const runs = cursor.varint(frames * vertices, "the number of runs");
  const take = (count, contexts) =>
    decodeIntegers(cursor.take(cursor.varint(cursor.left, "a length")), count, contexts, name);
  const at = decodePositions(take(runs, null), take(runs, null), frames * vertices, cursor);
  const context = (i, ...axes) => Math.min(axes.reduce((sum, axis) => sum + Math.abs(axis[i]), 0), NEAR);
  const x = take(at.length, null);
  const y = take(at.length, Uint8Array.from(at, (_, i) => context(i, x)));
  const z = take(at.length, Uint8Array.from(at, (_, i) => context(i, x, y)));
  cursor.end();
  for (const position of at) starts[(position % frames) + 1]++;
  for (let f = 0; f < frames; f++) starts[f + 1] += starts[f];
  const next = starts.slice();
  const coordinates = new Uint32Array(at.length);
  const displacements = new Float64Array(3 * at.length);
  at.forEach((position, i) => {
    const place = next[position % frames]++;
    coordinates[place] = 3 * Math.floor(position / frames);
    [x[i], y[i], z[i]].forEach((steps, axis) => (displacements[3 * place + axis] = steps * step));
  });
  if (displacements.some((distance) => Math.abs(distance) >= LARGEST)) {
    throw cursor.corrupt("a displacement is larger than float32 can hold");
  }
  return { starts, coordinates, displacements };
}

/** Positions `vertex * frames + frame` of runs, ascending; all below `limit`. */
function decodePositions(gaps, lengths, limit, cursor) {
  let end = 0;
  let count = 0;
  for (let i = 0; i < gaps.length; i++) {
    if (gaps[i] < 0 || lengths[i] < 0) throw cursor.corrupt("a run is out of range");
    end += gaps[i] + lengths[i] + 1;
    count += lengths[i] + 1;
    if (end > limit) throw cursor.corrupt("its runs do not fit the frames and vertices");
  }
  const positions = new Uint32Array(count);
  for (let i = 0, place = 0, position = 0; i < gaps.length; i++) {
    position += gaps[i];
    for (let k = 0; k <= lengths[i]; k++) positions[place++] = position++;
  }
  return positions;
}
