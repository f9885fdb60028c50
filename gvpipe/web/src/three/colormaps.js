/** Colour maps of fields, by anchors that lie evenly between low and high: those of `gvpipe.rasterizer.colormaps`. */

import { COLORMAPS_MAGMA as MAGMA, COLORMAPS_VIRIDIS as VIRIDIS } from "../constants.js";

const ANCHORS = {
  viridis: VIRIDIS,
  magma: MAGMA,
  coolwarm: // colours of Python's map at 0, 1/16, ..., 1
    "3b4cc06264d3827be39d91eeb4a6f5c6b9f7d3c9f3dbd5eaddddddecd3c6f6c4aef9b095f5997dec7e65de604ecb3d39b40426",
  gray: "000000ffffff",
};
export const COLORMAPS = Object.keys(ANCHORS);
export const SIZE = 256; // colours of a table
export const HOLE = [150, 150, 150]; // where a field has no value

/** `Uint8Array` (SIZE, 3): sRGB colours from low to high. */
export function colourTable(name) {
  const anchors = hexOf(name).map((hex) => [0, 2, 4].map((i) => parseInt(hex.slice(i, i + 2), 16)));
  const table = new Uint8Array(3 * SIZE);
  for (let i = 0; i < SIZE; i++) {
    const place = (i / (SIZE - 1)) * (anchors.length - 1);
    const before = Math.min(Math.floor(place), anchors.length - 2);
    const part = place - before;
    for (let channel = 0; channel < 3; channel++) {
      table[3 * i + channel] = Math.round((1 - part) * anchors[before][channel] + part * anchors[before + 1][channel]);
    }
  }
  return table;
}

/** The table as a CSS gradient. */
export function cssGradient(name) {
  return `linear-gradient(to right, ${hexOf(name).map((hex) => `#${hex}`).join(", ")})`;
}

function hexOf(name) {
  return ANCHORS[name].match(/[0-9a-f]{6}/g);
}
