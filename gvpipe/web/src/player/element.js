/**
 * The player as an element: `<geometry-video src="walk.mp4" autoplay loop></geometry-video>`.
 *
 * Attributes: `src` (an address, or `#id` of an element in the page that holds the file as base64 text), `autoplay` (not for
 * those who prefer reduced motion), `loop`, `wireframe`, `follow` (the camera goes with the mesh), `speed` (1 is the video's
 * own), `up` ("y", or "z"), `field` (the name of one that is shown in colours), `colormap`, `range` ("low,high" of the colours),
 * `scale` ("log": colours follow the logarithm), `warp` ("name:scale" of a field that moves vertices), `camera`
 * ("azimuth,elevation" of the first view, degrees), `clip` ("x=0.3", "y=30%" or "-x=0.3": a plane that cuts the mesh), `shading` ("flat": each triangle has one normal),
 * `lod` (a level of detail, or "auto": a coarser one where the page cannot keep up), `muted`, `volume` (0 to 1).
 * Frames follow the sound's clock while it is heard. Browsers let a page play on its own only if it is `muted`.
 * Properties, methods and events are those of `HTMLMediaElement` where it has them. Events of its own: `ready`, `frame` (detail:
 * the frame's number), `viewchange` (detail: azimuth and elevation that a user turned to), `partschange` (detail: names of
 * hidden parts), `levelchange` (detail: the level of detail that is shown), `shotchange` (detail: the number of the shot that is shown),
 * `probe` (detail: what was clicked on), `clip` (detail: the cut that is shown, or null); `error` has a `GeometryVideoError` as its detail.
 */

import { breathe } from "../breathe.js";
import { GeometryVideo, GeometryVideoError } from "../geometry_video.js";
import { checkSeconds, checkVolume, paused } from "../playback.js";
import { FASTEST, SLOWEST, checkRate } from "../playback_rate.js";
import { COLORMAPS } from "../three/colormaps.js";
import { isLogarithmic } from "../three/field_colours.js";
import { parseWarp, usualMover } from "../three/warp.js";
import { cutText, parseCut } from "../volume/plane.js";
import { Bar, nextSpeed } from "./bar.js";
import { listenToClicks } from "./clicks.js";
import { embedded } from "./embedded.js";
import { actionOf } from "./keys.js";
import { Legend } from "./legend.js";
import { Load } from "./load.js";
import { isFullscreen, save, toggleFullscreen } from "./outside.js";
import { Panel } from "./panel.js";
import { Probe } from "./probe.js";
import { Stage, probeGpu } from "./stage.js";
import style from "./style.css";
import { TimeRanges } from "./time_ranges.js";

const LABEL = "Animated mesh; shift and arrow keys turn it, + and - zoom";
const MARKUP = `<style>${style}</style>
  <div class="stage">
    <canvas tabindex="0" role="img" aria-label="${LABEL}"></canvas>
    <div class="legend" hidden></div>
    <div class="panel"></div>
    <div class="probe" role="group" aria-label="Probe" hidden></div>
    <div class="message" role="status"></div>
  </div>
  <div class="bar" part="bar" role="group" aria-label="Playback"></div>`;
const TURN = Math.PI / 18; // by one press of a key
const ZOOM = 1.15;
const LOST = "The browser took the picture's WebGL away, as it does when a page has many: remove some.";
const READY = { nothing: 0, metadata: 1, enough: 4 }; // `readyState`, as in HTMLMediaElement
const MEDIA_EVENTS = ["play", "playing", "pause", "seeking", "seeked", "timeupdate", "waiting", "ended", "ratechange"];
const SOUND_ATTRIBUTES = ["muted", "volume"];

const FIELD_ATTRIBUTES = ["field", "colormap", "range", "scale"];
const VIEW_ATTRIBUTES = ["warp", "clip", "camera", "shading"];
const HOLLOW = "the cut is hollow: the file has no volume (gvpipe encode --volume)";
const MOST_SHARE = 0.25; // of the diagonal, that the slider's end moves vertices by

/** Where there are no pages, modules that name the element can still be loaded. */
const Base = globalThis.HTMLElement ?? class {};

export class GeometryVideoElement extends Base {
  static observedAttributes = ["src", "loop", "wireframe", "follow", "speed", "lod", ...SOUND_ATTRIBUTES, ...FIELD_ATTRIBUTES, ...VIEW_ATTRIBUTES];

