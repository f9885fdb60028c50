/**
 * The element `<geometry-video>` in a notebook: what anywidget calls to show a `PlayerWidget` of Python.
 *
 * The element and the widget's traits follow each other. Each tells the other what differs, and nothing else, so nothing goes
 * round in circles; widgets of which traits are linked play in step.
 */

const PLAYER = "$$PLAYER$$"; // the bundle with the element, deflated, in base 64
const REPORT_MS = 125; // between two reports of the frame, while it plays
const IN_STEP_SECONDS = 0.2; // that the frame may differ from the trait's while it plays
const DECIMALS = 2; // of degrees

/** The element is defined once in a page, however many players it has. */
async function definePlayer() {
  const bytes = Uint8Array.from(atob(PLAYER), (character) => character.charCodeAt(0));
  const text = await new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"))).text();
  const address = URL.createObjectURL(new Blob([text], { type: "text/javascript" }));
  try {
    await import(/* webpackIgnore: true */ address);
  } finally {
    URL.revokeObjectURL(address);
  }
}

const LOADING = Symbol.for("gvpipe: the player's module");

/** Parts of the file from the kernel, by messages of which each has a number. */
class KernelSource {
  #model;
  #waiting = new Map(); // number -> {resolve, reject}
  #prefix = Math.random().toString(36).slice(2); // other views of the widget hear the answers, too
  #count = 0;

  constructor(model, name) {
    this.#model = model;
    this.name = name;
    model.on("msg:custom", this.#take);
  }

  fetchRange(start, stop, signal) {
    const number = `${this.#prefix}-${this.#count++}`;
    return new Promise((resolve, reject) => {
      const giveUp = () => this.#waiting.delete(number) && reject(signal.reason);
      signal.addEventListener("abort", giveUp, { once: true });
      this.#waiting.set(number, { resolve, reject });
      this.#model.send({ kind: "range", number, start, stop: Number.isFinite(stop) ? stop : null });
    });
  }

  close() {
    this.#model.off("msg:custom", this.#take);
  }

  #take = (message, buffers) => {
    const waiting = message.kind === "range" && this.#waiting.get(message.number);
    if (!waiting) return;
    this.#waiting.delete(message.number);
    if (message.error) waiting.reject(new Error(message.error));
    else waiting.resolve({ data: bytesOf(buffers[0]), size: message.size });
  };
}

/** A file that grows, of which the kernel sends parts as they are written. */
class GrowingSource {
  #model;
  #data;
  #size;

