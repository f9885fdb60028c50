/**
 * The pictures of a geometry video by WebCodecs: groups of pictures are decoded ahead and kept, a clock says which frame is due.
 *
 * A picture is shown for one frame or more (`format/repeated_frames.js`). Every picture has its number, so seeking and looping are exact in every browser. The clock stands still while a picture that
 * is due is not there yet; a page too slow for every picture gets those that are due, and none is queued.
 *
 * What is kept of a picture are the levels of its samples. Where positions are made of them elsewhere, pictures are *finished* just
 * before they are due: positions take more memory than levels. A frame that is not finished in time gives way to the latest one
 * before it that is.
 */

import { AGAIN, GeometryVideoError } from "./format/errors.js";
import { closed } from "./format/request.js";
import { pictureDecoder } from "./picture_decoder.js";
import { readTrack } from "./track.js";

const KEPT_BYTES = 64 * 2 ** 20; // of decoded levels
const FINISHED = 4; // pictures that are kept finished: the one shown, the next two, and one asked for too many
const FINISHING = 2; // at once, while it plays
const LATE = 250; // ms that the clock goes on while the frame that is due is being finished
const KEPT_GROUPS = 3; // at least: what is shown, what comes next, and one of before
const AHEAD = 1; // s, decoded ahead of what plays
const BEHIND = 1.25; // clips of a file that is still written: what is left behind is not played
const EDGE = 1e-3; // frames before the end of such a file, where the clock waits
const STALLED = 500; // ms without the frame that is due: then it says that it waits
const LONGEST_STEP = 1000; // ms that the clock goes on at once: a hidden page is asked for nothing

/**
 * @typedef {(picture: number, levels: Uint8Array|Uint16Array) => Promise<object>} Finish what is to be shown of a picture
 */

/** The clock of pages: one tick before each repaint. */
export const nextRepaint = (tick) => requestAnimationFrame(tick);

export class DecodedPictures {
  /**
   * @param {Uint8Array} file @param {number} fps @param {import("./format/repeated_frames.js").RepeatedFrames} repeated
   * @param {import("./mcgv/reader.js").Planes} planes
   * @param {{checksum?: number, finish?: Finish|null}} [options] `checksum` is the header's `track_crc32`
   * @returns {Promise<DecodedPictures>} its first group decoded
   * @throws {GeometryVideoError} kind "unsupported": this browser's WebCodecs cannot decode it
   */
  static async open(file, fps, repeated, planes, { checksum, finish } = {}) {
    const track = readTrack(file, checksum);
    const found = track.groups.reduce((sum, group) => sum + group.length, 0);
    if (found !== repeated.distinct) {
      throw new GeometryVideoError("corrupt", `its video has ${found} pictures in place of ${repeated.distinct}; ${AGAIN}`);
    }
    const groupBytes = (planes.samples.length * repeated.distinct) / track.groups.length;
    return DecodedPictures.of(track.groups, groupBytes, fps, repeated, pictureDecoder(track, planes), { finish });
  }

  /**
   * The same clock for anything that a decoder gives for pictures.
   *
   * @param {{picture: number}[][]} groups in order @param {number} groupBytes of what is kept of a group, about
   * @param {number} fps @param {import("./format/repeated_frames.js").RepeatedFrames} repeated
   * @param {{decode: (group: object[], give: (picture: number, shown: object) => void) => Promise<void>, close: () => void,
   *   isConcurrent?: boolean}} decoder `isConcurrent`: it takes a group while it decodes others
   * @param {{frame?: number, finish?: Finish|null, keptBytes?: number, mostAhead?: (group: number) => number}} [options] `frame` is shown
   *   first; groups are kept up to so many bytes, and so many are decoded ahead of one, at most
   * @returns {Promise<DecodedPictures>}
   */
  static async of(groups, groupBytes, fps, repeated, decoder, { frame = 0, finish = null, ...limits } = {}) {
    const pictures = new DecodedPictures(groups, groupBytes, fps, repeated, decoder, finish, limits);
    try {
      await pictures.seek(frame);
    } catch (error) {
      pictures.close();
      throw error;
    }
    return pictures;
  }

