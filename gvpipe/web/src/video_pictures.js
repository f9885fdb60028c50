/**
 * The pictures of a geometry video, by the browser's own `<video>`; a canvas gives their luma back exactly.
 *
 * Luma 16..235 (limited range, neutral chroma) comes out of the canvas as a grey of 0..255; the steps are 1.16 apart, so a
 * table undoes the expansion without doubt. Playback follows the video's clock: whoever draws late gets the picture of that
 * moment, and none is queued. A frame is sought in the middle of its time, and checked by what the browser says it shows.
 */

import { GeometryVideoError } from "./format/errors.js";

const LOW = 16;
const HIGH = 235;
const LEVELS = Uint8Array.from({ length: 256 }, (_, grey) => LOW + Math.round((grey * (HIGH - LOW)) / 255));
const SHOWN_WITHIN = 1000; // ms after `seeked` in which the browser says what it shows; in a hidden page it never does

export class VideoPictures {
  /**
   * @param {Blob} file @param {number} fps @param {number} frames
   * @param {[number, number]} size of a picture, pixels
   * @returns {Promise<VideoPictures>}
   */
  static async open(file, fps, frames, size) {
    const pictures = new VideoPictures(file, fps, frames, size);
    try {
      await pictures.#load();
    } catch (error) {
      pictures.close();
      throw error;
    }
    return pictures;
  }

  constructor(file, fps, frames, [width, height]) {
    this.fps = fps;
    this.frames = frames;
    this.width = width;
    this.height = height;
    /** The frame that the video shows; -1: not known. A video that has loaded may have nothing to draw yet. */
    this.shown = -1;
    this.url = URL.createObjectURL(file);
    this.video = Object.assign(document.createElement("video"), { muted: true, playsInline: true, preload: "auto" });
    const canvas = Object.assign(document.createElement("canvas"), { width, height });
    this.context = canvas.getContext("2d", { willReadFrequently: true, alpha: false });
  }

  async #load() {
    const { video } = this;
    if (!video.requestVideoFrameCallback) {
      throw new GeometryVideoError("unsupported", "this browser does not tell which frame it shows; a newer one is needed");
    }
    await new Promise((resolve, reject) => {
      video.addEventListener("loadeddata", resolve, { once: true });
      video.addEventListener("error", () => reject(this.#failure()), { once: true });
      video.src = this.url;
      video.load();
    });
    if (video.videoWidth !== this.width || video.videoHeight !== this.height) {
      const found = `${video.videoWidth}x${video.videoHeight}`;
      throw new GeometryVideoError("corrupt", `its video is ${found} pixels; ${this.width}x${this.height} are needed`);
    }
    const found = video.duration * this.fps; // in units of a thousandth of a second
    if (!(Math.abs(found - this.frames) <= 1 + 0.002 * this.fps)) {
      throw new GeometryVideoError("corrupt", `its video lasts ${found.toFixed(1)} frames, the header says ${this.frames}`);
    }
  }

  #failure() {
    const reason = this.video.error?.message || "H.264 in MP4 is needed";
    return new GeometryVideoError("unsupported", `this browser cannot decode the video: ${reason}`);
  }

  /** Show a frame and wait until it is there. Pauses. */
  async seek(frame) {
    this.pause();
    if (this.shown === frame) return;
    const time = (frame + 0.5) / this.fps;
    for (let attempt = 0; attempt < 3; attempt++) {
      if ((await this.#seekTo(frame, time + (attempt * 0.1) / this.fps)) === frame) {
        this.shown = frame;
        return;
      }
    }
    throw new GeometryVideoError("unsupported", `this browser does not show frame ${frame} when it is asked for`);
  }

  /** Seek, and return the frame that the browser then says it shows; where it says nothing, the one asked for. */
  #seekTo(frame, time) {
    const { video } = this;
    this.shown = -1;
    return new Promise((resolve, reject) => {
      let [handle, timer, shown, arrived] = [0, 0, -1, false];
      const finish = (settle, value) => {
        clearTimeout(timer);
        video.cancelVideoFrameCallback(handle);
        video.removeEventListener("seeked", seeked);
        video.removeEventListener("error", failed);
        settle(value);
      };
      const failed = () => finish(reject, this.#failure());
      const seeked = () => {
        arrived = true;
        if (shown === frame) return finish(resolve, frame);
        const late = () => finish(resolve, shown < 0 || document.hidden ? frame : shown);
        timer = setTimeout(late, SHOWN_WITHIN);
        return undefined;
      };
      const presented = (_, { mediaTime }) => {
        shown = this.#frameAt(mediaTime); // perhaps still the frame from before the seek
        if (arrived && shown === frame) return finish(resolve, frame);
        handle = video.requestVideoFrameCallback(presented);
        return undefined;
      };
      handle = video.requestVideoFrameCallback(presented);
      video.addEventListener("seeked", seeked);
      video.addEventListener("error", failed);
      video.currentTime = time;
    });
  }

  /**
   * Play on from here, `rate` times as fast; `show(frame)` is called for each frame that the browser shows while it is there
   * to be read, `ended()` at the end if it does not loop.
   */
  async play(show, ended, rate, loop) {
    const { video } = this;
    video.playbackRate = rate;
    video.loop = loop;
    this.shown = -1;
    const playing = (this.playing = {});
    const next = (_, { mediaTime }) => {
      if (this.playing !== playing) return;
      const frame = Math.min(this.frames - 1, this.#frameAt(mediaTime));
      if (frame !== this.shown) {
        this.shown = frame;
        show(frame);
      }
      if (!video.ended && !video.paused) video.requestVideoFrameCallback(next);
    };
    video.onended = () => {
      if (this.playing !== playing) return;
      this.pause();
      ended();
    };
    video.requestVideoFrameCallback(next);
    await video.play();
  }

  /** Stop playing; the frame shown last stays. */
  pause() {
    if (!this.playing) return;
    this.playing = null;
    this.video.pause();
    this.shown = -1; // the browser may have gone on to the next picture since
  }

  /** Browsers tell when the frame begins, rounded either way, or (Firefox) the time sought inside it. */
  #frameAt(time) {
    return Math.floor(time * this.fps + 0.25);
  }

  /** @param {Uint32Array} samples indices of a picture's samples @param {Uint8Array} levels filled with theirs, 16..235 */
  gather(samples, levels) {
    this.context.drawImage(this.video, 0, 0);
    const { data } = this.context.getImageData(0, 0, this.width, this.height);
    for (let i = 0; i < samples.length; i++) levels[i] = LEVELS[data[4 * samples[i]]];
  }

  close() {
    this.playing = null;
    this.video.removeAttribute("src");
    this.video.load();
    URL.revokeObjectURL(this.url);
  }
}
