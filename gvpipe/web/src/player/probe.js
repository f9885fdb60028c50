/** A box over the picture that says what a point of the mesh has: a field's value, now and over time, and where the point is. */

import { frameOf } from "../fields/coded_field.js";
import { formatNumber, titleOf } from "./legend.js";
import { Trace, valueOf } from "./trace.js";

const [WIDTH, HEIGHT] = [220, 60]; // of the plot, in its own units

const MARKUP = `
  <button type="button" aria-label="Close (Escape)" title="Close (Escape)">×</button>
  <p class="value" aria-live="polite"></p>
  <p class="place"></p>
  <svg viewBox="0 0 ${WIDTH} ${HEIGHT}" preserveAspectRatio="none" role="img"><path class="mark"/><path class="line"/></svg>
  <p class="ends"></p>`;

export class Probe {
  #trace = null;
  #video = null;
  #field = null; // that has the value: the one that is shown, or its numbers inside
  #row = 0;
  #picked = null;
  #frame = 0;
  #isPlaying = false;
  #mark;

  /** @param {HTMLElement} root filled with the box @param {(vertex: number|null) => void} mark called with what is probed, or null */
  constructor(root, mark) {
    root.innerHTML = MARKUP;
    this.root = root;
    this.#mark = mark;
    [this.value, this.place, this.ends] = root.querySelectorAll("p");
    this.plot = root.querySelector("svg");
    [this.mark, this.line] = root.querySelectorAll("path");
    root.querySelector("button").addEventListener("click", () => this.close());
    this.close();
  }

  get isOpen() {
    return this.#picked !== null;
  }

  /**
   * @param {import("../geometry_video.js").GeometryVideo} video
   * @param {import("../fields/coded_field.js").CodedField|null} field that is shown
   * @param {import("../volume/volume.js").Picked} picked
   * @param {number} frame
   * @returns {Promise<number|null>} the value in that frame; null if there is none
   */
  async open(video, field, picked, frame) {
    this.close();
    this.#video = video;
    this.#picked = picked;
    this.#frame = frame;
    this.root.hidden = false;
    this.#mark(picked.vertex);
    this.setField(field);
    if (!this.#field) return null;
    const [at, row] = [this.#field, this.#row];
    await at.load(this.#fieldFrame(frame));
    const value = valueOf(at, frameOf(at, video.ownFrame(frame)), row);
    if (picked === this.#picked) this.setFrame(this.#frame);
    return Number.isNaN(value) ? null : value;
  }

  close() {
    this.#trace?.end();
    this.#trace = this.#field = this.#picked = null;
    this.root.hidden = true;
    this.#mark(null);
  }

  /** Another field is shown, or none. */
  setField(field) {
    if (!this.isOpen) return;
    this.#trace?.end();
    const found = field && field.kind !== "color" ? rowOf(this.#video, field, this.#picked) : null;
    this.#field = found?.field ?? null;
    this.#row = found?.row ?? 0;
    this.#trace = this.#field && new Trace(this.#field, this.#row);
    this.plot.style.display = this.#field ? "" : "none";
    this.ends.hidden = !this.#field;
    this.#trace?.take();
    this.#draw();
    this.setFrame(this.#frame);
    this.#load();
  }

  /** @param {number} frame that is shown */
  setFrame(frame) {
    this.#frame = frame;
    if (!this.isOpen) return;
    if (this.#trace?.take()) this.#draw();
    this.value.textContent = this.#field ? `${titleOf(this.#field)} ${this.#valueText(frame)}` : "";
    this.place.textContent = this.#placeText(frame);
    const x = this.#field ? (this.#fieldFrame(frame) / Math.max(1, this.#field.frameCount - 1)) * WIDTH : 0;
    this.mark.setAttribute("d", `M${x} 0V${HEIGHT}`);
  }

  /** While it plays, what decodes is left to that, and nothing is read aloud. @param {boolean} isPlaying */
  setPlaying(isPlaying) {
    this.#isPlaying = isPlaying;
    this.value.ariaLive = isPlaying ? "off" : "polite";
    this.#load();
  }

  /** The frame of the field that a frame of the video shows. */
  #fieldFrame(frame) {
    return frameOf(this.#field, this.#video.ownFrame(frame));
  }

  #load() {
    const trace = this.#trace;
    const loaded = trace?.load(() => !this.#isPlaying, () => trace === this.#trace && this.#draw());
    loaded?.catch(() => {}); // told when such a frame is shown
  }

  #valueText(frame) {
    const value = valueOf(this.#field, this.#fieldFrame(frame), this.#row);
    if (value === null) return "…";
    if (Number.isNaN(value)) return "has no value here";
    return `${Number(value.toPrecision(6))} ${this.#field.unit}`;
  }

  #placeText(frame) {
    const { vertex, triangle, part, point, cell } = this.#picked;
    const { metadata, fps } = this.#video;
    const time = metadata.times?.[this.#video.ownFrame(frame)] ?? frame / fps;
    const places = [vertex === null ? `point ${point} inside` : `vertex ${vertex}`, triangle === null ? "" : `triangle ${triangle}`];
    places.push(cell === undefined ? "" : `cell ${cell}`, part ?? "");
    return [...places, `frame ${frame}`, `${Number(time.toPrecision(6))} s`].filter(Boolean).join(" · ");
  }

  #draw() {
    if (!this.#trace) return;
    const { frames, values } = this.#trace;
    const known = values.filter(Number.isFinite);
    const [low, high] = [Math.min(...known), Math.max(...known)];
    const last = Math.max(1, frames.at(-1));
    let path = "";
    let isOn = false; // whether the line goes on from the frame before
    frames.forEach((k, i) => {
      const isThere = Number.isFinite(values[i]);
      const y = high > low ? 3 + (1 - (values[i] - low) / (high - low)) * (HEIGHT - 6) : HEIGHT / 2;
      if (isThere) path += `${isOn ? "L" : "M"}${((k / last) * WIDTH).toFixed(2)} ${y.toFixed(2)}${isOn ? "" : "h.01"}`;
      isOn = isThere;
    });
    this.line.setAttribute("d", path);
    const [least, most] = [low, high].map((value) => formatNumber(value, high - low || Math.abs(value)));
    this.ends.textContent = known.length ? `${least} to ${most} ${this.#field.unit}` : "";
    this.plot.ariaLabel = `${titleOf(this.#field)} over time, ${this.ends.textContent}`;
  }
}

/** Which field has the value of what was picked, and in which row; null: none has. */
function rowOf(video, field, picked) {
  if (picked.cell !== undefined) return video.volume.rowOf(field, picked);
  return { field, row: field.domain === "triangle" ? picked.triangle : picked.vertex };
}