  /**
   * The same of a file in parts: a group is a fragment, fetched when it is decoded.
   *
   * @param {import("./format/stream_file.js").StreamFile} file @param {number} fps
   * @param {import("./format/repeated_frames.js").RepeatedFrames} repeated @param {import("./mcgv/reader.js").Planes} planes
   * @param {{prepare?: (picture: number) => void, finish?: Finish|null}} [options] `prepare` is told of the first picture of what is fetched
   * @returns {Promise<DecodedPictures>}
   */
  static async inParts(file, fps, repeated, planes, { prepare = () => {}, finish } = {}) {
    if (file.pictures !== repeated.distinct) {
      throw new GeometryVideoError("corrupt", `its video has ${file.pictures} pictures in place of ${repeated.distinct}; ${AGAIN}`);
    }
    const groups = file.fragments.map(({ first, pictures }, fragment) =>
      Array.from({ length: pictures }, (_, i) => ({ picture: first + i, fragment })),
    );
    const inner = pictureDecoder(file.description, planes);
    const decode = async (group, give) => {
      prepare(group[0].picture);
      await inner.decode(await file.samples(group[0].fragment), give);
    };
    const groupBytes = (planes.samples.length * repeated.distinct) / groups.length;
    return DecodedPictures.of(groups, groupBytes, fps, repeated, { decode, close: () => inner.close() }, { finish });
  }

  constructor(groups, groupBytes, fps, repeated, decoder, finish, { keptBytes = KEPT_BYTES, mostAhead = () => Infinity } = {}) {
    this.keptBytes = keptBytes;
    this.mostAhead = mostAhead;
    this.fps = fps;
    this.repeated = repeated;
    /** The frame shown. */
    this.shown = -1;
    /** Of the frame shown what the decoder gave for its picture: levels (S, 3), or what `finish` made of them. */
    this.current = null;
    this.decoder = decoder;
    this.finish = finish;
    /** Of a frame, what must be here before it is shown. @type {((frame: number) => Promise<unknown>)|null} */
    this.beside = null;
    this.failure = null; // an error: what was to be decoded ahead is not tried until something is asked for
    this.finishing = 0; // pictures
    this.finished = new Map(); // picture -> Finished, the one asked for last at the end
    this.groupBytes = groupBytes;
    this.samples = groups;
    this.grow();
    this.kept = new Map(); // group -> Group, the one asked for last at the end
    this.turn = Promise.resolve(); // one group after the other
  }

  /** That there are as many pictures as `repeated` says by now, in groups that were added to the list. */
  grow() {
    /** Of each picture its group. */
    this.groupOf = new Uint32Array(this.repeated.distinct);
    this.samples.forEach((group, g) => group.forEach(({ picture }) => (this.groupOf[picture] = g)));
  }

  /** How many frames there are. */
  get frames() {
    return this.repeated.frames;
  }

  /** The pictures that are decoded and kept: spans `[first, last + 1]`, ascending. */
  spans() {
    const done = [...this.kept].filter(([, { isDone, error }]) => isDone && !error).map(([number]) => number);
    const spans = [];
    for (const number of done.sort((a, b) => a - b)) {
      const [first, stop] = [this.samples[number][0].picture, this.samples[number].at(-1).picture + 1];
      if (spans.at(-1)?.[1] === first) spans.at(-1)[1] = stop;
      else spans.push([first, stop]);
    }
    return spans;
  }

  /** Show a frame and wait until it is there. Pauses. */
  async seek(frame) {
    this.pause();
    if (this.shown === frame) return;
    this.#forgetFailures();
    const picture = this.repeated.distinctOf(frame);
    const levels = await this.#picture(picture);
    const finished = this.#finished(frame, levels);
    await finished.done;
    if (finished.error) throw finished.error;
    this.current = finished.contents;
    this.shown = frame;
  }

