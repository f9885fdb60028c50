/** What the colours of a field mean: its name and unit, the colour map, and values along it. */

import { cssGradient } from "../three/colormaps.js";

const TICKS = 3;

export class Legend {
  /** @param {HTMLElement} root */
  constructor(root) {
    root.innerHTML = '<p></p><div class="map"></div><ol></ol>';
    this.root = root;
    [this.title, this.map, this.ticks] = root.children;
    this.hide();
  }

  hide() {
    this.root.hidden = true;
  }

  /**
   * @param {import("../fields/coded_field.js").CodedField} field @param {string} colormap @param {[number, number]} range
   * @param {boolean} isLog whether colours follow the logarithm
   */
  show(field, colormap, [low, high], isLog) {
    this.title.textContent = field.unit ? `${titleOf(field)}, ${field.unit}` : titleOf(field);
    this.title.title = field.bound ? `within ${formatNumber(field.bound, field.bound)}` : "";
    this.map.style.background = cssGradient(colormap);
    const at = (part) => (isLog ? low * (high / low) ** part : low + part * (high - low));
    const values = Array.from({ length: TICKS }, (_, i) => at(i / (TICKS - 1)));
    const items = (high > low ? values : [low]).map((value) => {
      const item = document.createElement("li");
      item.textContent = isLog ? String(Number(value.toPrecision(3))) : formatNumber(value, high - low);
      return item;
    });
    this.ticks.replaceChildren(...items);
    this.root.hidden = false;
  }
}

/** What is shown of a field: a length of vectors. */
export function titleOf({ name, components }) {
  return components > 1 ? `|${name}|` : name;
}

/** Four digits of the span are enough to read a colour. */
export function formatNumber(value, span) {
  if (value === 0 || Math.abs(value) < span * 1e-6) return "0";
  const size = Math.max(Math.abs(value), span);
  if (size >= 1e6 || size < 1e-3) return value.toExponential(2).replace("e+", "e");
  const decimals = Math.min(6, Math.max(0, 2 - Math.floor(Math.log10(span || size))));
  const text = value.toFixed(decimals);
  return Number(text) === 0 ? "0" : text;
}
