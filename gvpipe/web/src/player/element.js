/**
 * The player as an element: `<geometry-video src="walk.mp4" autoplay loop></geometry-video>`.
 *
 * Attributes: `src` (an address, or `#id` of an element in the page that holds the file as base64 text), `autoplay` (not for
 * those who prefer reduced motion), `loop`, `wireframe`, `follow` (the camera goes with the mesh), `speed` (1 is the video's
 * own), `up` ("y", or "z"), `field` (the name of one that is shown in colours), `colormap`, `range` ("low,high" of the colours).
 * Events: `ready`, `frame` (detail: the frame's number), `ended`, `error` (detail: a `GeometryVideoError`).
 */

import { GeometryVideo, GeometryVideoError } from "../geometry_video.js";
import { Bar, nextSpeed } from "./bar.js";
import { embedded } from "./embedded.js";
import { COLORMAPS } from "./colormaps.js";
import { actionOf } from "./keys.js";
import { Legend } from "./legend.js";
import { isFullscreen, save, toggleFullscreen } from "./outside.js";
import { Panel } from "./panel.js";
import { Stage } from "./stage.js";
import style from "./style.css";

const LABEL = "Animated mesh; shift and arrow keys turn it, + and - zoom";
const MARKUP = `<style>${style}</style>
  <div class="stage">
    <canvas tabindex="0" role="img" aria-label="${LABEL}"></canvas>
    <div class="legend" hidden></div>
    <div class="panel"></div>
    <div class="message" role="status"></div>
  </div>
  <div class="bar" role="group" aria-label="Playback"></div>`;
const TURN = Math.PI / 18; // by one press of a key
const ZOOM = 1.15;

export class GeometryVideoElement extends HTMLElement {
  static observedAttributes = ["src", "loop", "wireframe", "follow", "speed", "field", "colormap", "range"];

  #stage = null;
  #bar;
  #panel;
  #legend;
  #message;
  #loading = 0; // counts loads, so that a late one does not replace its successor
  #positions = null;
  #wanted = null; // the frame that is to be sought next
  #aim = 0; // the frame that was wanted last
  #seeking = null;
  #resume = false; // whether to play on when the slider is let go
  #field = null; // that is shown
  #hidden = new Set(); // names of parts

  /** The `GeometryVideo` that is shown, or null. */
  video = null;
  currentFrame = 0;
  paused = true;

