/** The moving textures of a video: for each the picture of any frame, decoded when it is needed. Mirrors `gvpipe.asset_coding.moving_textures`. */

import { AssetEntry } from "../asset/asset_entry.js";
import { MOVING } from "../asset/materials.js";
import { fileOf } from "../format/companion_parts.js";
import { GeometryVideoError } from "../format/errors.js";
import { readSamples } from "../track.js";
import { DecodedTrack } from "./decoded_track.js";
import { SoughtTrack } from "./sought_track.js";

const KIND = "texture"; // of companions
const MAX_SIDE = 16384;
const BYTES_PER_PIXEL = 4;
const PICTURES = 4; // that are in memory at least
const MAX_CRC = 2 ** 32 - 1;

export class MovingImages {
  #tracks = new Map(); // image -> DecodedTrack or SoughtTrack

  /**
   * Those of the images that move, as far as this browser shows them.
   *
   * @param {object[]} images of the video @param {Iterable<number>} wanted which of them
   * @param {import("../format/companion_parts.js").Companion[]} companions
   * @param {{frames: number, fps: number}} header @param {import("../format/budget.js").Budget} budget
   * @returns {Promise<MovingImages>}
   */
  static async open(images, wanted, companions, header, budget) {
    const moving = new MovingImages();
    for (const number of wanted) {
      if (images[number].mediaType !== MOVING) continue;
      try {
        const companion = companions.find(({ kind, about }) => kind === KIND && about.image === number);
        if (!companion) throw new GeometryVideoError("corrupt", "its track is not in the file");
        moving.#tracks.set(number, await openTrack(companion, header, budget));
      } catch (error) {
        moving.notes.push(`image ${images[number].name || number} is not shown: ${error.message}`);
      }
    }
    return moving;
  }

  /** What is not shown, a line each. */
  notes = [];

  /** Called with a line when a track is given up: its pictures are no longer shown, and the mesh still moves. */
  lost = () => {};

  /** Whether any image moves. */
  get isEmpty() {
    return !this.#tracks.size;
  }

  /** A promise that all pictures of a frame are here. A track that cannot be decoded is given up. @param {number} frame */
  async ready(frame) {
    const one = async ([number, track]) => {
      try {
        await track.ready(frame);
      } catch (error) {
        if (error.kind !== "corrupt" && error.kind !== "unsupported") throw error; // it may yet come
        if (!this.#tracks.delete(number)) return;
        track.close();
        this.notes.push(error.message);
        this.lost(error.message);
      }
    };
    await Promise.all([...this.#tracks].map(one));
  }

  /** The pictures of a frame by image, for as long as no others are asked for; null if one is not here. @returns {Map<number, ImageBitmap>|null} */
  show(frame) {
    if (![...this.#tracks.values()].every(({ kept }) => kept.has(frame))) return null;
    return new Map([...this.#tracks].map(([number, track]) => [number, track.show(frame)]));
  }

  close() {
    for (const track of this.#tracks.values()) track.close();
    this.#tracks.clear();
  }
}

async function openTrack(companion, { frames, fps }, budget) {
  const about = new AssetEntry(companion.about, "a moving texture");
  const size = ["width", "height"].map((name) => about.integer(name, undefined, 1, MAX_SIDE));
  budget.ask(`a moving texture of ${size.join("x")}`, PICTURES * BYTES_PER_PIXEL * size[0] * size[1]);
  const { start, length } = companion;
  const track = readSamples(companion.trak, start + length);
  const count = track.groups.reduce((sum, group) => sum + group.length, 0);
  if (count !== frames) throw new GeometryVideoError("corrupt", `it has ${count} pictures in place of ${frames}`);
  if (track.groups.flat().some(({ offset }) => offset < start)) throw new GeometryVideoError("corrupt", "a picture lies outside of it");
  if (await DecodedTrack.plays(track)) return new DecodedTrack(track, size, companion.read, checksumsOf(about, track.groups));
  return SoughtTrack.open(await fileOf(companion), fps, frames, size);
}

/** Checksums of the groups, or null where a file has none for these. */
function checksumsOf(about, groups) {
  const given = about.given.groups;
  if (!Array.isArray(given) || given.length !== groups.length) return null;
  const isOne = (pair, number) => Array.isArray(pair) && pair[0] === groups[number].length && Number.isInteger(pair[1]) && pair[1] >= 0 && pair[1] <= MAX_CRC;
  return given.every(isOne) ? given.map(([, checksum]) => checksum) : null;
}
