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
import { MOVING } from "../asset/materials.js";

const WRAPS = { repeat: RepeatWrapping, mirror: MirroredRepeatWrapping, clamp: ClampToEdgeWrapping };
const MAX_SIDE = 4096; // pixels: larger images are made smaller, to spare memory
const BLANK = { data: new Uint8Array([255, 255, 255, 255]), width: 1, height: 1 }; // in place of what is given up
const OPTIONS = { imageOrientation: "none", premultiplyAlpha: "none", colorSpaceConversion: "none" };

export class Textures {
  #bitmaps = new Map(); // image -> ImageBitmap, null if it cannot be shown
  #made = new Map(); // by what they are of
  #moving = []; // [texture, number of its image]

  /**
   * @param {{name: string, mediaType: string, data: Uint8Array}[]} images of the video
   * @param {Iterable<number>} wanted which of them
   * @param {number} anisotropy
   * @param {Map<number, ImageBitmap>} moving pictures of those that move, which the caller frees
   * @returns {Promise<Textures>}
   */
  static async open(images, wanted, anisotropy, moving) {
    const textures = new Textures();
    textures.anisotropy = anisotropy;
    textures.images = images;
    /** What cannot be shown, a line each. */
    textures.notes = [];
    /** Of images that move, the pictures shown. */
    textures.pictures = new Map();
    for (const number of wanted) { // one after the other, so that few are in memory as pixels twice
      const { name, mediaType, data } = images[number];
      if (mediaType === MOVING) {
        textures.pictures.set(number, moving.get(number) ?? null);
        continue;
      }
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
    const bitmap = texture && (this.pictures.get(texture.image) ?? this.#bitmaps.get(texture.image));
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
    if (this.pictures.has(texture.image)) this.#moving.push([made, texture.image]);
    return made;
  }

  /** Show other pictures of images that move. @param {Map<number, ImageBitmap>} pictures */
  show(pictures) {
    this.pictures = pictures;
    for (const [texture, number] of this.#moving) {
      const picture = pictures.get(number) ?? BLANK;
      if (texture.image === picture) continue;
      if (picture === BLANK) texture.dispose(); // it has another size
      texture.image = picture;
      texture.needsUpdate = true;
    }
  }

  dispose() {
    for (const texture of this.#made.values()) texture.dispose();
    for (const bitmap of this.#bitmaps.values()) bitmap?.close();
    this.#made.clear();
    this.#moving = [];
    this.pictures.clear();
    this.#bitmaps.clear();
  }
}

/** Numbers of the images that materials show. */
export function shownImages({ materials }) {
  const textures = materials.flatMap((material) => Object.values(material).filter((value) => value?.uv !== undefined));
  return new Set(textures.map(({ image }) => image));
}

/**
 * The images that materials of a video show, decoded; of those that move, the pictures of a frame.
 *
 * @param {import("../geometry_video.js").GeometryVideo} video @param {number} anisotropy
 * @param {import("../moving/moving_images.js").MovingImages|null} moving @param {number} frame
 * @returns {Promise<Textures>}
 */
export function openTextures(video, anisotropy, moving = null, frame = 0) {
  return Textures.open(video.images, shownImages(video), anisotropy, moving?.show(frame) ?? new Map());
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