  /**
   * Play on from here, `rate` times as fast; calls `show(frame)` for each frame that is due, `ended()` at the end if it does
   * not loop, `failed(error)` if it cannot go on. `nextTick(tick)` has `tick(ms)` called at the next step of the clock;
   * `clock(position)`, in frames since the start, may give another position in place of this clock's, as a sound does.
   * `ticked(ms, isThere)` is called then, with whether the frame that is due is there. It waits for a frame that is on its way, and
   * for more at the end of a file that is still written; `waits(isWaiting)` says so. Played from its last two clips on, it never falls behind them.
   */
  async play({ show, ended, failed, nextTick = nextRepaint, ticked, waits, clock }, rate, loop) {
    const playing = (this.playing = {});
    let position = Math.max(0, this.shown); // frames since the start
    let since = Math.floor(position); // the frame shown last, or first
    let before = null;
    let missing = 0; // ms without a frame that may be shown
    let isWaiting = false;
    const { repeated } = this;
    const follows = position >= this.frames - 2 * repeated.clip && rate >= 1;
    this.shown = -1; // it is shown again, at once
    this.#forgetFailures();
    await this.#picture(this.repeated.distinctOf(Math.floor(position)));
    const tick = (now) => {
      if (this.playing !== playing) return;
      const step = Math.min(Math.max(0, now - (before ?? now)), LONGEST_STEP);
      const isLive = repeated.clip > 0;
      if (isLive && follows && this.frames - position > BEHIND * repeated.clip) position = this.frames - repeated.clip;
      let next = clock?.(position) ?? position + (step * rate * this.fps) / 1000;
      before = now;
      const isAtEnd = isLive && next >= this.frames;
      if (isAtEnd) next = this.frames - EDGE;
      const isOver = !loop && next >= this.frames;
      const frame = loop ? Math.floor(next) % this.frames : Math.min(Math.floor(next), this.frames - 1);
      const picture = this.repeated.distinctOf(frame);
      const group = this.#group(this.groupOf[picture]);
      const finished = this.#finishSoon(frame);
      const error = group.error ?? finished?.error;
      if (error) {
        this.pause();
        failed(error);
        return;
      }
      const isThere = Boolean(finished?.contents);
      const best = isThere ? { frame, contents: finished.contents } : this.#latest(since, frame);
      ticked?.(now, isThere);
      missing = best ? 0 : missing + step;
      if ((isAtEnd || missing > STALLED) !== isWaiting) waits?.((isWaiting = !isWaiting));
      if (best && best.frame !== this.shown) {
        since = best.frame;
        [this.shown, this.current] = [best.frame, best.contents];
        show(best.frame);
      }
      if (isThere && isOver && this.playing === playing) {
        this.pause();
        ended();
        return;
      }
      if (isThere || (group.levels.has(picture) && missing < LATE)) {
        position = loop ? next % this.frames : Math.min(next, this.frames);
        this.#decodeAhead(this.groupOf[picture], AHEAD * this.fps * rate);
        const soon = Math.floor(next + (step * rate * this.fps) / 1000);
        for (const k of [soon, soon + 1]) this.#finishSoon(loop ? k % this.frames : Math.min(k, this.frames - 1));
      } else if (best) {
        position = best.frame; // the clock is never before what is shown
      }
      nextTick(tick);
    };
    if (this.playing === playing) nextTick(tick); // not paused since
  }

  /** Stop playing; the frame shown last stays. */
  pause() {
    this.playing = null;
  }

  close() {
    this.playing = null;
    this.isClosed = true;
    this.decoder.close();
    for (const group of this.kept.values()) group.fail(closed());
    this.kept.clear();
    this.finished.clear();
  }

  /** Let go of groups `first` to `stop` that are decoded. */
  forget(first, stop) {
    for (const [group, { isDone }] of this.kept) if (isDone && group >= first && group < stop) this.kept.delete(group);
  }