  #stage = null;
  #bar;
  #panel;
  #legend;
  #message;
  #probe;
  #loading = null; // Load
  #loaded = null; // promise, while a file is loaded
  #given = null; // what was loaded last, as it was given
  #wanted = null; // what was asked for last, of a file that may still load: true, to play; false, to pause
  #isReady = false; // whether a file is loaded, and said to be
  #giveUps = new Set(); // reject what waits for that to play
  #startTime = 0; // s, set before a file is there
  #startFrame = null; // sought before it is there
  #sought = null; // a promise that it is shown
  #resume = false; // whether to play on when the slider is let go
  #showing = null; // counts changes of the field
  #cutting = null; // and of the cut
  #hidden = new Set(); // names of parts

  /** The `GeometryVideo` that is shown, or null. */
  video = null;
  /** The error that ended loading or playing, or null. */
  error = null;
  /** What is loaded: an address, or "" for a file itself. */
  currentSrc = "";
  /** 0: nothing, 1: metadata, 4: it can play. */
  readyState = READY.nothing;

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
      warp: (name, scale) => this.setAttribute("warp", `${name}:${scale}`),
      clip: (change) => this.#changeClip(change),
      hide: (names) => {
        this.hide(names);
        this.#tell("partschange", [...names]);
      },
    });
    this.#legend = new Legend(root.querySelector(".legend"));
    this.#probe = new Probe(root.querySelector(".probe"), (vertex) => this.#stage?.setMark(vertex));
    this.#bar.setEnabled(false);
    root.addEventListener("keydown", (event) => this.#onKey(event));
    listenToClicks(root.querySelector(".stage"), (x, y) => this.#pick(x, y));
    if (!document.fullscreenEnabled) this.#bar.hide("fullscreen"); // phones may show films alone so
    this.addEventListener("fullscreenchange", () => this.#bar.setPressed("fullscreen", isFullscreen(this)));
  }

  connectedCallback() {
    const source = this.#given ?? this.getAttribute("src");
    if (source !== null && !this.#loaded) this.load(source); // anew, where it was taken out of the page
  }

  disconnectedCallback() {
    queueMicrotask(() => !this.isConnected && this.#leave()); // else it was moved
  }

  #leave() {
    this.pause();
    this.#unload();
    this.#wanted = null;
    this.#closeStage();
  }

  #closeStage() {
    if (!this.#stage) return;
    this.#stage.close();
    this.#stage = null;
    const canvas = this.shadowRoot.querySelector("canvas");
    canvas.replaceWith(canvas.cloneNode()); // its WebGL context is gone for good
  }

  attributeChangedCallback(name, before, value) {
    if (name === "src" && !this.isConnected) this.#given = null;
    else if (name === "src" && value !== null && (before !== value || this.error)) this.load(value);
    if (["loop", "wireframe", "follow"].includes(name)) this.#bar.setPressed(name, value !== null);
    if (name === "wireframe") this.#stage?.setWireframe(value !== null);
    if (name === "follow") this.#stage?.setFollowing(value !== null);
    if (name === "lod" && before !== value && this.#mesh) this.#mesh.lod = this.lod;
    if (name === "speed") this.#bar.setSpeed(this.speed);
    if (FIELD_ATTRIBUTES.includes(name) && before !== value && this.#mesh) this.#showField();
    if (VIEW_ATTRIBUTES.includes(name) && before !== value && this.#mesh) this.#showView(name);
    if (name === "loop" && this.#mesh) this.#mesh.loop = this.loop;
    if (name === "muted") this.#bar.setMuted(value !== null);
    if (SOUND_ATTRIBUTES.includes(name) && before !== value) this.#setSound();
    if (name === "speed" && this.#mesh) this.#mesh.playbackRate = this.speed;
    else if (name === "speed" && before !== value) this.#tell("ratechange");
  }

  /** The `GeometryVideoMesh` that is shown, or null. */
  get #mesh() {
    return this.video && this.#stage?.mesh;
  }

  get src() {
    return this.getAttribute("src") ?? "";
  }

  set src(source) {
    this.setAttribute("src", source);
  }

  get autoplay() {
    return this.hasAttribute("autoplay");
  }

  set autoplay(wanted) {
    this.toggleAttribute("autoplay", Boolean(wanted));
  }

  get loop() {
    return this.hasAttribute("loop");
  }

  set loop(wanted) {
    this.toggleAttribute("loop", Boolean(wanted));
  }

  get speed() {
    const speed = Number(this.getAttribute("speed") ?? 1);
    return speed >= SLOWEST && speed <= FASTEST ? speed : 1; // what browsers play
  }

  /** `speed`, under its name in `HTMLMediaElement`. */
  get playbackRate() {
    return this.speed;
  }

  set playbackRate(rate) {
    this.setAttribute("speed", checkRate(rate));
  }

  /** Whether what plays is silent; attribute `muted`. */
  get muted() {
    return this.hasAttribute("muted");
  }

  set muted(muted) {
    this.toggleAttribute("muted", Boolean(muted));
  }

  /** 0 to 1; attribute `volume`. */
  get volume() {
    const text = this.getAttribute("volume") ?? "";
    const volume = text.trim() ? Number(text) : 1;
    return volume >= 0 && volume <= 1 ? volume : 1;
  }

  set volume(volume) {
    this.setAttribute("volume", checkVolume(volume));
  }

  /** Have the mesh as muted and as loud as the attributes say. */
  #setSound() {
    if (this.#mesh) {
      this.#mesh.volume = this.volume;
      this.#mesh.muted = this.muted;
    } else {
      this.#tell("volumechange");
    }
  }

  /** The frame shown. */
  get currentFrame() {
    return this.#mesh?.currentFrame ?? 0;
  }

  /** Seconds: where the frame shown begins, or the one that is sought; `duration` once it has ended. */
  get currentTime() {
    return this.#mesh?.currentTime ?? this.#startTime;
  }

  set currentTime(seconds) {
    this.#resumeAfterError();
    if (this.#mesh) this.#mesh.currentTime = seconds;
    else this.#startTime = checkSeconds(seconds, "currentTime");
  }

  /** Seconds; NaN while nothing is loaded. */
  get duration() {
    return this.video?.duration ?? NaN;
  }

  get paused() {
    return this.#isReady ? this.#mesh.paused : this.#wanted !== true;
  }

  get ended() {
    return this.#mesh?.ended ?? false;
  }

  get seeking() {
    return this.#mesh?.seeking ?? false;
  }

  /** What plays without a wait for the file. */
  get buffered() {
    return new TimeRanges(this.video?.buffered ?? []);
  }

  get seekable() {
    return new TimeRanges(this.video ? [[0, this.video.frameCount / this.video.fps]] : []);
  }

  /** "auto", or the number of a level of detail; 0 is the whole mesh. */
  get lod() {
    const lod = this.getAttribute("lod") ?? "";
    return lod === "auto" ? lod : /^\d+$/.test(lod) ? Number(lod) : 0;
  }

  set lod(lod) {
    this.setAttribute("lod", lod);
  }

  /** Runs of frames of one connectivity (`GeometryVideo.shots`); [] while nothing is loaded. */
  get shots() {
    return this.video?.shots ?? [];
  }

  /** The number of the shot that is shown. */
  get shot() {
    return this.video?.shot ?? 0;
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

  /** "log" or "linear": how colours follow values. A range that does not lie above 0 is shown linearly. */
  get scale() {
    return this.getAttribute("scale") === "log" ? "log" : "linear";
  }

  set scale(scale) {
    this.setAttribute("scale", scale);
  }

  /** `{name, scale}` of the field that moves vertices, or null. */
  get warp() {
    return this.video && parseWarp(this.getAttribute("warp"), this.video.fields);
  }

  /** Azimuth and elevation of the first view, degrees, or null: the player's own. */
  get camera() {
    const words = (this.getAttribute("camera") ?? "").split(",");
    const numbers = words.map((word) => (word.trim() ? Number(word) : NaN));
    return numbers.length === 2 && numbers.every(Number.isFinite) && Math.abs(numbers[1]) <= 90 ? numbers : null;
  }

  /** The plane of attribute `clip` (`volume/plane.js`), or null. */
  get clip() {
    return parseCut(this.getAttribute("clip"));
  }

  /** (n, 3, 3) corners of the triangles of the cut's section, model units, the file's origin apart; empty where it is hollow. */
  get section() {
    return this.#mesh?.section ?? new Float32Array(0);
  }

  /** Azimuth and elevation of the view as it is, degrees; null while nothing is loaded. */
  get view() {
    return this.#mesh ? this.#stage.angles : null;
  }

  /** Turn the camera about the middle of the picture. @param {number} azimuth @param {number} elevation degrees */
  turnTo(azimuth, elevation) {
    if (this.#mesh) this.#stage.turnTo([azimuth, elevation]);
  }

  /** Names of the parts that are hidden. */
  get hiddenParts() {
    return new Set(this.#hidden);
  }

  /** Hide the parts of these names, and show all others. @param {string|Iterable<string>} names */
  hide(names) {
    this.#hidden = new Set(typeof names === "string" ? [names] : names);
    if (!this.video) return;
    this.#stage?.setHidden(this.#hidden);
    this.#panel.setHidden(this.#hidden);
  }

  /** 16 numbers, a (4, 4) matrix by columns: from model units to the picture's clip space, for those who draw over it. */
  get projection() {
    return this.video ? Array.from(this.#stage.projection) : null;
  }

  /** Load and show a file: an address, `#id`, or the file itself; without one, `src` anew. Errors are shown in the element. */
  load(source = this.src) {
    this.#unload();
    this.#given = source;
    this.currentSrc = typeof source === "string" || source instanceof URL ? String(source) : "";
    let end;
    this.#loaded = new Promise((resolve) => (end = resolve)); // there before any listener is told
    this.#loading = new Load();
    const loaded = this.#load(source, this.#loading);
    end(loaded);
    return loaded;
  }

  async #load(source, load) {
    let loaded = null;
    try {
      this.#say("Loading …");
      this.#tell("loadstart");
      load.check(); // a listener may have ended it, as by every event
      const file = typeof source === "string" && source[0] === "#" ? embedded(source) : source;
      const level = this.lod === "auto" ? "coarsest" : this.lod || "coarsest"; // shown at once
      loaded = GeometryVideo.load(file, { level, signal: load.signal });
      loaded.catch(() => {}); // looked at below
      await breathe();
      probeGpu(); // while a worker decodes
      await load.step(breathe());
      this.#stage ??= this.#openStage();
      this.#stage.setView(this.camera);
      const video = await load.step(loaded);
      await load.step(breathe());
      await load.step(this.#stage.setMesh(video, this.getAttribute("up") ?? (video.metadata.up_axis === "z" ? "z" : "y")));
      if (video.level) this.#tell("levelchange", video.level);
      await load.step(breathe());
      if (level === "coarsest" && video.level) await load.step(this.#stage.mesh.setLevel(0));
      await load.step(breathe());
      this.video = video;
      this.#say("");
      this.#openMesh();
      await load.step(breathe());
      await load.step(Promise.all([this.#showField(), this.#showWarp()]));
      this.#showClip(); // what lies inside may come later
      this.#becomeReady(load);
    } catch (error) {
      loaded?.then((late) => late.close(), () => {});
      if (!load.isOver) this.#fail(error);
    }
  }

  /** Tell what is known and shown, and begin to play if that is wanted. */
  #becomeReady(load) {
    this.#bar.setEnabled(true);
    this.#bar.setFrame(this.currentFrame);
    const states = [
      [READY.metadata, ["durationchange", "loadedmetadata"]],
      [READY.enough, ["frame", "loadeddata", "progress", "canplay", "canplaythrough", "ready"]],
    ];
    for (const [state, events] of states) {
      this.readyState = state;
      for (const event of events) {
        this.#tell(event, event === "frame" ? this.currentFrame : null);
        load.check();
      }
    }
    this.#isReady = true;
    if (this.#startFrame !== null) this.#sought = this.#mesh.seek(this.#startFrame);
    else if (this.#startTime) this.#mesh.currentTime = this.#startTime;
    this.#startTime = 0;
    const plays = this.#wanted ?? (this.autoplay && !matchMedia("(prefers-reduced-motion: reduce)").matches);
    if (plays) this.#mesh.play().catch(() => {}); // told by events
  }

  #openStage() {
    const canvas = this.shadowRoot.querySelector("canvas");
    canvas.addEventListener("webglcontextlost", () => this.#stage?.hasMesh && this.#say(LOST, "alert"));
    canvas.addEventListener("webglcontextrestored", () => this.#say(""));
    const stage = openStage(canvas);
    stage.cutMoved = (place) => this.#changeClip({ place });
    stage.turned = () => this.#tell("viewchange", stage.angles);
    return stage;
  }

  #openMesh() {
    const { mesh } = this.#stage;
    this.#stage.setWireframe(this.hasAttribute("wireframe"));
    this.#stage.setFollowing(this.hasAttribute("follow"));
    this.#showView("shading");
    mesh.loop = this.loop;
    mesh.playbackRate = this.speed;
    this.#setSound();
    mesh.addEventListener("volumechange", () => {
      if (mesh.muted !== this.muted) this.muted = mesh.muted; // the browser refused to play it
      this.#tell("volumechange");
    });
    mesh.addEventListener("notes", () => this.#bar.setNotes(mesh.notes));
    if (this.lod !== mesh.lod) mesh.lod = this.lod;
    for (const name of MEDIA_EVENTS) mesh.addEventListener(name, () => this.#tell(name));
    for (const name of ["play", "pause"]) {
      mesh.addEventListener(name, () => {
        this.#bar.setPlaying(!mesh.paused);
        this.#probe.setPlaying(!mesh.paused);
      });
    }
    mesh.addEventListener("frame", ({ frame }) => {
      this.#bar.setFrame(frame);
      this.#probe.setFrame(frame);
      this.#tell("frame", frame);
    });
    mesh.addEventListener("change", () => this.#probe.setFrame(mesh.currentFrame)); // late values of a field
    mesh.addEventListener("levelchange", ({ level }) => {
      this.#bar.setVideo(this.video);
      this.#probe.close(); // it has other vertices
      if (level === 0) {
        this.#showField();
        this.#showWarp();
        this.#showClip();
      }
      this.#tell("levelchange", level);
    });
    mesh.addEventListener("shotchange", ({ shot }) => {
      this.#probe.close(); // it has other vertices
      this.#bar.setNotes(mesh.notes);
      this.#showMenus();
      this.#tell("shotchange", shot);
    });
    for (const name of ["progress", "durationchange"]) {
      mesh.addEventListener(name, () => {
        this.#bar.setVideo(this.video);
        this.#bar.setFrame(mesh.currentFrame);
        this.#tell(name);
      });
    }
    mesh.addEventListener("waiting", () => this.video.isLive || this.#say("Waiting for the file …"));
    for (const name of ["playing", "pause", "seeked"]) mesh.addEventListener(name, () => this.error || this.#say(""));
    mesh.addEventListener("error", ({ error }) => mesh === this.#mesh && this.#interrupt(error));
    this.#bar.setVideo(this.video);
    this.#bar.setNotes(mesh.notes);
    this.#panel.setVideo(this.video, mesh.partNames);
    this.hide(this.#hidden);
  }

  /** The menus and the legend of a shot; those of the shot before stay where it has the same fields and parts. */
  #showMenus() {
    const { video } = this;
    if (this.#panel.differs(video, this.#mesh.partNames)) {
      this.#panel.setVideo(video, this.#mesh.partNames);
      this.#panel.setHidden(this.#hidden);
      const mover = this.warp?.name ?? usualMover(video.fields);
      this.#panel.setWarp(mover, this.warp?.scale ?? 0, mover === null ? 1 : mostScale(video, video.fields.get(mover)));
    }
    this.#showLegend(video.fields.get(this.getAttribute("field")) ?? null, this.#mesh.fieldRange);
  }

  #showLegend(field, range) {
    const hasMap = field !== null && field.kind !== "color";
    this.#panel.setField(field?.name ?? "", this.colormap, hasMap);
    if (hasMap) this.#legend.show(field, this.colormap, range, isLogarithmic(this.scale, range));
    else this.#legend.hide();
  }

  /**
   * Play on from the frame shown, from the start if that is the last; a promise that it plays. Until a file is there, it waits.
   * After an error in mid-play it tries again.
   *
   * @throws {GeometryVideoError|DOMException} the file cannot be played; an AbortError: it was paused, or another file was asked for
   */
  async play() {
    if (!this.#mesh && this.error) throw this.error;
    this.#wanted = true;
    if (!this.#mesh) await this.#awaitMesh();
    this.#resumeAfterError();
    await this.#mesh.play();
  }

  /** Until a file is loaded that is to play. */
  async #awaitMesh() {
    let giveUp;
    const paused = new Promise((_, reject) => this.#giveUps.add((giveUp = reject)));
    try {
      await Promise.race([paused, this.#awaitLoad()]);
    } finally {
      this.#giveUps.delete(giveUp);
    }
  }

  async #awaitLoad() {
    if (!this.#loaded) await new Promise((resolve) => this.addEventListener("loadstart", resolve, { once: true }));
    const loaded = this.#loaded;
    await loaded;
    if (this.error) throw this.error;
    if (loaded !== this.#loaded) throw new DOMException("another file was asked for", "AbortError");
  }

  pause() {
    this.#wanted = false;
    for (const giveUp of this.#giveUps) giveUp(paused());
    this.#mesh?.pause();
  }

  /** Show a frame, and pause; while a file loads, once it is there. Of many calls in a row the last counts. */
  async seek(frame) {
    if (!this.#isReady) {
      this.pause();
      this.#startFrame = frame;
      await this.#loaded;
      await this.#sought;
      return;
    }
    this.#resumeAfterError();
    await this.#mesh.seek(frame);
  }

  #resumeAfterError() {
    if (!this.error || !this.#mesh) return;
    this.error = null;
    this.#say("");
  }

  /** Show the field of attribute `field`, if the video has it, or else the materials. */
  async #showField() {
    const { video } = this;
    if (video.level) return; // only the whole mesh has fields
    const showing = (this.#showing = {});
    const field = video.fields.get(this.getAttribute("field")) ?? null;
    this.#say(field ? `Decoding ${field.name} …` : "");
    let range;
    try {
      const name = field?.name ?? (video.shots.length > 1 ? this.getAttribute("field") : null); // another shot may have it
      range = await this.#stage.showField(name, { colormap: this.colormap, range: this.range, scale: this.scale });
    } catch (error) {
      if (video === this.video) this.#interrupt(error);
      return;
    }
    if (showing !== this.#showing || !this.#mesh) return;
    this.#say("");
    if (range) this.#showLegend(field, range);
    this.#probe.setField(field);
  }

  /** Show what one of the attributes about the view asks for. */
  #showView(name) {
    if (name === "camera") this.#stage.setView(this.camera);
    else if (name === "shading") this.#stage.setFlatShading(this.getAttribute("shading") === "flat");
    else if (name === "clip") this.#showClip();
    else this.#showWarp();
  }

  /** Cut the mesh by the plane of attribute `clip`, if it is one: a promise that the section is shown. */
  async #showClip() {
    const { video, clip } = this;
    if (!this.#mesh || (!clip && !this.#mesh.cut)) return;
    const showing = (this.#cutting = {});
    const isFirst = clip && video.volume && !video.volume.grid;
    if (isFirst) this.#say("Decoding what lies inside …");
    try {
      const cutting = this.#stage.setClip(clip);
      this.#panel.setClip(this.#stage.cutRange);
      this.#bar.setNotes([...this.#mesh.notes, ...(clip && !video.volume && !video.level ? [HOLLOW] : [])]);
      if (!(await cutting) || showing !== this.#cutting) return;
      this.#tell("clip", clip);
    } catch (error) {
      if (video === this.video) this.#interrupt(error);
      return;
    }
    if (isFirst && showing === this.#cutting) this.#say("");
  }

  #changeClip({ axis, place, turn }) {
    const cut = this.#stage.cutRange;
    if (axis === null) {
      this.removeAttribute("clip");
    } else if (axis !== undefined) {
      const { min, max } = this.#mesh.bounds;
      const middle = (min[axis] + max[axis]) / 2 + this.video.origin[axis];
      this.setAttribute("clip", cutText({ axis, place: middle, isPart: false, sign: this.clip?.sign ?? 1 }));
    } else if (cut) {
      const sign = turn ? -this.clip.sign : this.clip.sign;
      this.setAttribute("clip", cutText({ axis: cut.axis, place: place ?? cut.place, isPart: false, sign }));
    }
  }

  /** Move vertices by the field of attribute `warp`, if the video has it; offer what else can move them. */
  async #showWarp() {
    const { video, warp } = this;
    if (video.level) return; // only the whole mesh has fields
    const name = warp?.name ?? usualMover(video.fields);
    this.#panel.setWarp(name, warp?.scale ?? 0, name === null ? 1 : mostScale(video, video.fields.get(name)));
    try {
      await this.#stage.setWarp(warp?.name ?? null, warp?.scale ?? 0);
    } catch (error) {
      if (video === this.video) this.#interrupt(error);
    }
  }

  /** Open the probe at a point of the picture, in CSS pixels from its upper left; beside the mesh, close it. */
  async #pick(x, y) {
    if (!this.#isReady) return;
    const picked = this.#stage.pick(x, y);
    if (!picked) {
      this.#probe.close();
      return;
    }
    const { video, currentFrame: frame } = this;
    const field = video.level ? null : (video.fields.get(this.getAttribute("field")) ?? null);
    try {
      const value = await this.#probe.open(video, field, picked, frame);
      if (video === this.video) this.#tell("probe", { ...picked, frame, value });
    } catch (error) {
      if (video === this.video) this.#interrupt(error);
    }
  }

  /** Steps in a row add up, however fast they come. */
  #step(by) {
    return this.seek(this.#mesh.soughtFrame + by);
  }

  #scrub(frame, done) {
    if (!done && !this.paused) this.#resume = true;
    const sought = this.seek(frame);
    if (!done || !this.#resume) return;
    this.#resume = false;
    sought.then(() => this.play()).catch(() => {});
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
    const canvas = this.shadowRoot.querySelector("canvas");
    const actions = {
      play: () => (this.paused ? this.play().catch(() => {}) : this.pause()),
      back: () => this.#step(-1),
      forward: () => this.#step(1),
      first: () => this.seek(0),
      last: () => this.seek(this.video.frameCount - 1),
      slower: () => this.setAttribute("speed", nextSpeed(this.speed, -1)),
      faster: () => this.setAttribute("speed", nextSpeed(this.speed, 1)),
      mute: () => this.toggleAttribute("muted"),
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
      probe: () => this.#pick(canvas.clientWidth / 2, canvas.clientHeight / 2),
    };
    if (this.video && this.#stage) actions[name]();
  }

  #onKey(event) {
    if (event.key === "Escape" && this.#probe.isOpen) {
      event.stopPropagation(); // it closes one thing
      this.#probe.close();
      return;
    }
    const action = actionOf(event);
    if (!action) return;
    event.preventDefault();
    this.#act(action);
  }

  #tell(event, detail = null) {
    this.dispatchEvent(new CustomEvent(event, { detail }));
  }

  /** Of a file that cannot be shown at all. */
  #fail(error) {
    this.#unload();
    this.#interrupt(error);
  }

  /** Of what is shown: the frame stays, and whoever asks for another tries again. */
  #interrupt(error) {
    const known = error instanceof GeometryVideoError;
    this.#say(known ? `Cannot play this file: ${error.message}.` : `The player failed: ${error.message}`, "alert");
    this.error = error;
    this.#tell("error", error);
  }

  #say(text, role = "status") {
    this.#message.setAttribute("role", role);
    this.#message.textContent = text;
  }

  #unload() {
    const wasLoaded = this.video !== null;
    if (this.#loaded) this.#wanted = this.#startFrame = null; // they were about the file before
    this.#isReady = false;
    this.#loaded = null;
    this.#loading?.end();
    this.#loading = null;
    this.#showing = this.#cutting = null;
    this.video?.close();
    this.video = null;
    this.error = null;
    this.readyState = READY.nothing;
    this.#resume = false;
    this.#stage?.clear();
    this.#legend.hide();
    this.#panel.clear();
    this.#probe.close();
    this.#bar.setNotes([]);
    this.#bar.setEnabled(false);
    this.#bar.setPlaying(false);
    if (wasLoaded) this.#tell("emptied");
  }
}

/** Where a slider of displacements ends: a power of ten that moves vertices by about a quarter of the diagonal, at least 1. */
function mostScale({ bounds: { min, max } }, { range }) {
  const largest = range ? Math.max(Math.abs(range[0]), Math.abs(range[1])) : 0;
  const diagonal = Math.hypot(...max.map((high, axis) => high - min[axis]));
  const wanted = largest > 0 ? (MOST_SHARE * diagonal) / largest : 1;
  return wanted > 1 ? 10 ** Math.min(12, Math.ceil(Math.log10(wanted))) : 1;
}

function openStage(canvas) {
  try {
    return new Stage(canvas);
  } catch {
    throw new GeometryVideoError("unsupported", "this browser offers no WebGL to draw with");
  }
}