  constructor() {
    super();
    const root = this.attachShadow({ mode: "open" });
    root.innerHTML = MARKUP;
    this.#message = root.querySelector(".message");
    this.#bar = new Bar(root.querySelector(".bar"), {
      act: (name) => this.#act(name),
      seek: (frame, done) => this.#scrub(frame, done),
      speed: (speed) => this.setAttribute("speed", speed),
    });
    this.#panel = new Panel(root.querySelector(".panel"), {
      field: (name) => (name ? this.setAttribute("field", name) : this.removeAttribute("field")),
      colormap: (name) => this.setAttribute("colormap", name),
      hide: (names) => this.hide(names),
    });
    this.#legend = new Legend(root.querySelector(".legend"));
    this.#bar.setEnabled(false);
    root.addEventListener("keydown", (event) => this.#onKey(event));
    if (!document.fullscreenEnabled) this.#bar.hide("fullscreen"); // phones may show films alone so
    this.addEventListener("fullscreenchange", () => this.#bar.setPressed("fullscreen", isFullscreen(this)));
  }

  connectedCallback() {
    if (this.hasAttribute("src") && !this.video) this.load(this.getAttribute("src"));
  }

  disconnectedCallback() {
    this.#unload();
    this.#stage?.close();
    this.#stage = null;
    const canvas = this.shadowRoot.querySelector("canvas");
    canvas.replaceWith(canvas.cloneNode()); // its WebGL context is gone for good
  }

  attributeChangedCallback(name, before, value) {
    if (name === "src" && before !== value && this.isConnected && value !== null) this.load(value);
    if (["loop", "wireframe", "follow"].includes(name)) this.#bar.setPressed(name, value !== null);
    if (name === "wireframe") this.#stage?.setWireframe(value !== null);
    if (name === "follow") this.#stage?.setFollowing(value !== null);
    if (name === "speed") this.#bar.setSpeed(this.speed);
    if (["field", "colormap", "range"].includes(name) && before !== value && this.video) this.#showField();
    if ((name === "loop" || name === "speed") && !this.paused) this.play(); // with the new value
  }

  get src() {
    return this.getAttribute("src") ?? "";
  }

  set src(source) {
    this.setAttribute("src", source);
  }

  get speed() {
    const speed = Number(this.getAttribute("speed") ?? 1);
    return speed >= 0.0625 && speed <= 16 ? speed : 1; // what browsers play
  }

  /** The colour map of fields, one of `COLORMAPS`. */
  get colormap() {
    const name = this.getAttribute("colormap");
    return COLORMAPS.includes(name) ? name : COLORMAPS[0];
  }

  /** Low and high of the colours, or null: the field's own. */
  get range() {
    const numbers = (this.getAttribute("range") ?? "").split(",").map(Number);
    return numbers.length === 2 && numbers[0] < numbers[1] ? numbers : null;
  }

  /** Names of the parts that are hidden. */
  get hiddenParts() {
    return new Set(this.#hidden);
  }

  /** Hide the parts of these names, and show all others. @param {Iterable<string>} names */
  hide(names) {
    this.#hidden = new Set(names);
    if (!this.video) return;
    this.#stage?.setHidden(this.#hidden);
    this.#panel.setHidden(this.#hidden);
  }

  /** 16 numbers, a (4, 4) matrix by columns: from model units to the picture's clip space, for those who draw over it. */
  get projection() {
    return this.video ? Array.from(this.#stage.projection) : null;
  }

  /** Load and show a file: an address, `#id`, or the file itself. Errors are shown in the element. */
  async load(source) {
    this.#unload();
    const loading = this.#loading;
    this.#say("Loading …");
    let video = null;
    try {
      video = await GeometryVideo.load(typeof source === "string" && source[0] === "#" ? embedded(source) : source);
      if (loading !== this.#loading) return video.close();
      const positions = await video.frame(0);
      if (loading !== this.#loading) return video.close();
      this.#stage ??= openStage(this.shadowRoot.querySelector("canvas"));
      await this.#stage.setMesh(video, positions, this.getAttribute("up") ?? (video.metadata.up_axis === "z" ? "z" : "y"));
      if (loading !== this.#loading) return video.close();
      this.#positions = positions;
    } catch (error) {
      video?.close();
      if (loading === this.#loading) this.#fail(error);
      return undefined;
    }
    this.video = video;
    this.#stage.setWireframe(this.hasAttribute("wireframe"));
    this.#stage.setFollowing(this.hasAttribute("follow"));
    this.#say("");
    const { model } = this.#stage;
    model.onError = (error) => this.#fail(error);
    this.#bar.setVideo(this.video);
    this.#bar.setNotes([...this.video.notes, ...model.notes]);
    this.#panel.setVideo(this.video, model.parts.names);
    this.hide(this.#hidden);
    await this.#showField();
    if (loading !== this.#loading) return undefined;
    this.#bar.setEnabled(true);
    this.#show(0);
    this.dispatchEvent(new CustomEvent("ready"));
    if (this.hasAttribute("autoplay") && !matchMedia("(prefers-reduced-motion: reduce)").matches) this.play();
    return undefined;
  }

  /** Play on from the frame shown; from the start if that is the last. */
  async play() {
    const { video } = this;
    if (!video) return;
    try {
      if (this.paused && this.currentFrame === video.frameCount - 1) await this.seek(0);
      this.#setPaused(false);
      const show = (positions, frame) => {
        this.#stage.setPositions(positions, frame);
        this.#show(frame);
      };
      const ended = () => {
        this.#setPaused(true);
        this.dispatchEvent(new CustomEvent("ended"));
      };
      const failed = (error) => video === this.video && this.#fail(error);
      await video.play(show, { rate: this.speed, loop: this.hasAttribute("loop"), ended, failed });
    } catch (error) {
      if (error.name === "AbortError") return; // paused before the browser had begun
      if (error.name === "NotAllowedError") this.#setPaused(true);
      else if (video === this.video) this.#fail(error);
    }
  }

  pause() {
    this.video?.pause();
    this.#setPaused(true);
  }

  /** Show a frame, and pause. Of many calls in a row the last counts. */
  seek(frame) {
    if (!this.video) return Promise.resolve();
    this.#setPaused(true);
    this.#aim = this.#wanted = Math.max(0, Math.min(this.video.frameCount - 1, Math.round(frame)));
    this.#seeking ??= this.#seekWanted().finally(() => (this.#seeking = null));
    return this.#seeking;
  }

  async #seekWanted() {
    while (this.#wanted !== null) {
      const [video, frame] = [this.video, this.#wanted];
      this.#wanted = null;
      try {
        await Promise.all([video.frame(frame, this.#positions), this.#field?.load(frame)]);
        if (video !== this.video) return;
        this.#stage.setPositions(this.#positions, frame);
        this.#show(frame);
      } catch (error) {
        if (video === this.video) this.#fail(error);
        return;
      }
    }
  }

  /** Show the field of attribute `field`, if the video has it, or else the materials. */
  async #showField() {
    const { video } = this;
    const field = video.fields.get(this.getAttribute("field")) ?? null;
    this.#field = field;
    this.#say(field ? `Decoding ${field.name} …` : "");
    try {
      await field?.load(this.currentFrame);
    } catch (error) {
      if (video === this.video) this.#fail(error);
      return;
    }
    if (video !== this.video || field !== this.#field || !this.#stage?.model) return;
    this.#say("");
    const range = this.#stage.setField(field, this.colormap, this.range);
    const hasMap = field !== null && field.kind !== "color";
    this.#panel.setField(field?.name ?? "", this.colormap, hasMap);
    if (hasMap) this.#legend.show(field, this.colormap, range);
    else this.#legend.hide();
  }

  /** Steps in a row add up, however fast they come. */
  #step(by) {
    this.seek((this.#seeking ? this.#aim : this.currentFrame) + by);
  }

  #scrub(frame, done) {
    if (!done && !this.paused) this.#resume = true;
    const sought = this.seek(frame);
    if (!done || !this.#resume) return;
    this.#resume = false;
    sought.then(() => this.play());
  }

  /** The picture as it is now, without its backdrop: a promise of a PNG file as `Blob`, null while there is none. */
  still() {
    return this.video ? this.#stage.still() : Promise.resolve(null);
  }

  async #saveStill() {
    const name = `${document.title || "geometry-video"}-${this.currentFrame}.png`;
    save(await this.still(), name);
  }

  #act(name) {
    const actions = {
      play: () => (this.paused ? this.play() : this.pause()),
      back: () => this.#step(-1),
      forward: () => this.#step(1),
      first: () => this.seek(0),
      last: () => this.seek(this.video.frameCount - 1),
      slower: () => this.setAttribute("speed", nextSpeed(this.speed, -1)),
      faster: () => this.setAttribute("speed", nextSpeed(this.speed, 1)),
      loop: () => this.toggleAttribute("loop"),
      wireframe: () => this.toggleAttribute("wireframe"),
      follow: () => this.toggleAttribute("follow"),
      view: () => this.#stage.resetView(),
      still: () => this.#saveStill(),
      fullscreen: () => toggleFullscreen(this),
      nearer: () => this.#stage.zoom(1 / ZOOM),
      farther: () => this.#stage.zoom(ZOOM),
      "turn-left": () => this.#stage.orbit(-TURN, 0),
      "turn-right": () => this.#stage.orbit(TURN, 0),
      "turn-up": () => this.#stage.orbit(0, TURN),
      "turn-down": () => this.#stage.orbit(0, -TURN),
    };
    if (this.video && this.#stage) actions[name]();
  }

  #onKey(event) {
    const action = actionOf(event);
    if (!action) return;
    event.preventDefault();
    this.#act(action);
  }

  #show(frame) {
    this.currentFrame = frame;
    this.#bar.setFrame(frame);
    this.dispatchEvent(new CustomEvent("frame", { detail: frame }));
  }

  #setPaused(paused) {
    this.paused = paused;
    this.#bar.setPlaying(!paused);
  }

  #fail(error) {
    this.#unload();
    const known = error instanceof GeometryVideoError;
    this.#say(known ? `Cannot play this file: ${error.message}.` : `The player failed: ${error.message}`, "alert");
    this.dispatchEvent(new CustomEvent("error", { detail: error }));
  }

  #say(text, role = "status") {
    this.#message.setAttribute("role", role);
    this.#message.textContent = text;
  }

  #unload() {
    this.#loading++;
    this.video?.close();
    this.video = null;
    this.#wanted = null;
    this.#resume = false;
    this.currentFrame = 0;
    this.#stage?.clear();
    this.#field = null;
    this.#legend.hide();
    this.#panel.clear();
    this.#bar.setNotes([]);
    this.#bar.setEnabled(false);
    this.#setPaused(true);
  }
}

function openStage(canvas) {
  try {
    return new Stage(canvas);
  } catch {
    throw new GeometryVideoError("unsupported", "this browser offers no WebGL to draw with");
  }
}
