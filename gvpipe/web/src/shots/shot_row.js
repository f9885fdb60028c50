/**
 * The shots of a capture behind the interface of one file (`Playable` of `codecs.js`): its clock shows frames of all shots, which are
 * opened when one of their frames is asked for, or will be soon. Only a few stay open.
 */

import { DecodedPictures } from "../decoded_pictures.js";
import { GeometryVideoError, corrupt, quote } from "../format/errors.js";
import { RepeatedFrames } from "../format/repeated_frames.js";

const LEAST_OPEN = 8; // shots
const OPEN_VERTICES = 400_000; // of all shots that stay open: a vertex takes some hundred bytes
const BYTES_PER_VERTEX = 12; // of a frame
const EMPTY = { min: [Infinity, Infinity, Infinity], max: [-Infinity, -Infinity, -Infinity] };

/**
 * @typedef {object} Opened a shot that is open
 * @property {import("../geometry_video.js").GeometryVideo} video
 * @property {[number, number, number]} shift from its own coordinates to those of the first shot
 */

export class ShotRow {
  #index;
  #load;
  #end;
  #open = new Map(); // number -> {opened: a promise of Opened, video, frames: how many are asked for}, the one used last at the end
  #origin = null; // of the first shot
  #bounds;
  #clock = null;
  #preparers = new Set();
  #most; // shots that stay open
  #turns;
  #isClosed = false;

  /** A capture has no levels of detail. */
  level = 0;
  /** The number of the shot that is shown; it stays open. */
  shown = 0;

  /**
   * @param {import("../format/shot_layout.js").ShotIndex} index
   * @param {(number: number) => Promise<{video: import("../geometry_video.js").GeometryVideo, header: object}>} load opens a shot
   * @param {number} together shots that are opened at once
   * @param {() => void} end called when it is closed
   * @returns {Promise<ShotRow>} its first shot open
   * @throws {GeometryVideoError} that is damaged
   */
  static async open(index, load, together, end) {
    const row = new ShotRow(index, load, together, end);
    const { video } = await row.opened(0);
    /** Of the first shot, as `Playable` has them. */
    Object.assign(row, { faces: video.indices, basePoints: video.basePoints, vertexCount: video.vertexCount, levels: [video.vertexCount] });
    return row;
  }

  constructor(index, load, together, end) {
    this.#index = index;
    this.#load = load;
    this.#end = end;
    const largest = index.shots.reduce((most, { vertices }) => Math.max(most, vertices), 0);
    this.#most = Math.max(LEAST_OPEN, Math.floor(OPEN_VERTICES / largest));
    this.#turns = new Turns(together, index.shots.length);
    this.#bounds = structuredClone(index.box ?? EMPTY);
  }

  /** Of the first shot, which positions of all are relative to. */
  get origin() {
    return this.#origin;
  }

  /** As `ShotIndex.shots`. */
  get shots() {
    return this.#index.shots;
  }

  /** The box that the motion stays in: of all first frames, if the file says it, and of what was decoded. */
  get bounds() {
    return this.#bounds;
  }

  get isWaiting() {
    return this.#index.source.isWaiting;
  }

