/** Materials and images of section `asset`, checked; what is left out has its default. Mirrors `gvpipe.asset.material`. */

import { AssetEntry } from "./asset_entry.js";

/** Media type of images that move (`moving/moving_images.js`). */
export const MOVING = "video/mp4";

const TEXTURES = [
  "base_color_texture",
  "metallic_roughness_texture",
  "normal_texture",
  "occlusion_texture",
  "emissive_texture",
  "clearcoat_texture",
  "clearcoat_roughness_texture",
  "clearcoat_normal_texture",
  "transmission_texture",
  "thickness_texture",
  "specular_texture",
  "specular_color_texture",
  "sheen_color_texture",
  "sheen_roughness_texture",
  "iridescence_texture",
  "iridescence_thickness_texture",
  "anisotropy_texture",
  "diffuse_transmission_texture",
  "diffuse_transmission_color_texture",
];

/** Numbers beside those of glTF's own model, and colours, with their defaults. */
export const LAYERS = {
  emissive_strength: 1,
  clearcoat: 0,
  clearcoat_roughness: 0,
  transmission: 0,
  thickness: 0,
  attenuation_distance: 0,
  ior: 1.5,
  specular: 1,
  sheen_roughness: 0,
  iridescence: 0,
  iridescence_ior: 1.3,
  iridescence_thickness_minimum: 100,
  iridescence_thickness_maximum: 400,
  anisotropy_strength: 0,
  anisotropy_rotation: 0,
  dispersion: 0,
  diffuse_transmission: 0,
};
export const LAYER_COLOURS = {
  attenuation_color: [1, 1, 1],
  specular_color: [1, 1, 1],
  sheen_color: [0, 0, 0],
  diffuse_transmission_color: [1, 1, 1],
};
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
    for (const [name, value] of Object.entries(LAYERS)) material[name] = entry.number(name, value, -HUGE, HUGE);
    for (const [name, value] of Object.entries(LAYER_COLOURS)) material[name] = entry.numbers(name, 3, value, -HUGE, HUGE);
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

/** Of images that move, data is null. @returns {{name: string, mediaType: string, data: Uint8Array|null}[]} */
export function readImages(list, payload) {
  return list.map((given, number) => {
    const entry = new AssetEntry(given, `image ${number}`);
    const mediaType = entry.text("media_type", "");
    const data = mediaType === MOVING ? null : payload.section(entry.text("section"));
    return { name: entry.text("name", ""), mediaType, data };
  });
}
