/** The pictures of a moving texture by the browser's own `<video>`, where it has no WebCodecs: each is sought, and then drawn. */

import { closed } from "../format/request.js";
import { VideoPictures } from "../video_pictures.js";
import { RepeatedFrames } from "../format/repeated_frames.js";
import { KeptPictures } from "./kept_pictures.js";

const BYTES_PER_PIXEL = 4;
const UNCHANGED = { imageOrientation: "none", premultiplyAlpha: "none" };

export class SoughtTrack {
  #turn = Promise.resolve();
  #isClosed = false;

  /** @param {Uint8Array} file of the track alone @param {number} fps @param {number} count of pictures @param {[number, number]} size */
  static async open(file, fps, count, [width, height]) {
    const even = [width + (width % 2), height + (height % 2)];
    const read = (video) => createImageBitmap(video, 0, 0, width, height, UNCHANGED);
    const video = await VideoPictures.open(file, fps, new RepeatedFrames(count), even, null, null, read);
    return new SoughtTrack(video, count, [width, height]);
  }

  constructor(video, count, [width, height]) {
    this.video = video;
    this.kept = new KeptPictures(count, BYTES_PER_PIXEL * width * height);
    this.kept.add(0, video.current);
  }

  /** A promise that a frame's picture is here. Of many calls in a row those are passed over whose picture is no longer wanted. */
  ready(frame) {
    if (this.#isClosed) return Promise.reject(closed());
    this.kept.want(frame);
    if (this.kept.has(frame)) return Promise.resolve();
    const done = this.#turn.then(async () => {
      if (this.#isClosed) throw closed();
      if (this.kept.has(frame)) return;
      await this.video.seek(frame);
      if (this.#isClosed) this.video.current.close();
      else this.kept.add(frame, this.video.current);
    });
    this.#turn = done.catch(() => {});
    return done;
  }

  /** The picture of a frame, for as long as no other is asked for; null if it is not here. @returns {ImageBitmap|null} */
  show(frame) {
    return this.kept.show(frame);
  }

  close() {
    this.#isClosed = true;
    this.kept.close(closed());
    this.video.close();
  }
}
