/**
 * A geometry video in a page: its mesh, and the positions of any frame.
 *
 *     const video = await GeometryVideo.load("walk.mp4");
 *     const positions = await video.frame(10);             // Float32Array (V, 3), model units
 *     video.play((positions, frame) => draw(positions));   // as the video plays
 */

import { NO_ASSET, readAsset, readCoarseAsset } from "./asset/asset.js";
import { openCodec } from "./codecs.js";
import { findIndex, readContainer } from "./format/boxes.js";
import { placesInFile, readCompanions } from "./format/companion_parts.js";
import { describedIn, describedSound, geometryOf, soundOf } from "./format/companions.js";
import { GeometryVideoError } from "./format/errors.js";
import { RepeatedFrames, readRepeatedFrames } from "./format/repeated_frames.js";
import { readPayload } from "./format/payload.js";
import { isRangeSource } from "./format/range_source.js";
import { Bytes } from "./format/ranges.js";
import { OUTAGE, closed, request } from "./format/request.js";
import { readShots } from "./format/shot_layout.js";
import { StreamFile } from "./format/stream_file.js";
import { DecodingWorker } from "./frames/decoding_worker.js";
import { MovingImages } from "./moving/moving_images.js";
import { checkRate } from "./playback_rate.js";
import { ShotRow } from "./shots/shot_row.js";
import { kernelCode } from "./wasm/inflated.js";

export { GeometryVideoError };

const CATCHES = 3; // times that another level seeks the frame that plays, which goes on meanwhile
const LOOKS_PER_CLIP = 4; // at a file that is still written
const SOONEST = 100; // ms between two of them
const LATEST = 1000; // while clips come
const IDLE = 5000; // while none does
const TRIES = 5; // of a look that the server refuses
const PATIENCE = 30_000; // ms, with an outage
const SOUND_IN_PARTS = "its sound is left out, since the file comes in parts from no address; load the whole file to hear it";
const DAMAGED_SOUND = "its sound is damaged, and is left out; get the file again from its source";
const [LEAST_WORKERS, MOST_WORKERS] = [2, 4]; // that decode shots: one frame of a mesh of its own takes much longer than one of many
const SHOT_BYTES = 1 << 22; // of decoded frames that a shot keeps, beside those that its capture keeps
const FROM_DISK = "pages opened from a disk may not fetch; open it from a web server, or make a page with gvpipe export-html";

export class GeometryVideo {
  /**
   * Load a geometry video, as `gvpipe encode` writes it.
   *
   * @param {string|URL|Blob|ArrayBuffer|Uint8Array|import("./format/range_source.js").RangeSource} source an address, the file itself, or what
   *   gives parts of it
   * @param {{level?: number|"coarsest", signal?: AbortSignal}} [options] a level of detail above 0 is a coarser mesh, without attributes
   *   and fields; `signal` ends loading
   * @returns {Promise<GeometryVideo>}
   * @throws {GeometryVideoError} it cannot be fetched, it is no geometry video, it is damaged, or not one for browsers
   * @throws {TypeError} the source is none of these
   * @throws {unknown} the signal's reason
   */
  static async load(source, { level = 0, signal = null } = {}) {
    checkSource(source);
    const closing = new AbortController();
    const follow = () => closing.abort(signal.reason);
    if (signal?.aborted) follow();
    signal?.addEventListener("abort", follow);
    try {
      return await GeometryVideo.#load(source, level, closing);
    } finally {
      signal?.removeEventListener("abort", follow);
    }
  }

  static async #load(source, level, closing) {
    const found = await openSource(source, closing.signal);
    const index = found instanceof Uint8Array ? await shotsOf(found) : found instanceof StreamFile ? null : found;
    const isInParts = !(found instanceof Uint8Array);
    if (!index) return GeometryVideo.#open(found, level, closing, { address: source });
    const video = await GeometryVideo.#openCapture(index, isInParts, level, closing);
    video.#findSound(isInParts ? null : found, source, { container: index });
    video.notes = [...video.notes, ...video.#soundNotes];
    return video;
  }

