/** Materials as three.js draws them. */

import {
  DoubleSide,
  FrontSide,
  LinearSRGBColorSpace,
  MeshBasicMaterial,
  MeshLambertMaterial,
  MeshPhysicalMaterial,
  MeshStandardMaterial,
} from "three";

import { LAYER_COLOURS, LAYERS } from "../asset/materials.js";

export const OFFSET = { polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 }; // so that wires lie in front
const GREY = 0xb9c4d0;
const NO_LAYERS = new Set(["emissive_strength", "diffuse_transmission", "diffuse_transmission_color"]); // three.js has none, or needs none
const MAPS = { // of MeshPhysicalMaterial, by field; whether their samples are colours
  clearcoatMap: ["clearcoat_texture", false],
  clearcoatRoughnessMap: ["clearcoat_roughness_texture", false],
  clearcoatNormalMap: ["clearcoat_normal_texture", false],
  transmissionMap: ["transmission_texture", false],
  thicknessMap: ["thickness_texture", false],
  specularIntensityMap: ["specular_texture", false],
  specularColorMap: ["specular_color_texture", true],
  sheenColorMap: ["sheen_color_texture", true],
  sheenRoughnessMap: ["sheen_roughness_texture", false],
  iridescenceMap: ["iridescence_texture", false],
  iridescenceThicknessMap: ["iridescence_thickness_texture", false],
  anisotropyMap: ["anisotropy_texture", false],
};

/** What a mesh without a material looks like. */
export function plainMaterial(hasColours) {
  return new MeshLambertMaterial({ color: hasColours ? 0xffffff : GREY, vertexColors: hasColours, side: DoubleSide, ...OFFSET });
}

/**
 * @param {object} given of the video (`asset/materials.js`)
 * @param {import("./textures.js").Textures} textures
 * @param {Map<string, number>} channels uv sets by name
 * @param {{hasColours: boolean, gloss: boolean}} scene whether vertex colours multiply its base colour; whether it has gloss
 * @returns {MeshBasicMaterial|MeshLambertMaterial|MeshStandardMaterial|MeshPhysicalMaterial}
 */
export function makeMaterial(given, textures, channels, { hasColours, gloss }) {
  const Lit = hasLayers(given) ? MeshPhysicalMaterial : gloss ? MeshStandardMaterial : MeshLambertMaterial;
  const material = given.unlit ? new MeshBasicMaterial(OFFSET) : new Lit(OFFSET);
  const [red, green, blue, alpha] = given.base_color.map((factor) => Math.min(1, Math.max(0, factor)));
  material.name = given.name;
  material.color.setRGB(red, green, blue, LinearSRGBColorSpace);
  material.map = textures.make(given.base_color_texture, channels, true);
  material.vertexColors = hasColours;
  material.side = given.double_sided ? DoubleSide : FrontSide;
  setAlpha(material, given, alpha);
  if (!given.unlit) setSurface(material, given, textures, channels);
  return material;
}

/** Whether a material has layers beside glTF's own model: a clear coat, sheen, or others. */
function hasLayers(given) {
  const differs = ([name, value]) => !NO_LAYERS.has(name) && String(given[name]) !== String(value);
  return [...Object.entries(LAYERS), ...Object.entries(LAYER_COLOURS)].some(differs);
}

function setLayers(material, given, textures, channels) {
  const colour = (target, factors) => target.setRGB(...factors.map((factor) => Math.max(0, factor)), LinearSRGBColorSpace);
  for (const name of ["clearcoat", "transmission", "thickness", "ior", "iridescence", "dispersion"]) material[name] = given[name];
  material.clearcoatRoughness = given.clearcoat_roughness;
  material.attenuationDistance = given.attenuation_distance > 0 ? given.attenuation_distance : Infinity;
  colour(material.attenuationColor, given.attenuation_color);
  material.specularIntensity = given.specular;
  colour(material.specularColor, given.specular_color);
  material.sheen = given.sheen_color.some((factor) => factor > 0) ? 1 : 0;
  colour(material.sheenColor, given.sheen_color);
  material.sheenRoughness = given.sheen_roughness;
  material.iridescenceIOR = given.iridescence_ior;
  material.iridescenceThicknessRange = [given.iridescence_thickness_minimum, given.iridescence_thickness_maximum];
  material.anisotropy = given.anisotropy_strength;
  material.anisotropyRotation = given.anisotropy_rotation;
  for (const [map, [role, isColour]] of Object.entries(MAPS)) material[map] = textures.make(given[role], channels, isColour);
  const { scale } = given.clearcoat_normal_texture ?? { scale: 1 };
  material.clearcoatNormalScale.set(scale, -scale);
}

function setAlpha(material, given, alpha) {
  if (given.alpha_mode === "mask") {
    material.alphaTest = given.alpha_cutoff;
    material.opacity = alpha;
  }
  if (given.alpha_mode === "blend") {
    material.transparent = true;
    material.depthWrite = false;
    material.opacity = alpha;
  }
}

function setSurface(material, given, textures, channels) {
  if (material.isMeshStandardMaterial) {
    material.metalness = Math.min(1, Math.max(0, given.metallic));
    material.roughness = Math.min(1, Math.max(0, given.roughness));
    material.metalnessMap = material.roughnessMap = textures.make(given.metallic_roughness_texture, channels, false);
  }
  if (material.isMeshPhysicalMaterial) setLayers(material, given, textures, channels);
  material.normalMap = textures.make(given.normal_texture, channels, false);
  const { scale } = given.normal_texture ?? { scale: 1 };
  material.normalScale.set(scale, -scale); // v runs downwards, and three.js derives tangents from it
  material.aoMap = textures.make(given.occlusion_texture, channels, false);
  material.aoMapIntensity = given.occlusion_texture?.scale ?? 1;
  material.emissiveMap = textures.make(given.emissive_texture, channels, true);
  material.emissive.setRGB(...given.emissive.map((factor) => Math.max(0, factor)), LinearSRGBColorSpace);
}
