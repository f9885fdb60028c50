/** Materials and images of section `asset`, checked; what is left out has its default. Mirrors `gvpipe.asset.material`. */

import { AssetEntry } from "./asset_entry.js";

const TEXTURES = [
  "base_color_texture",
  "metallic_roughness_texture",
  "normal_texture",
  "occlusion_texture",
  "emissive_texture",
];
const HUGE = 3.5e38; // above float32's largest number

/**
 * @typedef {object} Texture
 * @property {number} image
 * @property {string} uv name of the attribute with its coordinates
 * @property {number} scale
 * @property {[string, string]} wrap `repeat`, `mirror` or `clamp`
 * @property {string} filter `linear` or `nearest`
 * @property {number[]} offset @property {number} rotation @property {number[]} tiling as KHR_texture_transform has them
 *
 * @param {object[]} list @param {number} nImages
 * @returns {object[]} one object per material, with Python's names of its fields; absent textures are null
 */
export function readMaterials(list, nImages) {
  return list.map((given, number) => {
    const entry = new AssetEntry(given, `material ${number}`);
    const material = {
      name: entry.text("name", ""),
      base_color: entry.numbers("base_color", 4, [1, 1, 1, 1], -HUGE, HUGE),
      metallic: entry.number("metallic", 0, -HUGE, HUGE),
      roughness: entry.number("roughness", 1, -HUGE, HUGE),
      emissive: entry.numbers("emissive", 3, [0, 0, 0], -HUGE, HUGE),
      alpha_mode: entry.word("alpha_mode", ["opaque", "mask", "blend"], "opaque"),
      alpha_cutoff: entry.number("alpha_cutoff", 0.5, -HUGE, HUGE),
      double_sided: entry.flag("double_sided", false),
      unlit: entry.flag("unlit", false),
    };
    for (const role of TEXTURES) {
      material[role] = given[role] == null ? null : readTexture(new AssetEntry(given[role], `material ${number}, ${role}`), nImages);
    }
    return material;
  });
}

function readTexture(entry, nImages) {
  return {
    image: entry.integer("image", undefined, 0, nImages - 1),
    uv: entry.text("uv", "uv"),
    scale: entry.number("scale", 1, -HUGE, HUGE),
    wrap: entry.words("wrap", 2, ["repeat", "mirror", "clamp"], ["repeat", "repeat"]),
    filter: entry.word("filter", ["linear", "nearest"], "linear"),
    offset: entry.numbers("offset", 2, [0, 0], -HUGE, HUGE),
    rotation: entry.number("rotation", 0, -HUGE, HUGE),
    tiling: entry.numbers("tiling", 2, [1, 1], -HUGE, HUGE),
  };
}

/** @returns {{name: string, mediaType: string, data: Uint8Array}[]} */
export function readImages(list, payload) {
  return list.map((given, number) => {
    const entry = new AssetEntry(given, `image ${number}`);
    const data = payload.section(entry.text("section"));
    return { name: entry.text("name", ""), mediaType: entry.text("media_type", ""), data };
  });
}
