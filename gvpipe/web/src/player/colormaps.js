/**
 * Colour maps of fields, by anchors that lie evenly between low and high.
 *
 * Sources: viridis by N. Smith and S. van der Walt (matplotlib; CC0). Coolwarm after K. Moreland, Diverging Color Maps for
 * Scientific Visualization, 2009: computed from his formula, from (59, 76, 192) to (180, 4, 38).
 */

const ANCHORS = {
  viridis:
    "440154470d6048186a482374472d7b4536814240863f49893b528b375a8d33638d2f6a8e2c728e297a8e26818e23898e" +
    "21908c1f988b1f9f8821a68528ae8031b57b3ebc744cc26c5dc9636ece5882d34c96d83fabdc32c0df24d5e21aeae51afde725",
  coolwarm: "3b4cc06264d3827be39d91eeb4a6f5c6b9f7d3c9f3dbd5eaddddddecd3c6f6c4aef9b095f5997dec7e65de604ecb3d39b40426",
};
export const COLORMAPS = Object.keys(ANCHORS);
export const SIZE = 256; // colours of a table
export const HOLE = [150, 150, 150]; // where a field has no value

/** `Uint8Array` (SIZE, 3): sRGB colours from low to high. */
export function colourTable(name) {
  const anchors = ANCHORS[name].match(/.{6}/g).map((hex) => [0, 2, 4].map((i) => parseInt(hex.slice(i, i + 2), 16)));
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
  return `linear-gradient(to right, ${ANCHORS[name].match(/.{6}/g).map((hex) => `#${hex}`).join(", ")})`;
}
