/** Texture coordinates and colours of a video as WebGL takes them. */

const MAX_CHANNELS = 3; // of three.js's four; the last one is for fields

/**
 * The uv sets that materials use, by name, and their numbers.
 *
 * @param {object[]} materials @param {Map<string, object>} attributes
 * @returns {{channels: Map<string, number>, notes: string[]}}
 */
export function uvChannels(materials, attributes) {
  const channels = new Map();
  const notes = new Set();
  for (const material of materials) {
    for (const texture of Object.values(material).filter((value) => value?.uv !== undefined)) {
      const { uv } = texture;
      if (channels.has(uv)) continue;
      const attribute = attributes.get(uv);
      if (!attribute || attribute.components !== 2) notes.add(`textures by '${uv}' are not shown: it has no such coordinates`);
      else if (channels.size === MAX_CHANNELS) notes.add(`textures by '${uv}' are not shown: only ${MAX_CHANNELS} sets of coordinates are`);
      else channels.set(uv, channels.size);
    }
  }
  return { channels, notes: [...notes] };
}

/** The colours that are shown: attribute `color`, or else the first of that kind. */
export function colourAttribute(attributes) {
  const isColour = (attribute) => attribute?.kind === "color";
  const first = attributes.get("color");
  return (isColour(first) ? first : [...attributes.values()].find(isColour)) ?? null;
}

/** (R, 2): coordinates from the upper left, as glTF and WebGL's pictures have them. @param {Uint32Array} entries (R) */
export function uvArray({ values }, entries) {
  const array = new Float32Array(2 * entries.length);
  for (let r = 0; r < entries.length; r++) {
    array[2 * r] = values[2 * entries[r]];
    array[2 * r + 1] = 1 - values[2 * entries[r] + 1];
  }
  return array;
}

/**
 * (R, 4): linear colours, 0..1.
 *
 * @param {Uint32Array} entries (R)
 * @param {boolean} isAlone whether there are no materials: integers are then sRGB, as in PLY; beside materials linear, as in glTF
 */
export function colourArray({ values, components, fullScale }, entries, isAlone) {
  const array = new Float32Array(4 * entries.length).fill(1);
  const isSrgb = isAlone && fullScale > 1;
  for (let r = 0; r < entries.length; r++) {
    for (let i = 0; i < components; i++) {
      const value = Math.min(1, Math.max(0, values[components * entries[r] + i] / fullScale));
      array[4 * r + i] = isSrgb && i < 3 ? toLinear(value) : value;
    }
  }
  return array;
}

/** Linear light of an sRGB value, both 0..1. */
export function toLinear(value) {
  return value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4;
}
