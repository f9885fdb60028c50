/** The page's half of trajectory images: it decodes the pictures that `trajectory_reader.js` asks for as sections. */

import { DecodedPictures } from "../decoded_pictures.js";
import { RepeatedFrames } from "../format/repeated_frames.js";
import { openPictures } from "../pictures.js";
import { PLANES, countPictures, readHeader } from "./header.js";

/** The pictures of segment s, as a section. */
const NAME = /^pictures\.(\d+)$/;

/**
 * A payload with sections `pictures.s`: levels of all pixels of a segment's pictures, one picture after the other.
 *
 * @param {Uint8Array|import("../format/stream_file.js").StreamFile} source the file, or its parts
 * @param {import("../format/payload.js").Payload} payload
 * @returns {import("../format/payload.js").Payload & {close: () => void}} whose sections are promises
 * @throws {GeometryVideoError} its header is not one of trajectory images
 */
export function withPictures(source, payload) {
  const header = readHeader(payload.header);
  const counts = header.images.components.map(countPictures);
  const firsts = counts.map((_, s) => counts.slice(0, s).reduce((a, b) => a + b, 0));
  const size = [header.width, PLANES * header.height];
  const pixels = size[0] * size[1];
  const all = firsts.at(-1) + counts.at(-1);
  let pictures = null; // a promise
  let turn = Promise.resolve(); // one segment after the other

  async function decode(s) {
    const Levels = header.profile.depth > 8 ? Uint16Array : Uint8Array;
    payload.budget.ask(`pictures of segment ${s}`, Levels.BYTES_PER_ELEMENT * pixels * counts[s]);
    pictures ??= open(source, payload.header, size, header.profile, all);
    const decoder = await pictures;
    const levels = new Levels(pixels * counts[s]);
    for (let i = 0; i < counts[s]; i++) {
      await decoder.seek(firsts[s] + i);
      levels.set(decoder.current, pixels * i);
    }
    return levels;
  }

  async function section(name) {
    const found = NAME.exec(name);
    if (!found) return payload.section(name);
    const result = turn.then(() => decode(Number(found[1])));
    turn = result.catch(() => {});
    return result;
  }

  const names = [...payload.sections.keys(), ...counts.map((_, s) => `pictures.${s}`)];
  const close = () => pictures?.then((decoder) => decoder.close()).catch(() => {});
  return { header: payload.header, sections: new Map(names.map((name) => [name, null])), budget: payload.budget, section, close };
}

function open(source, { fps, container }, size, profile, count) {
  const repeated = new RepeatedFrames(count);
  const planes = { size, samples: Uint32Array.from({ length: size[0] * size[1] }, (_, pixel) => pixel), profile };
  if (source instanceof Uint8Array) return openPictures(source, fps, repeated, planes, { checksum: container.track_crc32 });
  return DecodedPictures.inParts(source, fps, repeated, planes);
}
