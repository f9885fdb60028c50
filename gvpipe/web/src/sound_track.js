/**
 * The sound of a video, in step with its frames. While it is heard, its clock leads; else frames have their own.
 *
 * A muted sound does not play: browsers let a page start silent films alone. Where they refuse to play it, it becomes muted.
 */

const FAR = 0.3; // s between what is heard and what is shown, where neither waits for the other
const NEAR = 0.05; // s: closer, a sound that plays on is not sought
const GUESSED = 100; // ms that its time is guessed, between two of those that the browser tells
const ASKED = 500; // ms after which nobody asks for its time: who shows frames has another clock

export class SoundTrack {
  #audio = new Audio();
  #fps;
  #frames;
  #on;
  #isWanted = false; // whether frames play
  #hasFailed = false;
  #loops = false;
  #told = -1; // s, what the browser told last
  #toldAt = 0; // ms
  #askedAt = -Infinity;
  #shown = 0; // the frame shown last
  #muted = false;

  /**
   * @param {{url: string}} sound of a video @param {number} fps @param {number} frames of the film
   * @param {{blocked: () => void, failed: () => void}} on the browser refused to play it unmuted; it cannot be played at all
   */
  constructor({ url }, fps, frames, on) {
    this.#fps = fps;
    this.#frames = frames;
    this.#on = on;
    this.#audio.preload = "metadata";
    this.#audio.addEventListener("error", () => this.#fail());
    this.#audio.src = url;
  }

  get muted() {
    return this.#muted;
  }

  set muted(muted) {
    if (this.#muted === muted) return;
    this.#muted = muted;
    if (muted) this.#audio.pause();
    else if (this.#isWanted) this.#play(this.#shown);
  }

  get volume() {
    return this.#audio.volume;
  }

  set volume(volume) {
    this.#audio.volume = volume;
  }

  /** Ask the browser, while a click is fresh, whether it may play. @throws {DOMException} NotAllowedError */
  async prime() {
    if (this.#muted || this.#hasFailed) return;
    const asked = this.#audio.play();
    this.#audio.pause(); // until frames are there
    try {
      await asked;
    } catch (error) {
      if (error.name === "NotAllowedError") throw error;
    }
  }

  /** Go with frames that play from one on. */
  start(frame, rate, loops) {
    this.#isWanted = true;
    this.#loops = loops;
    this.#audio.playbackRate = rate;
    this.#shown = frame;
    if (!this.#muted) this.#play(frame);
  }

  stop() {
    this.#isWanted = false;
    this.#audio.pause();
  }

  /**
   * The frames since the start that are due by what is heard; null: it does not lead. Never before `position`: frames wait.
   *
   * @param {number} position frames since the start, as the film has come @returns {number|null}
   */
  clock(position) {
    this.#askedAt = performance.now();
    if (!this.#leads) return null;
    const heard = this.#heard() * this.#fps;
    if (heard >= this.#frames && this.#loops) {
      this.#seek((heard - this.#frames) / this.#fps);
      return heard;
    }
    if (position - heard > FAR * this.#fps) {
      this.#seek(position / this.#fps);
      return null;
    }
    return Math.max(position, heard);
  }

  /** That a frame is shown. */
  follow(frame) {
    const isAgain = frame < this.#shown;
    this.#shown = frame;
    if (!this.#isWanted || this.#muted || this.#hasFailed || this.#audio.seeking) return;
    const time = frame / this.#fps;
    if (isAgain && !this.#leads) this.#play(frame);
    else if (performance.now() - this.#askedAt > ASKED && Math.abs(this.#audio.currentTime - time) > FAR) this.#seek(time);
  }

  close() {
    this.stop();
    this.#hasFailed = true;
    this.#audio.removeAttribute("src");
    this.#audio.load();
  }

  get #leads() {
    const { paused, ended, seeking, readyState } = this.#audio;
    return !(paused || ended || seeking || this.#muted || this.#hasFailed) && readyState >= 3 && this.#audio.currentTime > 0;
  }

  /** Seconds: what the browser told, and what has gone by since, as some tell it seldom. */
  #heard() {
    const [time, now] = [this.#audio.currentTime, performance.now()];
    if (time !== this.#told) [this.#told, this.#toldAt] = [time, now];
    return time + (Math.min(now - this.#toldAt, GUESSED) * this.#audio.playbackRate) / 1000;
  }

  async #play(frame) {
    if (this.#hasFailed) return;
    const time = frame / this.#fps;
    const { duration, currentTime } = this.#audio;
    if (time >= duration) return; // it has ended
    if (this.#audio.paused || this.#audio.ended || Math.abs(currentTime - time) > NEAR) this.#seek(time);
    try {
      await this.#audio.play();
    } catch (error) {
      if (error.name === "NotAllowedError") this.#on.blocked();
      else if (error.name !== "AbortError") this.#fail();
    }
  }

  #seek(time) {
    this.#told = -1;
    this.#audio.currentTime = time;
  }

  #fail() {
    if (this.#hasFailed) return;
    this.#hasFailed = true;
    this.#audio.pause();
    this.#on.failed();
  }
}
