/**
 * The pictures of a geometry video by the browser's own `<video>`, where it has no WebCodecs; a canvas gives their luma back.
 *
 * Luma 16..235 (limited range, neutral chroma) comes out of the canvas as a grey of 0..255, which a table undoes. A frame is
 * sought in the middle of its time, and checked by what the browser says it shows.
 *
 * Chromium plays: the video's clock leads, and whoever draws late gets the picture of that moment. It loops by seeking. Firefox
 * announces other pictures than it draws while it plays (and times that go on growing where the element loops by itself), so
 * there every frame that is due is sought. So it is in every browser where frames repeat: the video has each picture once, and its
 * clock knows of no repeated frames (`format/repeated_frames.js`).
 */

import { nextRepaint } from "./decoded_pictures.js";
import { GeometryVideoError } from "./format/errors.js";
import { closed } from "./format/request.js";
import { OF_GREY } from "./levels.js";

const SHOWN_WITHIN = 1000; // ms after `seeked` in which the browser says what it shows; in a hidden page it never does

export class VideoPictures {
  /**
   * @param {Uint8Array} file @param {number} fps @param {import("./format/repeated_frames.js").RepeatedFrames} repeated
   * @param {[number, number]} size of a picture, pixels @param {Uint32Array} samples indices of the samples that are read
   * @param {import("./decoded_pictures.js").Finish|null} finish
   * @param {((video: HTMLVideoElement) => Promise<object>)|null} read in place of levels
   * @returns {Promise<VideoPictures>}
   */
  static async open(file, fps, repeated, size, samples, finish, read = null) {
    const pictures = new VideoPictures(file, fps, repeated, size, samples, finish, read);
    try {
      await pictures.#load();
      await pictures.seek(0);
    } catch (error) {
      pictures.close();
      throw error;
    }
    return pictures;
  }

  constructor(file, fps, repeated, [width, height], samples, finish, read = null) {
    this.fps = fps;
    this.repeated = repeated;
    this.frames = repeated.frames;
    this.hasRepeats = repeated.distinct < repeated.frames;
    /** The frame shown last, where frames are sought. */
    this.frame = 0;
    this.width = width;
    this.height = height;
    this.samples = samples;
    this.finish = finish;
    this.read = read;
    /** Of a frame, what must be here before it is shown. @type {((frame: number) => Promise<unknown>)|null} */
    this.beside = null;
    /** Of the frame shown the levels of its picture (S, 3), or what `finish` made of them. */
    this.current = null;
    /** The picture that the video shows; -1: not known. A video that has loaded may have nothing to draw yet. */
    this.shown = -1;
    this.url = URL.createObjectURL(new Blob([file], { type: "video/mp4" }));
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
    const { distinct } = this.repeated;
    if (!(Math.abs(found - distinct) <= 1 + 0.002 * this.fps)) {
      throw new GeometryVideoError("corrupt", `its video lasts ${found.toFixed(1)} pictures in place of ${distinct}`);
    }
  }