  /**
   * @param {Uint8Array|StreamFile} source of one connectivity
   * @param {{find?: (hash: string) => Promise<Uint8Array|null>, worker?: DecodingWorker, keptBytes?: number, address?: unknown}} [shared]
   *   of a shot; `address`: of the whole file
   */
  static async #open(source, level, closing, { find, address, ...shared } = {}) {
    const parts = source instanceof StreamFile ? source : null;
    const file = parts ? null : source;
    let [pictures, reader] = [null, null];
    try {
      closing.signal.throwIfAborted();
      const payload = await readPayload(file ? readContainer(file) : parts.container, find);
      const repeated = readRepeatedFrames(payload);
      const described = describedIn(payload.header);
      const companions = file ? companionsOf(file, described) : parts.companions(described);
      reader = await openCodec(file ? geometryOf(file) : source, payload, repeated, level, closing.signal, shared);
      const start = file ? 0 : parts.startFrame;
      if (parts?.isGrowing) repeated.grow(parts.live.frames, parts.live.clip);
      closing.signal.throwIfAborted();
      pictures = await reader.openPictures(start);
      closing.signal.throwIfAborted();
      const video = new GeometryVideo(payload.header, file?.length ?? parts.size, repeated, reader, pictures);
      video.startFrame = start;
      video.#isInParts = !file;
      video.#closeFile = () => closing.abort(closed());
      video.#payload = payload;
      video.#companions = companions;
      if (!find) video.#findSound(file, address, payload.header);
      video.#takeAsset(reader.level ? await readCoarseAsset(payload) : await video.#readAsset(video, reader));
      if (parts?.isGrowing) video.#watch(parts);
      return video;
    } catch (error) {
      pictures?.close();
      reader?.close();
      parts?.close();
      GeometryVideo.#giveUp(error, closing);
    }
    return undefined;
  }

  static async #openCapture(index, isInParts, level, closing) {
    const code = await kernelCode();
    const count = Math.min(index.shots.length, MOST_WORKERS, Math.max(LEAST_WORKERS, (globalThis.navigator?.hardwareConcurrency ?? 1) - 1));
    const workers = Array.from({ length: count }, () => new DecodingWorker(code, true));
    const load = async (number) => {
      const own = new AbortController();
      const shared = { find: index.find, worker: workers[number % count], keptBytes: SHOT_BYTES };
      const video = await GeometryVideo.#open(await StreamFile.openShot(index.shot(number)), 0, own, shared);
      return { video, header: video.#payload.header };
    };
    const end = () => {
      for (const worker of workers) worker.close();
      index.source.close();
    };
    let row = null;
    try {
      closing.signal.throwIfAborted();
      row = await ShotRow.open(index, load, 2 * count, end);
      await row.at(level);
      const pictures = await row.openPictures();
      closing.signal.throwIfAborted();
      const { start, frames } = index.shots.at(-1);
      const repeated = new RepeatedFrames(start + frames);
      const video = new GeometryVideo({ frames: start + frames, fps: index.fps, origin: row.origin }, index.size, repeated, row, pictures);
      video.#row = row;
      video.#isInParts = isInParts;
      video.#closeFile = () => closing.abort(closed());
      video.#takeShot();
      return video;
    } catch (error) {
      if (row) row.close();
      else end();
      GeometryVideo.#giveUp(error, closing);
    }
    return undefined;
  }

  /** Throw what says best why a file cannot be opened. */
  static #giveUp(error, closing) {
    closing.signal.throwIfAborted();
    closing.abort(closed());
    if (!(error instanceof RangeError)) throw error; // an array that the browser cannot give
    throw new GeometryVideoError("unsupported", "it needs more memory than this browser has for a page");
  }

  #payload;
  #row = null; // ShotRow, of a capture
  #isOfShot = false; // whether a shot was taken
  #companions = []; // tracks beside the geometry's
  #moving = null; // MovingImages, once they are asked for
  #opening = null; // a promise of them
  #repeated;
  #reader;
  #pictures;
  #isInParts = false; // fetched when it is needed
  #closeFile = () => {};
  #isClosed = false;
  #shown = 0; // the frame shown last
  #playing = null; // what `play` was given last
  #asset = null; // of level 0, once it is read
  #queue = Promise.resolve();
  #changed = Promise.resolve(); // one change of the level after the other
  #beside = null; // a promise of pictures of their own, for fields that follow from positions
  #queueBeside = Promise.resolve();
  #wake = () => {}; // ends a wait for the next look
  #followers = new Set(); // of a file that is still written
  #soundNotes = [];
  #soundUrl = null; // to be revoked

  /** The frame that is shown first: 0; of a file that is still written, that where its latest clip begins. */
  startFrame = 0;
  /** The number of the shot that is shown: of the frame that was given last. `vertexCount`, `indices` and what lies beside positions are its own. */
  shot = 0;
  /**
   * What is heard with it, or null: `{codec, channels, rate, seconds, start}`, of seconds after frame 0, and `url` of a file that
   * browsers play.
   */
  sound = null;
  /** Called when frames have come to a file that is still written, and when it is finished. */
  grown = () => {};
  /** Called when it cannot be followed any longer, with the error. */
  lost = () => {};

  /**
   * Hear of both, beside those two functions; of a capture, have something `ready` before frames are shown (`ShotRow.prepare`).
   *
   * @param {{grown: () => void, lost: (error: Error) => void, ready?: (video: GeometryVideo, shot: number, frame: number) => Promise<void>,
   *   closed?: (shot: number) => void}} follower @returns {() => void} what ends it
   */
  follow(follower) {
    this.#followers.add(follower);
    const unprepare = follower.ready && this.#row?.prepare(follower);
    return () => {
      this.#followers.delete(follower);
      unprepare?.();
    };
  }

  constructor(header, byteLength, repeated, reader, pictures) {
    this.frameCount = header.frames;
    this.fps = header.fps;
    /** What positions count from, model units: a point of the source. */
    this.origin = header.origin ?? [0, 0, 0];
    /** Of the whole file. */
    this.byteLength = byteLength;
    this.#repeated = repeated;
    this.#takeLevel(reader, pictures, NO_ASSET);
  }

  /** Runs of frames of one connectivity, in order: `{start, frames, vertices, triangles}`, `start` being the first frame. */
  get shots() {
    const { frameCount: frames, vertexCount: vertices, triangleCount: triangles } = this;
    return this.#row ? this.#row.shots.map(({ bytes: _, ...shot }) => shot) : [{ start: 0, frames, vertices, triangles }];
  }

  /** The number of a frame's shot. @param {number} k */
  shotOf(k) {
    return this.#row ? this.#row.shotOf(k) : 0;
  }

  /** The number that a frame of the shot that is shown has in it: that of frames of fields. @param {number} k */
  ownFrame(k) {
    return this.#row ? k - this.#row.shots[this.shot].start : k;
  }

  /** `{min, max}`: the box that the motion stays in, model units. Of a file in segments without pictures: of those read so far. */
  get bounds() {
    return this.#reader.bounds;
  }

  /** Whether a part of the file is on its way. */
  get isWaiting() {
    return this.#reader.isWaiting ?? false;
  }

  /** Whether the file is still written: frames come. */
  get isLive() {
    return this.#repeated.clip > 0;
  }

  /** Seconds; `Infinity` while the file is still written. */
  get duration() {
    return this.isLive ? Infinity : this.frameCount / this.fps;
  }

  /** Seconds that play without a wait for the file: a list of `[start, end]`. */
  get buffered() {
    if (!this.#isInParts) return [[0, this.duration]];
    const timeOf = (picture) => this.#repeated.frameOf(picture) / this.fps;
    return this.#pictures.spans().map(([first, stop]) => [timeOf(first), timeOf(stop)]);
  }

  /** Bits of the file per second of playing. */
  get bitRate() {
    return (8 * this.byteLength * this.fps) / this.frameCount;
  }

  /**
   * The positions of frame k; ends `play`. Calls may overlap: they are answered in turn.
   *
   * @param {number} k 0..frameCount - 1
   * @param {Float32Array} [positions] to fill, instead of a new array
   * @returns {Promise<Float32Array>} (V, 3), model units
   * @throws {RangeError} there is no such frame, or `positions` is too short
   * @throws {DOMException} AbortError: the video is closed
   */
  frame(k, positions = null) {
    if (!Number.isInteger(k) || k < 0 || k >= this.frameCount) {
      return Promise.reject(new RangeError(`frame ${k}: there are ${this.frameCount}`));
    }
    const size = 3 * this.#verticesOf(k);
    if (positions && !(positions[Symbol.toStringTag] === "Float32Array" && positions.length >= size)) {
      return Promise.reject(new RangeError(`positions: a Float32Array of ${size} numbers is needed`));
    }
    return this.#queued(async () => {
      this.pause();
      this.#row?.aim(k);
      await Promise.all([this.#pictures.seek(k), this.#besideOf(k)]);
      return this.#read(k, positions);
    });
  }

  /**
   * Play on from the frame last shown. The clock leads: a page too slow for every frame gets those that are due.
   *
   * @param {(positions: Float32Array, k: number) => void} show called for each frame; the array is used again for the next
   * @param {{rate?: number, loop?: boolean, ended?: () => void, failed?: (error: Error) => void,
   *   nextTick?: (tick: (now: number) => void) => void, ticked?: (now: number, isThere: boolean) => void,
   *   waits?: (isWaiting: boolean) => void, clock?: (position: number) => number|null}} [options] `rate` 1 is the video's own speed; `waits` is called when it waits for frames
   *   that are on their way or not yet written, and when it goes on; `failed` is called if a frame later on cannot be decoded; `nextTick` is a clock in place of the page's: it
   *   calls `tick` at its next step, with ms; `clock` may give another position, in frames, in place of what the time makes of it; `ticked` is called at each step, with whether the frame that is due was there
   * @throws {DOMException} NotSupportedError: no browser plays at this rate; AbortError: the video is closed
   */
  async play(show, { rate = 1, loop = false, ended = () => {}, failed = () => {}, nextTick, ticked, waits, clock } = {}) {
    checkRate(rate);
    await this.#queue;
    this.#playing = { show, ended, failed, nextTick, ticked, waits, clock, rate, loop };
    await this.#start();
  }

  /**
   * Show another level of detail from now on: `level`, `indices`, `basePoints`, numbers of vertices and triangles, and what the
   * asset has change. What plays goes on, at the old level until the new one is decoded.
   *
   * @param {number|"coarsest"} level @returns {Promise<void>} that it is shown
   * @throws {GeometryVideoError} there is no such level, or it cannot be fetched or decoded
   */
  setLevel(level) {
    const changed = this.#changed.then(() => this.#change(level));
    this.#changed = changed.catch(() => {});
    return changed;
  }

  async #change(level) {
    if (this.#isClosed) throw closed();
    const reader = await this.#reader.at(level);
    if (reader.level === this.level) return;
    const pictures = await reader.openPictures(this.#shown);
    try {
      const asset = reader.level === 0 ? (this.#asset ?? (await this.#readAsset(this.#whole(reader), reader))) : { ...NO_ASSET, metadata: this.metadata };
      await this.#queued(async () => {
        for (let i = 0; i < CATCHES && pictures.shown !== this.#shown; i++) await pictures.seek(this.#shown);
        const isPlaying = Boolean(this.#pictures.playing);
        this.#pictures.close();
        if (this.#isClosed) return;
        this.#takeLevel(reader, pictures, asset);
        if (isPlaying) await this.#start();
      });
    } catch (error) {
      pictures.close();
      throw error;
    }
    if (this.#isClosed) pictures.close();
  }

  /** Stop playing. */
  pause() {
    this.#pictures.pause();
  }

  /**
   * Have the pictures of images that move from now on: no frame is given before its pictures are here.
   *
   * @param {Iterable<number>} wanted numbers of images, of the first call
   * @returns {Promise<MovingImages>} `show(k)` gives those of the frame that was given last
   */
  openMoving(wanted) {
    if (this.#row) return this.#pictures.current.video.openMoving(wanted); // of the shot that is shown
    this.#opening ??= this.#openMoving(wanted);
    return this.#opening;
  }

  async #openMoving(wanted) {
    const { header, budget } = this.#payload;
    const moving = await MovingImages.open(this.images, wanted, this.#companions, header, budget);
    if (this.#isClosed) moving.close();
    this.#moving = moving;
    await this.#queued(() => moving.ready(this.#shown));
    this.#waitBeside();
    return moving;
  }

  /** That all pictures beside a frame are here. */
  #besideOf(k) {
    return this.level === 0 ? this.#moving?.ready(k) : undefined;
  }

  /** Clocks show no frame before what lies beside it is here. */
  #waitBeside() {
    this.#pictures.beside = this.#moving?.isEmpty === false && this.level === 0 ? (k) => this.#moving.ready(k) : null;
  }

  /** Free the video; the object is of no use afterwards. */
  close() {
    this.#isClosed = true;
    this.#wake();
    this.#pictures.close();
    this.#beside?.then((pictures) => pictures.close()).catch(() => {});
    this.#asset?.close();
    this.#moving?.close();
    this.#reader.close();
    this.#closeFile();
    if (this.#soundUrl) URL.revokeObjectURL(this.#soundUrl);
  }

  /** Look for frames that come, until the end is there: a few times per clip, and seldom while nothing comes. */
  async #watch(file) {
    const soonest = Math.min(Math.max(SOONEST, (1000 * file.live.clip) / this.fps / LOOKS_PER_CLIP), LATEST);
    let [since, answered, tries, outages] = [performance.now(), performance.now(), 0, 0];
    while (this.isLive && !this.#isClosed) {
      const wait = Math.min(Math.max(soonest, (performance.now() - since) / (2 * LOOKS_PER_CLIP), soonest * 2 ** outages), IDLE);
      await new Promise((resolve) => {
        this.#wake = resolve;
        setTimeout(resolve, wait);
      });
      if (this.#isClosed) return;
      try {
        if (await file.poll()) since = performance.now();
        tries = outages = 0;
        answered = performance.now();
        if (!this.#isClosed) this.#grow(file);
      } catch (error) {
        tries++;
        if (this.#isClosed) return;
        const isRefusal = error.status < OUTAGE;
        outages = error.kind !== "load" || isRefusal ? 0 : outages + 1;
        if (isRefusal ? tries < TRIES : outages && performance.now() - answered < PATIENCE) continue;
        for (const each of [this, ...this.#followers]) each.lost(error);
        return;
      }
    }
  }

  #grow(file) {
    const { live, size } = file;
    if (live.frames === this.frameCount && !live.hasEnded) return;
    this.#reader.grow(live.frames);
    this.#repeated.grow(live.frames, live.hasEnded ? 0 : live.clip);
    this.frameCount = live.frames;
    this.byteLength = size;
    this.#pictures.grow();
    for (const each of [this, ...this.#followers]) each.grown();
  }

  #takeLevel(reader, pictures, asset) {
    this.#reader = reader;
    this.#pictures = pictures;
    /** The level of detail; 0: the whole mesh. */
    this.level = reader.level;
    /** Vertices of each level of detail, the whole mesh first. */
    this.levels = reader.levels;
    this.vertexCount = reader.vertexCount;
    this.triangleCount = reader.faces.length / 3;
    /** `Uint32Array` (T, 3): triangles, counter-clockwise. */
    this.indices = reader.faces;
    /** `Int32Array` (V, 3): the first frame on the file's lattice, if it has one; vertices with equal rows are one point of the surface. */
    this.basePoints = reader.basePoints;
    this.#takeAsset(asset);
    this.#waitBeside();
  }

  /** The whole mesh, which `reader` reads, as `readAsset` needs it while another level is shown. */
  #whole(reader) {
    const { faces: indices, vertexCount } = reader;
    const frame = (k) => this.#positionsBeside(reader, k);
    return { frameCount: this.frameCount, vertexCount, triangleCount: indices.length / 3, indices, frame };
  }

  /** What lies beside positions of level 0, which `reader` reads; kept. */
  async #readAsset(video, reader) {
    this.#asset = await readAsset(this.#payload, video, (k) => this.#positionsBeside(reader, k));
    return this.#asset;
  }

  /** What is heard: of a file in memory a file of its own, else the track of the file that the browser fetches. */
  #findSound(file, source, header) {
    const described = describedSound(header);
    if (!described) return;
    const data = file && soundOf(file, header);
    if (file && !data) {
      this.#soundNotes = [DAMAGED_SOUND];
      return;
    }
    if (!file && isRangeSource(source)) {
      this.#soundNotes = [SOUND_IN_PARTS];
      return;
    }
    let url = file ? null : String(addressOf(source));
    const makeUrl = () => (this.#soundUrl ??= URL.createObjectURL(new Blob([data], { type: "audio/mp4" })));
    this.sound = { ...described, get url() { return (url ??= makeUrl()); } };
  }

  #takeAsset(asset) {
    this.indices = asset.indices ?? this.indices;
    /** Named meshes: `{name, vertices: [start, stop], triangles: [start, stop], material, parent}`; [] for one without a name. */
    this.parts = asset.parts;
    /** `Map` by name of `{domain, kind, components, unit, values (N, C), indices (rows) or null, fullScale}`. */
    this.attributes = asset.attributes;
    /** `Map` by name of `CodedField`s: `frame(k)` is a promise of an array (R, C) of the field's `type`. */
    this.fields = asset.fields;
    this.materials = asset.materials;
    /** `{name, mediaType, data}`; data is null of those that move (`openMoving`). */
    this.images = asset.images;
    /** (P) corners of each polygon, or null if all are triangles. */
    this.polygons = asset.polygons;
    /** What lies inside of the surface (`volume/volume.js`), or null. */
    this.volume = asset.volume;
    this.metadata = asset.metadata;
    /** What of the file is not read, a line each. */
    this.notes = [...asset.notes, ...this.#soundNotes];
  }

  /** The positions of frame k of level 0 by pictures of their own, so that what plays goes on. */
  #positionsBeside(reader, k) {
    this.#beside ??= reader.openPictures();
    const result = this.#queueBeside.then(async () => {
      const pictures = await this.#beside;
      await pictures.seek(k);
      return pictures.current.slice();
    });
    this.#queueBeside = result.catch(() => {});
    return result;
  }

  /** What `work` gives, once the calls before are answered. */
  #queued(work) {
    const result = this.#queue.then(() => {
      if (this.#isClosed) throw closed();
      return work();
    });
    this.#queue = result.catch(() => {});
    return result;
  }

  async #start() {
    if (this.#isClosed) throw closed();
    const { show, rate, loop, ...on } = this.#playing;
    let positions = null; // as long as the shot needs it
    const read = (k) => (positions = this.#read(k, positions?.length === 3 * this.#verticesOf(k) ? positions : null));
    await this.#pictures.play({ ...on, show: (k) => show(read(k), k) }, rate, loop);
  }

  #verticesOf(k) {
    return this.#row ? this.#row.shots[this.shotOf(k)].vertices : this.vertexCount;
  }

  #read(k, given) {
    this.#shown = k;
    if (this.#row) this.#takeShot();
    const positions = given ?? new Float32Array(3 * this.vertexCount);
    positions.set(this.#row ? this.#pictures.current.positions : this.#pictures.current);
    return positions;
  }

  /** Be of the shot of the frame that the clock shows. */
  #takeShot() {
    const { shot, video } = this.#pictures.current;
    if (shot === this.shot && this.#isOfShot) return;
    this.#isOfShot = true;
    this.shot = this.#row.shown = shot;
    this.levels = [video.vertexCount];
    this.vertexCount = video.vertexCount;
    this.triangleCount = video.triangleCount;
    this.indices = video.indices;
    this.basePoints = video.basePoints;
    this.#takeAsset(video);
  }
}

/** Tracks beside the geometry's of a file that is here. */
function companionsOf(file, described) {
  const read = async (offset, length) => file.subarray(offset, offset + length);
  return described.length ? readCompanions(described, file, placesInFile(file, described.length), read) : [];
}

/** @throws {TypeError} it is nothing that can be loaded */
function checkSource(source) {
  const isText = typeof source === "string" ? source !== "" : source instanceof URL;
  if (isText || isRangeSource(source) || source instanceof Blob || source instanceof ArrayBuffer || ArrayBuffer.isView(source)) return;
  const found = source === "" ? "empty" : Object.prototype.toString.call(source).slice(8, -1);
  throw new TypeError(`the source is ${found}; an address, a Blob or bytes are needed`);
}

/**
 * The file, where it is here or has to come as a whole; on a web server in parts: of the stream layout, or the index of a capture.
 *
 * @returns {Promise<Uint8Array|StreamFile|import("./format/shot_layout.js").ShotIndex>}
 */
async function openSource(source, signal) {
  const isAddress = typeof source === "string" || source instanceof URL;
  const isOnServer = isRangeSource(source) || (isAddress && /^https?:$/.test(addressOf(source).protocol));
  return (isOnServer && (await StreamFile.open(source, signal))) || fetchBytes(source, signal);
}

/** The index of a capture that is here, null of another file. */
async function shotsOf(file) {
  const box = findIndex(file);
  return box?.isOfShots ? readShots(new Bytes(file), file, box) : null;
}

async function fetchBytes(source, signal) {
  if (ArrayBuffer.isView(source)) return new Uint8Array(source.buffer, source.byteOffset, source.byteLength);
  if (source instanceof ArrayBuffer) return new Uint8Array(source);
  if (source instanceof Blob) return new Uint8Array(await source.arrayBuffer());
  const remedy = location.protocol === "file:" ? FROM_DISK : "try again";
  const asked = await request(source, signal, { remedy });
  if (asked.response.ok) return asked.bytes();
  throw asked.refused();
}

/** @throws {GeometryVideoError} it is no address */
function addressOf(source) {
  try {
    return new URL(source, location.href);
  } catch {
    throw new GeometryVideoError("load", `${source} is no address`);
  }
}
