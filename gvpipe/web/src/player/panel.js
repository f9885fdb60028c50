/**
 * Menus over the picture: the field that is shown and its colour map, how far a field moves the mesh, where a plane cuts it, and the
 * parts that are shown.
 * They are there if there is a choice.
 */

import { COLORMAPS } from "../three/colormaps.js";
import { AXES } from "../volume/plane.js";

const MANY = 12; // parts from which on they can be searched
const MOST_LISTED = 200;

const MARKUP = `
  <label class="choice" hidden><span>Show</span> <select data-of="field" aria-label="Field"></select></label>
  <label class="choice" hidden><span>Colours</span> <select data-of="colormap" aria-label="Colour map"></select></label>
  <div class="choice warp" hidden>
    <span></span> <input type="range" aria-label="Scale of the displacement"> <input type="number" step="any" aria-label="Scale of the displacement">
  </div>
  <div class="choice clip" role="group" aria-label="Cut" hidden>
    <span>Cut</span> ${[...AXES].map((axis) => `<button type="button" aria-pressed="false" title="Cut across ${axis}">${axis}</button>`).join("")}
    <input type="range" aria-label="Place of the cut" hidden> <button type="button" title="The other half" aria-label="The other half" hidden>⇄</button>
  </div>
  <details class="choice" hidden>
    <summary>Parts</summary>
    <input type="search" placeholder="Name" aria-label="Name of parts" hidden>
    <ul></ul>
    <p></p>
  </details>`;

export class Panel {
  #choices = []; // of what can be shown

  /**
   * @param {HTMLElement} root filled with the menus
   * @param {{field: (name: string) => void, colormap: (name: string) => void, warp: (name: string, scale: number) => void,
   *   clip: (change: {axis?: number|null, place?: number, turn?: boolean}) => void, hide: (names: Set<string>) => void}} on called for what
   *   the user asks for; field "" is the materials; axis null: no cut
   */
  constructor(root, on) {
    root.innerHTML = MARKUP;
    this.root = root;
    this.on = on;
    [this.fields, this.colormaps] = root.querySelectorAll("select");
    this.parts = root.querySelector("details");
    this.filter = root.querySelector("input[type=search]");
    this.warp = root.querySelector(".warp");
    [this.warpName, this.slider, this.scale] = this.warp.children;
    this.clip = root.querySelector(".clip");
    this.axes = [...this.clip.querySelectorAll("[aria-pressed]")];
    this.cutPlace = this.clip.querySelector("input");
    this.turn = this.clip.lastElementChild;
    this.list = root.querySelector("ul");
    this.more = root.querySelector("p");
    this.names = [];
    this.hidden = new Set();
    this.colormaps.append(...COLORMAPS.map((name) => new Option(name, name)));
    this.fields.addEventListener("change", () => on.field(this.fields.value));
    this.colormaps.addEventListener("change", () => on.colormap(this.colormaps.value));
    for (const input of [this.slider, this.scale]) {
      input.addEventListener("input", () => Number.isFinite(input.valueAsNumber) && on.warp(this.mover, input.valueAsNumber));
    }
    this.axes.forEach((button, axis) => button.addEventListener("click", () => on.clip({ axis: button.ariaPressed === "true" ? null : axis })));
    this.cutPlace.addEventListener("input", () => on.clip({ place: this.cutPlace.valueAsNumber }));
    this.turn.addEventListener("click", () => on.clip({ turn: true }));
    this.filter.addEventListener("input", () => this.#listParts());
    this.list.addEventListener("change", ({ target }) => this.#toggle(this.names[target.value], target.checked));
  }

  /** @param {import("../geometry_video.js").GeometryVideo} video @param {string[]} parts their names, each once */
  setVideo(video, parts) {
    const [plain, ...shown] = (this.#choices = choicesOf(video));
    this.fields.replaceChildren(new Option(plain, ""), ...shown.map((name) => new Option(labelOf(video, name), name)));
    this.fields.parentElement.hidden = !shown.length;
    this.names = parts;
    this.hidden = new Set();
    this.clip.hidden = !video.volume;
    this.parts.hidden = parts.length < 2;
    this.parts.open = false;
    this.filter.hidden = parts.length < MANY;
    this.filter.value = "";
    this.#listParts();
    this.setField("", COLORMAPS[0], false);
  }

  /** Whether another video has other choices than the one before. */
  differs(video, parts) {
    return JSON.stringify([choicesOf(video), parts]) !== JSON.stringify([this.#choices, this.names]);
  }

  clear() {
    for (const choice of this.root.children) choice.hidden = true;
    this.mover = null;
  }

  setField(name, colormap, hasMap) {
    this.fields.value = name;
    this.colormaps.value = colormap;
    this.colormaps.parentElement.hidden = !hasMap;
  }

  /**
   * How far a field moves the mesh.
   *
   * @param {string|null} name of the field; null: none can
   * @param {number} scale @param {number} most where the slider ends; it does not shrink while the field stays
   */
  setWarp(name, scale, most) {
    const isNew = this.mover !== name;
    this.mover = name;
    this.warp.hidden = name === null;
    if (name === null) return;
    const reach = Math.max(most, Math.abs(scale), isNew ? 0 : Number(this.slider.max));
    Object.assign(this.slider, { min: scale < 0 || (!isNew && this.slider.min < 0) ? -reach : 0, max: reach, step: reach / 1000 });
    this.warpName.textContent = `Move by ${name} ×`;
    this.slider.value = scale;
    if (this.scale.valueAsNumber !== scale) this.scale.value = Number(scale.toPrecision(6));
  }

  /** @param {{axis: number, low: number, high: number, place: number}|null} range where a cut is and can be; null: there is none */
  setClip(range) {
    if (range) this.clip.hidden = false;
    this.axes.forEach((button, axis) => (button.ariaPressed = String(axis === range?.axis)));
    this.cutPlace.hidden = this.turn.hidden = !range;
    if (!range) return;
    const { low, high, place } = range;
    const [min, max] = [Math.min(low, place), Math.max(high, place)];
    Object.assign(this.cutPlace, { min, max, step: (max - min) / 1000 || 1 });
    this.cutPlace.value = place;
  }

  /** @param {Set<string>} names */
  setHidden(names) {
    this.hidden = names;
    this.#listParts();
  }

  #listParts() {
    const wanted = this.filter.value.toLowerCase();
    const found = [...this.names.keys()].filter((i) => this.names[i].toLowerCase().includes(wanted));
    this.list.replaceChildren(...found.slice(0, MOST_LISTED).map((i) => this.#row(i)));
    this.more.textContent = found.length > MOST_LISTED ? `and ${found.length - MOST_LISTED} more` : "";
  }

  #row(i) {
    const [row, label, box] = ["li", "label", "input"].map((name) => document.createElement(name));
    Object.assign(box, { type: "checkbox", value: i, checked: !this.hidden.has(this.names[i]) });
    label.append(box, this.names[i] || "(no name)");
    row.append(label);
    return row;
  }

  #toggle(name, isShown) {
    const hidden = new Set(this.hidden);
    if (isShown) hidden.delete(name);
    else hidden.add(name);
    this.hidden = hidden;
    this.on.hide(hidden);
  }
}

/** What a video can be shown by: its surface, and fields. */
function choicesOf({ materials, fields }) {
  const shown = [...fields.keys()].filter((name) => fields.get(name).kind !== "normal"); // they have one length
  return [materials.length ? "material" : "surface", ...shown];
}

function labelOf({ fields }, name) {
  const { components, kind } = fields.get(name);
  return components > 1 && kind !== "color" ? `${name} (length)` : name;
}