  #failure() {
    const reason = this.video.error?.message || "no more is known";
    const remedy = "a browser with a decoder for H.264 is needed (on Linux, install FFmpeg's: for WebKitGTK gstreamer1.0-libav)";
    return new GeometryVideoError("unsupported", `this browser cannot decode the video: ${reason}; ${remedy}`);
  }

  /** Show a frame and wait until it is there. Pauses. */
  async seek(frame) {
    this.pause();
    this.frame = frame;
    const picture = this.repeated.distinctOf(frame);
    if (this.shown !== picture) await this.#reach(picture);
    await this.#take(picture, frame);
  }

  /** Have what is shown of the picture that the video shows now. */
  async #take(picture, frame) {
    const levels = this.read ? await this.read(this.video) : this.#levels();
    this.current = await this.#finished(picture, levels, frame);
  }

  async #finished(picture, levels, frame) {
    const [finished] = await Promise.all([this.finish ? this.finish(picture, levels) : levels, this.beside?.(frame)]);
    return finished;
  }

  async #reach(picture) {
    const time = (picture + 0.5) / this.fps;
    const reaching = (this.reaching = {});
    for (let attempt = 0; attempt < 3; attempt++) {
      const found = await this.#seekTo(picture, time + (attempt * 0.1) / this.fps);
      if (this.reaching !== reaching) return; // another one is sought since
      if (found === picture) {
        this.shown = picture;
        return;
      }
    }
    throw new GeometryVideoError("unsupported", `this browser does not show picture ${picture} when it is asked for`);
  }

  /** Seek, and return the picture that the browser then says it shows; where it says nothing, the one asked for. */
  #seekTo(picture, time) {
    const { video } = this;
    this.shown = -1;
    return new Promise((resolve, reject) => {
      let [handle, timer, shown, arrived] = [0, 0, -1, false];
      const finish = (settle, value) => {
        clearTimeout(timer);
        video.cancelVideoFrameCallback(handle);
        video.removeEventListener("seeked", seeked);
        video.removeEventListener("error", failed);
        video.removeEventListener("emptied", emptied);
        settle(value);
      };
      const failed = () => finish(reject, this.#failure());
      const emptied = () => finish(reject, closed());
      const seeked = () => {
        arrived = true;
        if (shown === picture) return finish(resolve, picture);
        const late = () => finish(resolve, shown < 0 || document.hidden ? picture : shown);
        timer = setTimeout(late, SHOWN_WITHIN);
        return undefined;
      };
      const presented = (_, { mediaTime }) => {
        shown = this.#pictureAt(mediaTime); // perhaps still the one from before the seek
        if (arrived && shown === picture) return finish(resolve, picture);
        handle = video.requestVideoFrameCallback(presented);
        return undefined;
      };
      handle = video.requestVideoFrameCallback(presented);
      video.addEventListener("seeked", seeked);
      video.addEventListener("error", failed);
      video.addEventListener("emptied", emptied);
      video.currentTime = time;
    });
  }

  /**
   * Play on from here, `rate` times as fast; calls `show(frame)` for each frame that the browser shows while it is there to be
   * read, `ended()` at the end if it does not loop, `failed(error)` if it cannot go on. With `nextTick`, a clock that calls
   * `tick(ms)` at its next step, every frame that is due is sought.
   */
  async play(on, rate, loop) {
    const { video } = this;
    const playing = (this.playing = {});
    const playBySeeking = (first) =>
      this.#playBySeeking(playing, first, on, rate, loop).catch((error) => this.playing === playing && on.failed(error));
    if (this.hasRepeats || on.nextTick) {
      playBySeeking(this.frame);
      return;
    }
    video.playbackRate = rate;
    this.shown = -1;
    let latest = null; // {frame, levels} that the video has shown last, and that is not shown yet
    let working = null; // a promise
    const fail = (error) => this.playing === playing && on.failed(error);
    const work = async () => {
      while (latest && this.playing === playing) {
        const { frame, levels } = latest;
        latest = null;
        this.current = await this.#finished(frame, levels, frame);
        if (this.playing === playing) on.show(frame);
      }
    };
    const next = (_, { mediaTime }) => {
      if (this.playing !== playing) return;
      const frame = Math.min(this.frames - 1, this.#pictureAt(mediaTime));
      if (frame > 0) this.tellsFrames ??= this.#tellsFrames();
      if (this.tellsFrames === false) {
        video.pause();
        playBySeeking(frame);
        return;
      }
      if (frame !== this.shown) {
        this.shown = frame;
        try {
          latest = { frame, levels: this.#levels() };
        } catch (error) {
          fail(error);
          return;
        }
        working ??= work()
          .catch(fail)
          .finally(() => (working = null));
      }
      video.requestVideoFrameCallback(next);
    };
    video.onended = async () => {
      await working;
      if (this.playing !== playing || this.tellsFrames === false) return;
      if (loop) {
        video.currentTime = 0;
        video.play().catch((error) => this.playing === playing && on.failed(error));
        return;
      }
      this.pause();
      on.ended();
    };
    video.requestVideoFrameCallback(next);
    await video.play();
  }

  /** The same by seeking to whatever is due: slower, and exact where it is not known which picture of a playing video is drawn. */
  async #playBySeeking(playing, first, { show, ended, nextTick = nextRepaint }, rate, loop) {
    let now = await new Promise(nextTick);
    const start = now;
    let before = this.hasRepeats ? -1 : this.shown;
    while (this.playing === playing) {
      const due = first + Math.floor(((now - start) * this.fps * rate) / 1000);
      const frame = loop ? due % this.frames : Math.min(due, this.frames - 1);
      if (frame !== before) {
        const picture = this.repeated.distinctOf(frame);
        if (picture !== this.shown) {
          await this.#reach(picture);
          if (this.playing !== playing) return;
        }
        await this.#take(picture, frame);
        if (this.playing !== playing) return;
        this.frame = before = frame;
        show(frame);
      }
      if (!loop && due >= this.frames && this.playing === playing) {
        this.pause();
        ended();
        return;
      }
      now = await new Promise(nextTick);
    }
  }

  /** Whether pictures tell their times: then the one drawn is the one announced. Firefox' do not, and it draws others too. */
  #tellsFrames() {
    if (typeof VideoFrame !== "function") return !("mozHasAudio" in this.video);
    const picture = new VideoFrame(this.video);
    const { timestamp } = picture;
    picture.close();
    return this.#pictureAt(timestamp / 1e6) > 0;
  }

  /** Stop playing; the frame shown last stays. */
  pause() {
    if (!this.playing) return;
    this.playing = null;
    if (this.hasRepeats) return; // it never played
    this.video.pause();
    this.shown = -1; // the browser may have gone on to the next picture since
  }

  /** Browsers tell when the picture begins, rounded either way, or (Firefox) the time sought inside it. */
  #pictureAt(time) {
    return Math.floor(time * this.fps + 0.25);
  }

  /** `Uint8Array` (S, 3): the levels of the picture that the video shows now. */
  #levels() {
    this.context.drawImage(this.video, 0, 0);
    const levels = new Uint8Array(this.samples.length);
    const { data } = this.context.getImageData(0, 0, this.width, this.height);
    let lowest = 255;
    for (let i = 0; i < levels.length; i++) {
      levels[i] = OF_GREY[data[4 * this.samples[i]]];
      lowest = Math.min(lowest, levels[i]);
    }
    if (lowest === 0) {
      const message = "this browser changes the colours of a video, and has no WebCodecs to read them by; use a newer one";
      throw new GeometryVideoError("unsupported", message);
    }
    return levels;
  }

  close() {
    this.playing = null;
    this.video.removeAttribute("src");
    this.video.load();
    URL.revokeObjectURL(this.url);
  }
}
