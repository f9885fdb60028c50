/** Textures of the shots of a capture that are open. Shots of the same images share theirs. */

import { MOVING } from "../asset/materials.js";
import { openTextures, shownImages } from "./textures.js";

export class ShotTextures {
  #anisotropy;
  #ofShot = new Map(); // shot -> {images, opened: promise of Textures, textures: null until then, moving: MovingImages, or null}
  #shown; // one of these, perhaps of a shot that is closed

  /**
   * @param {number} shot that is shown @param {import("./textures.js").Textures} textures of it
   * @param {import("../moving/moving_images.js").MovingImages} moving of it @param {number} anisotropy
   */
  constructor(shot, textures, moving, anisotropy) {
    this.#anisotropy = anisotropy;
    this.#shown = { images: textures.images, opened: Promise.resolve(textures), textures, moving };
    this.#ofShot.set(shot, this.#shown);
  }

  /** Have those of a shot. @param {import("../geometry_video.js").GeometryVideo} video of the shot @returns {Promise<import("./textures.js").Textures>} */
  ready(video, shot) {
    if (!this.#ofShot.has(shot)) this.#ofShot.set(shot, this.#find(video.images) ?? this.#open(video));
    return this.#ofShot.get(shot).opened;
  }

  /** Those of a shot that is shown from now on; null if they are not ready. */
  show(shot) {
    const entry = this.#ofShot.get(shot);
    if (!entry?.textures) return null;
    const before = this.#shown;
    this.#shown = entry;
    this.#drop(before);
    return entry.textures;
  }

  /** Images that move, of the shot that is shown; its video closes them. */
  get moving() {
    return this.#shown.moving;
  }

  /** Whether those of a shot are shown. */
  isShown(shot) {
    return this.#shown === this.#ofShot.get(shot);
  }

  /** That a shot is closed. */
  closed(shot) {
    const entry = this.#ofShot.get(shot);
    this.#ofShot.delete(shot);
    if (entry) this.#drop(entry);
  }

  dispose() {
    for (const { opened } of new Set([this.#shown, ...this.#ofShot.values()])) opened.then((textures) => textures.dispose());
    this.#ofShot.clear();
  }

  #find(images) {
    return [this.#shown, ...this.#ofShot.values()].find((entry) => areSame(entry.images, images));
  }

  #open(video) {
    const entry = { images: video.images, opened: null, textures: null, moving: null };
    const open = async () => {
      entry.moving = await video.openMoving(shownImages(video));
      entry.textures = await openTextures(video, this.#anisotropy, entry.moving, 0);
      return entry.textures;
    };
    entry.opened = open();
    return entry;
  }

  #drop(entry) {
    if (entry === this.#shown || [...this.#ofShot.values()].includes(entry)) return;
    entry.opened.then((textures) => textures.dispose());
  }
}

/** Whether images are the same bytes, and none moves: shots share sections of the file. */
function areSame(images, others) {
  if (images.some(({ mediaType }) => mediaType === MOVING)) return false;
  return images.length === others.length && images.every(({ data, mediaType }, i) => data === others[i].data && mediaType === others[i].mediaType);
}
