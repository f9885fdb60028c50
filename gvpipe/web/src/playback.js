/**
 * Playing a video as `HTMLMediaElement` does, for whatever shows positions: the element and the mesh of three.js share it.
 *
 * Times are seconds. A frame's time is where it begins; the time is the duration once playing has ended.
 */

import { LevelChooser } from "./level_chooser.js";
import { closed } from "./format/request.js";
import { checkRate } from "./playback_rate.js";
import { SoundTrack } from "./sound_track.js";

const ROUNDING = 1e-4; // of a frame: k / fps * fps may be a little less than k
/** What `play` is rejected with. */
export function paused() {
  return new DOMException("it was paused before it played", "AbortError");
}

/** Seconds, as a number. @throws {TypeError} it is none */
export function checkSeconds(value, name) {
  if (Number.isFinite(Number(value))) return Number(value);
  throw new TypeError(`${name} is ${value}; a number of seconds is needed`);
}

/** @throws {TypeError} it is no number @throws {DOMException} an IndexSizeError: it is not from 0 to 1 */
export function checkVolume(volume) {
  const wanted = Number(volume);
  if (!Number.isFinite(wanted)) throw new TypeError(`the volume is ${volume}; a number from 0 to 1 is needed`);
  if (wanted < 0 || wanted > 1) throw new DOMException(`the volume is ${wanted}; 0 to 1 is needed`, "IndexSizeError");
  return wanted;
}

export class Playback {
  #video;
  #on;
  #nextTick;
  #wanted = null; // the frame that is to be sought next
  #aim; // the frame that was wanted last
  #seeking = null; // promise
  #rate = 1;
  #loops = false;
  #isClosed = false;
  #error = null; // that ended it last
  #beginning = null; // a promise that it plays
  #giveUp = () => {}; // rejects it
  #starting = null; // what `#start` is for
  #plays = false; // whether `playing` was told since it last did not
  #chooser = null; // LevelChooser, where levels are chosen here
  #isChanging = false; // to the level that it wants
  #sound = null; // SoundTrack
  #muted = false;
  #volume = 1;

  /** The frame shown. */
  currentFrame;
  paused = true;
  /** Whether it played to the end, and was not sought since. */
  ended = false;

  /**
   * @param {import("./geometry_video.js").GeometryVideo} video
   * @param {{show: (positions: Float32Array, k: number) => void, prepare: (k: number) => Promise<void>, tell: (event: string) => void,
   *   fail: (error: Error) => void, silent?: () => void}} on `silent`: the browser cannot play the sound; `prepare` loads what is shown beside positions of a frame that is sought; `tell` is given
   *   names of `HTMLMediaElement`'s events
   * @param {(tick: (now: number) => void) => void} [nextTick] of `GeometryVideo.play`
   */
  constructor(video, on, nextTick) {
    this.#video = video;
    this.#on = on;
    this.#nextTick = nextTick;
    this.currentFrame = this.#aim = video.startFrame ?? 0;
    if (!video.sound || typeof Audio !== "function") return;
    const blocked = () => (this.muted = true);
    this.#sound = new SoundTrack(video.sound, video.fps, video.frameCount, { blocked, failed: () => on.silent?.() });
  }

  /** Whether what plays is silent. */
  get muted() {
    return this.#muted;
  }

