/** Textures of a video's images, decoded by the browser. */

import {
  ClampToEdgeWrapping,
  LinearFilter,
  LinearMipmapLinearFilter,
  MirroredRepeatWrapping,
  NearestFilter,
  NearestMipmapNearestFilter,
  NoColorSpace,
  RepeatWrapping,
  SRGBColorSpace,
  Texture,
} from "three";

const WRAPS = { repeat: RepeatWrapping, mirror: MirroredRepeatWrapping, clamp: ClampToEdgeWrapping };
const MAX_SIDE = 4096; // pixels: larger images are made smaller, to spare memory
const OPTIONS = { imageOrientation: "none", premultiplyAlpha: "none", colorSpaceConversion: "none" };

export class Textures {
  #bitmaps = new Map(); // image -> ImageBitmap, null if it cannot be shown
  #made = new Map(); // by what they are of

  /**
   * @param {{name: string, mediaType: string, data: Uint8Array}[]} images of the video
   * @param {Iterable<number>} wanted which of them
   * @param {number} anisotropy
   * @returns {Promise<Textures>}
   */
  static async open(images, wanted, anisotropy) {
    const textures = new Textures();
    textures.anisotropy = anisotropy;
    textures.images = images;
    /** What cannot be shown, a line each. */
    textures.notes = [];
    for (const number of wanted) { // one after the other, so that few are in memory as pixels twice
      const { name, mediaType, data } = images[number];
      const bitmap = await decode(new Blob([data], { type: mediaType }));
      if (!bitmap) textures.notes.push(`image ${name || number} (${mediaType}) is not shown: browsers cannot decode it`);
      textures.#bitmaps.set(number, bitmap);
    }
    return textures;
  }

  /**
   * @param {import("../asset/materials.js").Texture|null} texture
   * @param {Map<string, number>} channels uv sets by name
   * @param {boolean} isColour whether its samples are sRGB
   * @returns {Texture|null} null if it cannot be shown
   */
  make(texture, channels, isColour) {
    const bitmap = texture && this.#bitmaps.get(texture.image);
    if (!bitmap || !channels.has(texture.uv)) return null;
    const key = JSON.stringify([texture, channels.get(texture.uv), isColour]);
    if (!this.#made.has(key)) this.#made.set(key, this.#make(texture, bitmap, channels, isColour));
    return this.#made.get(key);
  }

  #make(texture, bitmap, channels, isColour) {
    const made = new Texture(bitmap);
    made.flipY = false; // coordinates are turned instead, as glTF has them
    made.channel = channels.get(texture.uv);
    made.colorSpace = isColour ? SRGBColorSpace : NoColorSpace;
    [made.wrapS, made.wrapT] = texture.wrap.map((wrap) => WRAPS[wrap]);
    const isNearest = texture.filter === "nearest";
    made.magFilter = isNearest ? NearestFilter : LinearFilter;
    made.minFilter = isNearest ? NearestMipmapNearestFilter : LinearMipmapLinearFilter;
    made.anisotropy = this.anisotropy;
    const [c, s] = [Math.cos(texture.rotation), Math.sin(texture.rotation)];
    const [x, y] = texture.tiling;
    made.matrixAutoUpdate = false; // three.js turns before it tiles, glTF after
    made.matrix.set(x * c, y * s, texture.offset[0], -x * s, y * c, texture.offset[1], 0, 0, 1);
    made.needsUpdate = true;
    return made;
  }

  dispose() {
    for (const texture of this.#made.values()) texture.dispose();
    for (const bitmap of this.#bitmaps.values()) bitmap?.close();
    this.#made.clear();
    this.#bitmaps.clear();
  }
}

/** The images that materials of a video show, decoded. @returns {Promise<Textures>} */
export function openTextures({ materials, images }, anisotropy) {
  const textures = materials.flatMap((material) => Object.values(material).filter((value) => value?.uv !== undefined));
  return Textures.open(images, new Set(textures.map(({ image }) => image)), anisotropy);
}

async function decode(blob) {
  try {
    const whole = await createImageBitmap(blob, OPTIONS);
    const scale = MAX_SIDE / Math.max(whole.width, whole.height);
    if (scale >= 1) return whole;
    const size = { resizeWidth: Math.ceil(whole.width * scale), resizeHeight: Math.ceil(whole.height * scale) };
    const smaller = await createImageBitmap(whole, { ...OPTIONS, ...size, resizeQuality: "high" });
    whole.close();
    return smaller;
  } catch {
    return null;
  }
}
