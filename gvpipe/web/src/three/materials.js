/** Materials as three.js draws them. */

import { DoubleSide, FrontSide, LinearSRGBColorSpace, MeshBasicMaterial, MeshLambertMaterial, MeshStandardMaterial } from "three";

export const OFFSET = { polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 }; // so that wires lie in front
const GREY = 0xb9c4d0;

/** What a mesh without a material looks like. */
export function plainMaterial(hasColours) {
  return new MeshLambertMaterial({ color: hasColours ? 0xffffff : GREY, vertexColors: hasColours, side: DoubleSide, ...OFFSET });
}

/**
 * @param {object} given of the video (`asset/materials.js`)
 * @param {import("./textures.js").Textures} textures
 * @param {Map<string, number>} channels uv sets by name
 * @param {{hasColours: boolean, gloss: boolean}} scene whether vertex colours multiply its base colour; whether it has gloss
 * @returns {MeshBasicMaterial|MeshLambertMaterial|MeshStandardMaterial}
 */
export function makeMaterial(given, textures, channels, { hasColours, gloss }) {
  const Lit = gloss ? MeshStandardMaterial : MeshLambertMaterial;
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
  material.normalMap = textures.make(given.normal_texture, channels, false);
  const { scale } = given.normal_texture ?? { scale: 1 };
  material.normalScale.set(scale, -scale); // v runs downwards, and three.js derives tangents from it
  material.aoMap = textures.make(given.occlusion_texture, channels, false);
  material.aoMapIntensity = given.occlusion_texture?.scale ?? 1;
  material.emissiveMap = textures.make(given.emissive_texture, channels, true);
  material.emissive.setRGB(...given.emissive.map((factor) => Math.max(0, factor)), LinearSRGBColorSpace);
}