  /** The number of a frame's shot. @param {number} frame */
  shotOf(frame) {
    let [low, high] = [0, this.shots.length - 1]; // the last that starts at the frame or before
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.shots[middle].start <= frame) low = middle;
      else high = middle - 1;
    }
    return low;
  }

  /** What is wanted first from now on. @param {number} frame */
  aim(frame) {
    this.#turns.first = this.shotOf(frame);
  }

  /**
   * Have something ready before a frame is shown.
   *
   * @param {{ready: (video: import("../geometry_video.js").GeometryVideo, shot: number, frame: number) => Promise<void>,
   *   closed?: (shot: number) => void}} preparer `ready` is given the shot and the frame's number in it; `closed` is told of a shot that is
   *   let go of
   * @returns {() => void} what ends it
   */
  prepare(preparer) {
    this.#preparers.add(preparer);
    return () => this.#preparers.delete(preparer);
  }

  /** A clock whose `current` is `{shot, video, positions}`. @returns {Promise<DecodedPictures>} */
  async openPictures(frame = 0) {
    const { shots } = this;
    const count = shots.at(-1).start + shots.at(-1).frames;
    const groups = Array.from({ length: count }, (_, picture) => [{ picture }]);
    const decoder = { isConcurrent: true, decode: ([{ picture }], give) => this.#decode(picture, give), close() {} };
    const bytes = BYTES_PER_VERTEX * shots.reduce((most, { vertices }) => Math.max(most, vertices), 0);
    const mostAhead = (group) => this.#mostAhead(group, count);
    this.#clock = await DecodedPictures.of(groups, bytes, this.#index.fps, new RepeatedFrames(count), decoder, { frame, mostAhead });
    return this.#clock;
  }

  /** @throws {GeometryVideoError} the level is none of a capture */
  async at(level) {
    if (level === 0 || level === "coarsest") return this;
    throw new GeometryVideoError("unsupported", `level ${quote(level)}: there are levels 0..0`);
  }

  close() {
    this.#isClosed = true;
    for (const { opened } of this.#open.values()) opened.then(({ video }) => video.close()).catch(() => {});
    this.#open.clear();
    this.#end();
  }

  /** A shot, open. @returns {Promise<Opened>} @throws {GeometryVideoError} it is damaged, or not the one that the index describes */
  opened(number) {
    return this.#entry(number).opened;
  }

  #entry(number) {
    let entry = this.#open.get(number);
    this.#open.delete(number);
    if (!entry) {
      entry = { opened: this.#begin(number), frames: 0 };
      entry.opened.catch(() => this.#open.get(number) === entry && this.#open.delete(number)); // the next call tries again
    }
    this.#open.set(number, entry);
    return entry;
  }

  async #begin(number) {
    const { video, header } = await this.#turns.take(number, () => this.#load(number));
    if (this.#isClosed) video.close();
    const shot = this.shots[number];
    const isDescribed = ["frames", "vertices", "triangles"].every((key) => header[key] === shot[key]) && header.fps === this.#index.fps;
    if (!isDescribed) {
      video.close();
      throw corrupt("header", `the frames, vertices, triangles or rate of shot ${number} are not those that the index gives`);
    }
    const origin = header.origin ?? [0, 0, 0];
    this.#origin ??= number === 0 ? origin : (await this.opened(0), this.#origin);
    const shift = origin.map((value, axis) => value - this.#origin[axis]);
    this.#widen(video.bounds, shift);
    return { video, shift };
  }

  async #decode(frame, give) {
    const shot = this.shotOf(frame);
    const entry = this.#entry(shot);
    entry.frames++;
    try {
      const { video, shift } = await entry.opened;
      const own = frame - this.shots[shot].start;
      const positions = move(await video.frame(own), shift);
      this.#widen(video.bounds, shift);
      await Promise.all([...this.#preparers].map((preparer) => preparer.ready(video, shot, own)));
      give(frame, { shot, video, positions });
    } finally {
      entry.frames--;
      this.#closeOld();
    }
  }

  /** Frames to the end of the last shot that is opened ahead, from one on; behind the last comes the first. */
  #mostAhead(frame, count) {
    const shot = this.shotOf(frame);
    const ahead = this.#most >> 1;
    this.aim(frame);
    if (ahead >= this.shots.length) return count;
    const last = this.shots[(shot + ahead) % this.shots.length];
    return (last.start + last.frames - 1 - frame + count) % count;
  }

  #closeOld() {
    for (const [number, { opened, frames }] of this.#open) {
      if (this.#open.size <= this.#most) break;
      if (frames || number === this.shown) continue;
      this.#open.delete(number);
      opened.then(({ video }) => video.close()).catch(() => {});
      const { start, frames: length } = this.shots[number];
      this.#clock?.forget(start, start + length);
      for (const preparer of this.#preparers) preparer.closed?.(number);
    }
  }

  #widen({ min, max }, shift) {
    for (let axis = 0; axis < 3; axis++) {
      this.#bounds.min[axis] = Math.min(this.#bounds.min[axis], min[axis] + shift[axis]);
      this.#bounds.max[axis] = Math.max(this.#bounds.max[axis], max[axis] + shift[axis]);
    }
  }
}

/** Work on shots, a few at once: what is wanted first, and then what follows it. */
class Turns {
  #free;
  #count;
  #waiting = new Map(); // shot -> what begins it

  /** The shot that is wanted first. */
  first = 0;

  /** @param {number} together how many at once @param {number} count of shots */
  constructor(together, count) {
    this.#free = together;
    this.#count = count;
  }

  /** What `work` gives, once it is its turn. @template T @param {number} shot @param {() => Promise<T>} work @returns {Promise<T>} */
  async take(shot, work) {
    if (this.#free) this.#free--;
    else await new Promise((begin) => this.#waiting.set(shot, begin));
    try {
      return await work();
    } finally {
      this.#next();
    }
  }

  #next() {
    const after = (shot) => (shot - this.first + this.#count) % this.#count;
    const [shot] = [...this.#waiting.keys()].sort((a, b) => after(a) - after(b));
    if (shot === undefined) {
      this.#free++;
      return;
    }
    const begin = this.#waiting.get(shot);
    this.#waiting.delete(shot);
    begin();
  }
}

/** Positions (V, 3) from a shot's own coordinates to those of the first shot. */
function move(positions, [x, y, z]) {
  if (!x && !y && !z) return positions;
  for (let i = 0; i < positions.length; i += 3) {
    positions[i] += x;
    positions[i + 1] += y;
    positions[i + 2] += z;
  }
  return positions;
}