  constructor(model, name, data) {
    this.#model = model;
    this.name = name;
    [this.#data, this.#size] = [data.slice(), data.length];
    model.on("msg:custom", this.#take);
  }

  async fetchRange(start, stop) {
    return { data: this.#data.slice(start, Math.min(stop, this.#size)), size: this.#size };
  }

  close() {
    this.#model.off("msg:custom", this.#take);
  }

  #take = ({ kind, start }, buffers) => {
    if (kind !== "part") return;
    const part = bytesOf(buffers[0]);
    this.#size = Math.max(this.#size, start + part.length);
    if (this.#size > this.#data.length) {
      const larger = new Uint8Array(2 * this.#size);
      larger.set(this.#data);
      this.#data = larger;
    }
    this.#data.set(part, start);
  };
}

function bytesOf(buffer) {
  return ArrayBuffer.isView(buffer) ? new Uint8Array(buffer.buffer, buffer.byteOffset, buffer.byteLength) : new Uint8Array(buffer);
}

/** One view of a widget: its element, kept in step with the traits. */
class View {
  #model;
  #element;
  #source;
  #isReady = false; // whether the element shows what the traits ask for
  #driven = 0; // seeks that traits asked for, which are not reported
  #reported = 0; // ms, when the frame was reported last
  #ends = [];

  constructor(model, el) {
    this.#model = model;
    this.#element = document.createElement("geometry-video");
    const { style } = this.#element;
    Object.assign(style, { width: "100%", height: "100%", minHeight: "18rem" });
    for (const [name, value] of Object.entries(model.get("_attributes"))) this.#element.setAttribute(name, value);
    for (const name of ["speed", "field", "range", "camera"]) this.#apply(name);
    el.append(this.#element);
    this.#watchElement();
    for (const name of ["frame", "playing", "speed", "field", "range", "camera", "parts"]) {
      this.#listen(model, `change:${name}`, () => this.#apply(name));
    }
    this.#listen(model, "change:_version", () => this.#load());
    this.#load();
  }

  close() {
    for (const end of this.#ends) end();
    this.#source?.close();
    this.#element.remove();
  }

  #load() {
    this.#source?.close();
    this.#isReady = false;
    const model = this.#model;
    const data = model.get("_data") && bytesOf(model.get("_data"));
    const source = () => (data ? new GrowingSource(model, model.get("name"), data) : new KernelSource(model, model.get("name")));
    this.#source = data && !model.get("_is_growing") ? null : source();
    this.#element.load(this.#source ?? data);
  }

  #listen(model, event, call) {
    model.on(event, call);
    this.#ends.push(() => model.off(event, call));
  }

  /** Report what users do with the element. */
  #watchElement() {
    const element = this.#element;
    const on = (event, call) => element.addEventListener(event, call);
    on("ready", () => this.#begin());
    on("play", () => this.#report({ playing: true }));
    on("pause", () => this.#isReady && this.#model.get("playing") && this.#report({ frame: element.currentFrame, playing: false }));
    on("frame", () => this.#reportFrame());
    on("ratechange", () => this.#report({ speed: element.speed }));
    on("viewchange", ({ detail }) => this.#report({ camera: detail.map((angle) => Number(angle.toFixed(DECIMALS))) }));
    on("partschange", ({ detail }) => this.#report({ parts: this.#partNames.filter((name) => !detail.includes(name)) }));
    on("probe", ({ detail }) => this.#model.send({ kind: "pick", ...detail }));
    const changed = new MutationObserver(() => this.#report({ field: element.getAttribute("field"), range: element.range }));
    changed.observe(element, { attributeFilter: ["field", "range"] });
    this.#ends.push(() => changed.disconnect());
  }

  /** What the traits ask for, once a file is there. */
  #begin() {
    this.#isReady = true;
    this.#apply("parts");
    if (this.#model.get("frame")) this.#seek(this.#model.get("frame"));
    const isStill = matchMedia("(prefers-reduced-motion: reduce)").matches && !this.#model.get("frame");
    if (this.#model.get("playing") && isStill) this.#report({ playing: false });
    else if (this.#model.get("playing")) this.#play();
    document.dispatchEvent(new CustomEvent("gvpipe:ready", { detail: this.#model.get("_saved_id") }));
  }

  #apply(name) {
    const element = this.#element;
    const value = this.#model.get(name);
    const isLoaded = element.video !== null;
    const attribute = (text) => (text === null ? element.removeAttribute(name) : element.setAttribute(name, text));
    const actions = {
      frame: () => isLoaded && this.#goTo(value),
      playing: () => isLoaded && this.#setPlaying(value),
      speed: () => element.speed === value || attribute(String(value)),
      field: () => element.getAttribute("field") === value || attribute(value),
      range: () => isSame(element.range, value) || attribute(value && value.join(",")),
      camera: () => this.#look(value),
      parts: () => isLoaded && element.hide(value === null ? [] : this.#partNames.filter((part) => !value.includes(part))),
    };
    actions[name]();
  }

  #setPlaying(isPlaying) {
    if (isPlaying !== this.#element.paused) return;
    if (isPlaying) {
      this.#play();
      return;
    }
    this.#element.pause();
    this.#seek(this.#model.get("frame"));
  }

  #play() {
    this.#element.play().catch(() => {}); // shown by the element
  }

  #goTo(frame) {
    const element = this.#element;
    const { fps, frameCount } = element.video;
    if (element.paused) {
      if (frame !== element.currentFrame || this.#driven) this.#seek(frame);
      return;
    }
    const apart = Math.abs(frame - element.currentFrame);
    const around = Math.min(apart, frameCount - apart); // one may have begun anew already
    if (around > Math.max(2, IN_STEP_SECONDS * fps * element.speed)) element.currentTime = (frame + 0.5) / fps;
  }

  async #seek(frame) {
    this.#driven++;
    await this.#element.seek(frame).catch(() => {});
    this.#driven--;
  }

  #look(camera) {
    const element = this.#element;
    if (camera === null) return;
    if (element.view === null) element.setAttribute("camera", camera.join(","));
    else if (!isSame(element.view.map((angle) => Number(angle.toFixed(DECIMALS))), camera)) element.turnTo(...camera);
  }

  get #partNames() {
    return [...new Set((this.#element.video?.parts ?? []).map(({ name }) => name))];
  }

  #reportFrame() {
    const isDue = performance.now() - this.#reported >= REPORT_MS;
    if (!this.#isReady || this.#driven || !(this.#element.paused || isDue)) return;
    this.#reported = performance.now();
    this.#report({ frame: this.#element.currentFrame });
  }

  /** Tell the traits what is not as they have it. */
  #report(values) {
    const changed = Object.entries(values).filter(([name, value]) => !isSame(this.#model.get(name), value));
    for (const [name, value] of changed) this.#model.set(name, value);
    if (changed.length) this.#model.save_changes();
  }
}

function isSame(a, b) {
  return JSON.stringify(a ?? null) === JSON.stringify(b ?? null);
}

/** Hide what a saved notebook shows in place of this widget, while the widget is there. */
function hideSaved(id) {
  const style = document.createElement("style");
  style.textContent = `[data-gvpipe="${id}"] { display: none }`;
  document.head.append(style);
  return () => style.remove();
}

async function render({ model, el }) {
  const show = hideSaved(model.get("_saved_id"));
  const waiting = el.appendChild(document.createElement("p"));
  waiting.textContent = "Loading the player …";
  try {
    globalThis[LOADING] ??= definePlayer();
    await globalThis[LOADING];
  } catch (error) {
    globalThis[LOADING] = undefined;
    waiting.textContent = `The player cannot be loaded: ${error.message}`;
    return show;
  }
  waiting.remove();
  const view = new View(model, el);
  return () => {
    view.close();
    show();
  };
}

export default { render };
