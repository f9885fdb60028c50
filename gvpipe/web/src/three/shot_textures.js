/** Textures of the shots of a capture that are open. Shots of the same images share theirs. */

import { openTextures } from "./textures.js";

export class ShotTextures {
  #anisotropy;
  #ofShot = new Map(); // shot -> {images, opened: promise of Textures, textures: null until then}
  #shown; // one of these, perhaps of a shot that is closed

  /** @param {number} shot that is shown @param {import("./textures.js").Textures} textures of it @param {number} anisotropy */
  constructor(shot, textures, anisotropy) {
    this.#anisotropy = anisotropy;
    this.#shown = { images: textures.images, opened: Promise.resolve(textures), textures };
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
    const entry = { images: video.images, opened: openTextures(video, this.#anisotropy), textures: null };
    entry.opened.then((textures) => (entry.textures = textures));
    return entry;
  }

  #drop(entry) {
    if (entry === this.#shown || [...this.#ofShot.values()].includes(entry)) return;
    entry.opened.then((textures) => textures.dispose());
  }
}

/** Whether images are the same bytes: shots share sections of the file. */
function areSame(images, others) {
  return images.length === others.length && images.every(({ data, mediaType }, i) => data === others[i].data && mediaType === others[i].mediaType);
}