  set muted(muted) {
    if (this.#muted === Boolean(muted)) return;
    this.#muted = Boolean(muted);
    if (this.#sound) this.#sound.muted = this.#muted;
    this.#on.tell("volumechange");
  }

  /** 0 to 1. */
  get volume() {
    return this.#volume;
  }

  set volume(volume) {
    const wanted = checkVolume(volume);
    if (this.#volume === wanted) return;
    this.#volume = wanted;
    if (this.#sound) this.#sound.volume = wanted;
    this.#on.tell("volumechange");
  }

  get duration() {
    return this.#video.duration;
  }

  /** To set it shows the frame of that time; what plays goes on there. */
  get currentTime() {
    return this.ended ? this.duration : this.aim / this.#video.fps;
  }

  set currentTime(seconds) {
    this.#request(Math.floor(checkSeconds(seconds, "currentTime") * this.#video.fps + ROUNDING));
  }

  /** The frame shown, or the one that is sought. */
  get aim() {
    return this.#seeking ? this.#aim : this.currentFrame;
  }

  get seeking() {
    return this.#seeking !== null;
  }

  get loop() {
    return this.#loops;
  }

  set loop(loops) {
    if (this.#loops === loops) return;
    this.#loops = loops;
    this.#playAnew();
  }

  /** 1 is the video's own. */
  get playbackRate() {
    return this.#rate;
  }

  set playbackRate(rate) {
    const wanted = checkRate(rate);
    if (this.#rate === wanted) return;
    this.#rate = wanted;
    this.#on.tell("ratechange");
    this.#playAnew();
  }

  /** Whether the level of detail follows what the page can do while it plays. */
  get choosesLevel() {
    return this.#chooser !== null;
  }

  set choosesLevel(isWanted) {
    this.#chooser = isWanted && this.#video.levels.length > 1 ? new LevelChooser(this.#video.levels) : null;
  }

  /** Show another level of detail; what plays goes on. @throws {GeometryVideoError} */
  async setLevel(level) {
    await this.#video.setLevel(level);
    if (this.#isClosed || !this.paused || this.#seeking) return; // what plays, or is sought, is of that level
    const k = this.currentFrame;
    const positions = await this.#video.frame(k);
    if (!this.#isClosed && this.#isCurrent(positions, k)) this.#on.show(positions, k);
  }

  /** Whether positions are of the level and the shot that are shown: these may have changed since they were asked for. */
  #isCurrent(positions, k) {
    return positions.length === 3 * this.#video.vertexCount && this.#video.shotOf(k) === this.#video.shot;
  }

  /**
   * Play on from the frame shown; from the start if that is the last.
   *
   * @throws {Error} what ended it before it played; an AbortError: it was paused
   */
  async play() {
    if (this.#isClosed) throw closed();
    if (!this.paused) return this.#beginning;
    this.paused = false;
    this.#error = null;
    const allowed = this.#sound?.prime(); // at once, as browsers ask
    this.#on.tell("play");
    if (this.aim === this.#video.frameCount - 1 && !this.#video.isLive) this.#request(0);
    this.#beginning = new Promise((resolve, reject) => {
      this.#giveUp = reject;
      this.#begin(allowed).then(resolve, reject);
    });
    return this.#beginning;
  }

  async #begin(allowed) {
    try {
      await allowed;
    } catch (error) {
      this.#error = error;
      this.pause();
      throw error;
    }
    if (this.paused) throw this.#error ?? paused();
    await (this.#seeking ?? this.#start());
    if (this.paused && !this.ended) throw this.#error ?? paused();
  }

  pause() {
    this.#video.pause();
    this.#sound?.stop();
    if (this.paused) return;
    this.paused = true;
    this.#plays = false;
    this.#giveUp(this.#error ?? paused());
    this.#on.tell("pause");
  }

  /** Show frame k, and pause. Of many calls in a row the last counts. */
  seek(k) {
    this.pause();
    return this.#request(Math.round(k));
  }

  close() {
    this.#isClosed = true;
    this.paused = true;
    this.#giveUp(closed());
    this.#wanted = null;
    this.#sound?.close();
  }

  #request(k) {
    if (this.#isClosed) return Promise.resolve();
    this.ended = false;
    this.#aim = this.#wanted = Math.max(0, Math.min(this.#video.frameCount - 1, k || 0));
    this.#seeking ??= this.#seekWanted();
    this.#plays = false;
    this.#sound?.stop();
    this.#on.tell("seeking");
    return this.#seeking;
  }

  async #seekWanted() {
    try {
      while (this.#wanted !== null) {
        const k = this.#wanted;
        this.#wanted = null;
        const [positions] = await Promise.all([this.#video.frame(k), this.#on.prepare(k)]);
        if (this.#isClosed) return;
        if (this.#isCurrent(positions, k)) this.#show(positions, k);
        else this.#wanted ??= k;
      }
    } catch (error) {
      this.#fail(error);
      return;
    } finally {
      this.#seeking = null;
    }
    this.#on.tell("seeked");
    if (!this.paused) await this.#start();
  }

  /** With a new rate or `loop`. */
  #playAnew() {
    if (!this.paused && !this.#seeking) this.#start();
  }

  async #start() {
    const on = {
      rate: this.#rate,
      loop: this.#loops,
      ended: () => this.#end(),
      failed: (error) => this.#fail(error),
      nextTick: this.#nextTick,
      ticked: (now, isThere) => this.#chooseLevel(now, isThere),
      waits: (isWaiting) => this.#tellWaiting(isWaiting),
      clock: this.#sound ? (position) => this.#sound.clock(position) : undefined,
    };
    const starting = (this.#starting = {});
    try {
      await this.#video.play((positions, k) => this.#show(positions, k), on);
      if (this.#starting !== starting) return; // it was started again
      if (this.paused) {
        this.#video.pause(); // since
        return;
      }
      this.#sound?.start(this.currentFrame, this.#rate, this.#loops);
      this.#tellPlaying();
    } catch (error) {
      if (error.name === "AbortError") return; // paused before the browser had begun
      if (error.name === "NotAllowedError") this.pause();
      else this.#fail(error);
    }
  }

  #tellWaiting(isWaiting) {
    if (!isWaiting) {
      this.#sound?.start(this.currentFrame, this.#rate, this.#loops);
      return this.#tellPlaying();
    }
    this.#sound?.stop();
    this.#plays = false;
    return this.#on.tell("waiting");
  }

  #tellPlaying() {
    if (this.#plays) return;
    this.#plays = true;
    this.#on.tell("playing");
  }

  #chooseLevel(now, isThere) {
    const chooser = this.#chooser;
    if (!chooser || this.#isChanging) return;
    if (this.#video.isWaiting) {
      chooser.restart();
      return;
    }
    const { level, fps } = this.#video;
    const wanted = chooser.step(now, level, isThere, 1000 / (fps * this.#rate));
    if (wanted === level) return;
    this.#isChanging = true;
    this.setLevel(wanted)
      .catch((error) => this.#fail(error))
      .finally(() => {
        this.#isChanging = false;
        chooser.restart();
      });
  }

  #show(positions, k) {
    this.currentFrame = k;
    this.#sound?.follow(k);
    this.#on.show(positions, k);
    this.#on.tell("timeupdate");
  }

  #end() {
    this.paused = true;
    this.#sound?.stop();
    this.#plays = false;
    this.ended = true;
    for (const event of ["timeupdate", "pause", "ended"]) this.#on.tell(event);
  }

  #fail(error) {
    if (this.#isClosed) return;
    this.#error = error;
    if (!this.paused) this.pause();
    this.#on.fail(error);
  }
}