  /** Have the groups decoded that follow one: the next, and more up to so many pictures and half of what is kept. */
  #decodeAhead(group, pictures) {
    if (this.failure) return;
    const most = Math.min(this.samples.length - 1, this.keptBytes / 2 / this.groupBytes, this.mostAhead(group));
    for (let i = 1, ahead = 0; i === 1 || (i <= most && ahead < pictures); i++) {
      if (this.repeated.clip && group + i >= this.samples.length) break; // more will come
      const next = (group + i) % this.samples.length;
      this.#group(next);
      ahead += this.samples[next].length;
    }
  }

  /** What is shown of a frame's picture; where that is still to be made of its levels, it is under way. @returns {Finished} */
  #finished(frame, levels) {
    if (!this.finish && !this.beside) return { contents: levels };
    const picture = this.repeated.distinctOf(frame);
    const key = this.#keyOf(frame);
    let finished = this.finished.get(key);
    this.finished.delete(key);
    if (!finished) {
      const both = Promise.all([this.finish ? this.finish(picture, levels) : levels, this.beside?.(frame)]);
      finished = new Finished(frame, both.then(([contents]) => contents));
      this.finishing++;
      finished.done.then(() => this.finishing--);
    }
    if (this.finished.size === FINISHED) {
      const done = [...this.finished].find(([, { contents, error }]) => contents || error);
      this.finished.delete(done ? done[0] : this.finished.keys().next().value);
    }
    this.finished.set(key, finished);
    return finished;
  }

  /** What is finished once: a picture, or a frame where something lies beside it. */
  #keyOf(frame) {
    return this.beside ? frame : this.repeated.distinctOf(frame);
  }

  /** The same while it plays: null where its levels are not there, or too many are under way. @returns {Finished|null} */
  #finishSoon(frame) {
    const picture = this.repeated.distinctOf(frame);
    const levels = this.kept.get(this.groupOf[picture])?.levels.get(picture);
    const isKnown = !(this.finish || this.beside) || this.finished.has(this.#keyOf(frame));
    return levels && (isKnown || this.finishing < FINISHING) ? this.#finished(frame, levels) : null;
  }

  /** The latest finished frame between the one shown last and the one that is due now, or null. */
  #latest(since, due) {
    const ahead = (frame) => (frame - since + this.frames) % this.frames;
    const isDue = ({ contents, frame }) => contents && ahead(frame) <= ahead(due) && frame !== this.shown;
    const found = [...this.finished.values()].filter(isDue);
    return found.sort((a, b) => ahead(a.frame) - ahead(b.frame)).at(-1) ?? null;
  }

  /** What could not be fetched is tried again when it is asked for. */
  #forgetFailures() {
    this.failure = null;
    for (const jobs of [this.kept, this.finished]) {
      for (const [key, { error }] of jobs) if (error?.kind === "load") jobs.delete(key);
    }
  }

  /** A picture's levels, when they are there. */
  #picture(picture) {
    return this.#group(this.groupOf[picture]).picture(picture);
  }

  /** A group that is decoded, or will be. */
  #group(number) {
    let group = this.kept.get(number);
    if (group && !group.error) {
      this.kept.delete(number);
    } else {
      group ??= this.#decode(number);
    }
    this.kept.set(number, group);
    for (const [old, { isDone }] of this.kept) {
      if (this.kept.size <= KEPT_GROUPS || this.kept.size * this.groupBytes <= this.keptBytes) break;
      if (isDone) this.kept.delete(old);
    }
    return group;
  }

  #decode(number) {
    const group = new Group();
    const decode = async () => {
      if (this.isClosed || this.failure) {
        group.fail(this.failure ?? closed());
        if (this.kept.get(number) === group) this.kept.delete(number); // it was not tried
        return;
      }
      try {
        await this.decoder.decode(this.samples[number], (picture, levels) => group.add(picture, levels));
      } catch (error) {
        this.failure = error;
        group.fail(error);
      }
      group.isDone = true;
    };
    if (this.decoder.isConcurrent) decode();
    else this.turn = this.turn.then(decode);
    return group;
  }
}

/** What `finish` makes of a picture's levels: `contents` or `error` once it is `done`. */
class Finished {
  contents = null;
  error = null;

  constructor(frame, promise) {
    this.frame = frame;
    this.done = promise.then(
      (contents) => (this.contents = contents),
      (error) => (this.error = error),
    );
  }
}

/** The levels of a group's pictures, as they come. */
class Group {
  levels = new Map();
  waiting = new Map(); // picture -> what to call
  error = null;
  isDone = false;

  picture(number) {
    if (this.error) return Promise.reject(this.error);
    if (this.levels.has(number)) return Promise.resolve(this.levels.get(number));
    const others = this.waiting.get(number) ?? [];
    return new Promise((resolve, reject) => this.waiting.set(number, [...others, { resolve, reject }]));
  }

  add(number, levels) {
    this.levels.set(number, levels);
    for (const { resolve } of this.waiting.get(number) ?? []) resolve(levels);
    this.waiting.delete(number);
  }

  fail(error) {
    this.error = error;
    for (const { reject } of [...this.waiting.values()].flat()) reject(error);
    this.waiting.clear();
  }
}
